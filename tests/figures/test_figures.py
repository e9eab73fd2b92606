"""The figures of the chapter: each is drawn, from what the text says it shows, and written to a file."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from taskopt.errors import MissingFile, UnknownName
from taskopt.figures.catalogue import FIGURES, render
from taskopt.figures.style import number

ROOT = Path(__file__).parents[2]
OF_RUNS = {"3.15", "3.16", "3.17", "3.18", "3.19", "3.20", "3.26", "3.27", "panda_workspace"}
STILL = sorted(set(FIGURES) - OF_RUNS)


def texts(figure: Figure) -> str:
    """Every title, label and note of a figure."""
    found = [text.get_text() for axes in figure.axes for text in axes.texts]
    return "\n".join([*found, *(axes.get_title("left") + axes.get_title("center") for axes in figure.axes)])


@pytest.mark.slow
@pytest.mark.parametrize("name", STILL)
def test_a_figure_without_a_run_is_drawn(name: str, tmp_path: Path) -> None:
    """It becomes a picture of the width of a page, with less than 300 kB."""
    (path,) = render([name], tmp_path)
    assert path.name == f"fig_{name.replace('.', '_')}.png"
    assert path.read_bytes()[16:20] == (836).to_bytes(4, "big")
    assert path.stat().st_size < 300_000


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_is_committed(name: str) -> None:
    """The pictures in docs/figures are those of the catalogue."""
    assert (ROOT / "docs" / "figures" / f"fig_{name.replace('.', '_')}.png").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(OF_RUNS))
def test_a_figure_of_a_run_is_drawn(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It needs nothing but the scenarios of the folder `tasks`."""
    monkeypatch.chdir(ROOT)
    (path,) = render([name], tmp_path)
    assert path.stat().st_size > 10_000


def test_what_is_not_there_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A number that is no figure, and a folder without scenarios, are named before anything is drawn."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UnknownName, match=r"no figure named '3\.14'"):
        next(render(["3.14"], tmp_path / "out"))
    with pytest.raises(MissingFile, match="fig_3_15_open_loop"):
        next(render(["3.15"], tmp_path))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("3.3", "σ₂ = 0.00"),
        ("3.4", "det J₂₂ = 0.000, rank 2"),
        ("3.5", "det $J_P$ = 0.000"),
        ("3.6", "det $J_P$ = 0.000"),
        ("3.9", "−sin ϑ = −0.717"),
    ],
)
def test_the_singular_figures_show_singular_postures(name: str, told: str) -> None:
    """The numbers in the titles are those of the analysis at the posture that is drawn."""
    assert told in texts(FIGURES[name]())


def test_the_ellipses_of_force_and_velocity_have_axes_in_inverse_proportion() -> None:
    """Figs 3.23 and 3.25 draw one posture with semi-axes whose products are 1, whatever the scales."""
    spans = []
    for name in ("3.23", "3.25"):
        (axes,) = FIGURES[name]().axes
        lines = [np.column_stack(line.get_data()) for line in axes.lines]
        outlines = [points for points in lines if len(points) == 181]
        spans.append([np.linalg.norm(points - points[:-1].mean(axis=0), axis=1) for points in outlines])
    for velocity, force in zip(*spans, strict=True):
        assert velocity.max() / 0.2 * force.min() / 0.08 == pytest.approx(1.0, abs=1e-3)
        assert velocity.min() / 0.2 * force.max() / 0.08 == pytest.approx(1.0, abs=1e-3)


def test_numbers_have_a_minus_sign_and_no_negative_zero() -> None:
    """−0.644 has a minus sign, and what rounds to zero has no sign."""
    assert number(-0.6442) == "−0.644"
    assert number(-1e-9) == "0.000"
