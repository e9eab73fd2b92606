"""The command `taskopt view`, which shows recordings, and raw logs in a layout for each purpose."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from typing import Annotated

import typer

from taskopt.errors import InvalidValue

viewing = typer.Typer()

_RAW = ".arrow"


Files = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="FILES",
        help="A recording, or a folder that has some; by default the newest recording. Or raw logs that end "
        "in .arrow: several are shown side by side.",
    ),
]
Layout = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Of raw logs: overview, limits, hierarchy, solver, comparison or figure; by default the "
        "overview, or the comparison of several.",
        show_default=False,
    ),
]
Save = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Of raw logs: only write the recording FILE.rrd.", show_default=False),
]
Picture = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write a picture (PNG) instead of opening a window.")
]
At = Annotated[
    float | None,
    typer.Option(metavar="SECONDS", help="Time in the run that the picture shows; by default the middle."),
]
Logs = Annotated[
    Path, typer.Option(metavar="FOLDER", help="Folder in which the newest recording is looked for.")
]


@viewing.command()
def view(
    files: Files = None,
    layout: Layout = None,
    save: Save = None,
    picture: Picture = None,
    at: At = None,
    logs: Logs = Path("logs"),
) -> None:
    """Open a recording, or raw logs, in the Rerun viewer."""
    from taskopt.recording.reading import find_recording

    given = files or [logs]
    raw = [file for file in given if file.suffix == _RAW]
    if not raw:
        if layout is not None or save is not None:
            raise InvalidValue("--layout and --save are for raw logs, which end in .arrow")
        if len(given) > 1:
            raise InvalidValue("one recording is shown at a time; several raw logs (.arrow) side by side")
        _show(find_recording(given[0]), picture, at)
    elif len(raw) < len(given):
        raise InvalidValue("show either recordings or raw logs, which end in .arrow")
    elif save is not None:
        typer.echo(f"wrote {_derived(raw, layout, save)}")
    elif picture is not None:
        with TemporaryDirectory(prefix="taskopt-") as folder:
            _show(_derived(raw, layout, Path(folder) / "view.rrd"), picture, at)
    else:
        from taskopt.recording.viewer.open import require_display

        require_display(raw[0])
        _show(_derived(raw, layout, Path(mkdtemp(prefix="taskopt-")) / f"{raw[0].stem}.rrd"), None, at)


def _derived(files: Sequence[Path], layout: str | None, path: Path) -> Path:
    """Derive a recording from raw logs."""
    from taskopt.log.reading import open_log
    from taskopt.recording.viewer.review.recording import record_logs

    opened = [open_log(file) for file in files]
    arms = sum(len(log.resolvers) for log in opened)
    return record_logs(opened, layout or ("overview" if arms == 1 else "comparison"), path)


def _show(recording: Path, picture: Path | None, at: float | None) -> None:
    """Open a recording in a window, or write a picture of it."""
    if picture is None:
        from taskopt.recording.viewer.open import show

        show(recording)
        return
    from taskopt.recording.viewer.picture import take_picture

    take_picture(recording, picture, at)
    typer.echo(f"wrote {picture}, a picture of {recording}")
