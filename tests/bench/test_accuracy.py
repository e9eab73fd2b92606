"""The accuracy benchmark: what it measures, and that its table fits."""

from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from taskopt.bench import accuracy
from taskopt.bench.accuracy import CELLS, SIGMA, Cell, damped_problem, jacobian, measure, table, verdict
from taskopt.resolver.closed_form import damped_inverse, pseudo_inverse
from taskopt.resolver.registry import resolve

EXACT = ["daqp", "clarabel", "proxqp", "quadprog"]


@pytest.mark.parametrize("smallest", SIGMA)
def test_problems_have_the_singular_values_that_they_are_filed_under(smallest: float) -> None:
    """From 1 down to σ_min."""
    sigma = np.linalg.svd(jacobian(np.random.default_rng(1), smallest), compute_uv=False)
    np.testing.assert_allclose(sigma[[0, -1]], [1.0, smallest], rtol=1e-9)


@pytest.mark.parametrize("k", [0.0, 0.1])
def test_the_problem_is_the_formula_where_nothing_binds(k: float) -> None:
    """(3.51), or (3.59) with k²."""
    rng = np.random.default_rng(2)
    J, v = jacobian(rng, 0.1), rng.normal(size=6)
    exact = (damped_inverse(J, k) if k else pseudo_inverse(J)) @ v
    x = resolve(damped_problem(J, v, k, 100.0), "hqp/daqp").x
    np.testing.assert_allclose(x, exact, rtol=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("room", [10.0, 0.5])
@pytest.mark.parametrize("family", ["hqp", "wqp"])
def test_no_answer_that_is_not_flagged_is_off_by_more_than_a_millionth(family: str, room: float) -> None:
    """σ_min from 1e-1 to 1e-6, damped or not, bounds that bind or not."""
    cells = [*measure(EXACT, family, trials=2, room=room)]
    assert len(cells) == CELLS * len(EXACT)
    assert max(cell.worst_unflagged for cell in cells) <= 1e-6
    if room > 1.0:
        assert not any(any(cell.flagged) for cell in cells)


def test_defaults_in_normal_equations_are_far_off_near_a_singularity() -> None:
    """The reason for all this: ProxQP at its defaults is wrong by more than a tenth at σ_min = 1e-6."""
    worst = max(max(cell.default) for cell in measure(["proxqp"], trials=2) if cell.sigma == SIGMA[-1])
    assert worst > 0.1


def test_only_answers_that_pass_count() -> None:
    """A flagged error is not held against the solver; an unflagged one is."""
    cell = Cell(
        "x", 0.1, 0.0, raw=[1e-9, 0.5], polished=[0.0, 0.0], flagged=[False, True], default=[1.0, 1.0]
    )
    assert cell.worst_unflagged == 1e-9
    cell.flagged[1] = False
    assert cell.worst_unflagged == 0.5
    assert "5.0e-01 (x, σ_min 1e-01, k = 0)" in verdict([cell])


def test_the_table_fits_120_columns() -> None:
    """Every solver and σ_min has its row, and no cell is cut off."""
    cells = [*measure(["daqp", "quadprog"], trials=1)]
    cells[0].default[0] = np.inf
    console = Console(width=120, record=True, file=StringIO())
    console.print(table(cells, "hqp", 10.0))
    text = console.export_text()
    assert "…" not in text
    assert "none" in text
    assert text.count("1e-06") >= 2
    assert max(map(len, text.splitlines())) <= 120


def test_a_trial_without_a_certified_optimum_is_left_out_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """No solver is blamed for what nobody knows; the line below the table says how many there were."""
    monkeypatch.setattr(accuracy, "_optimum", lambda problem: (np.full(problem.n, np.nan), False))
    cells = list(measure(("daqp",), trials=1, room=0.5))
    assert [(cell.raw, cell.unjudged) for cell in cells] == [([], 1)] * len(cells)
    known = next(iter(measure(("daqp",), trials=1)))
    assert f"optimum: {len(cells)} of {len(cells) + 1}" in verdict([known, *cells])
