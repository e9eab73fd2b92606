"""The table of a sweep: for each combination of values and each resolver, figures over all seeds."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from taskopt.arrays import Array
from taskopt.bench.comparison.tables import Table
from taskopt.bench.sweep.case import FIGURES, TIMES, Figure
from taskopt.bench.sweep.grid import Case, Grid

Done = Mapping[Case, Mapping[str, Figure]]


def groups(done: Done) -> dict[tuple[tuple[str, ...], str], list[Mapping[str, Figure]]]:
    """Gather the seeds of each combination of values and resolver.

    Args:
        done: Figures by case.

    Returns:
        Figures of all seeds, by settings and resolver.
    """
    found: dict[tuple[tuple[str, ...], str], list[Mapping[str, Figure]]] = {}
    for case, figures in done.items():
        found.setdefault((case.settings, case.resolver), []).append(figures)
    return found


def column(seeds: Sequence[Mapping[str, Figure]], name: str) -> Array:
    """Return one figure of several seeds, those without a tick left out.

    Args:
        seeds: Figures of each seed.
        name: Name of the figure.

    Returns:
        The numbers.
    """
    values = np.array([float(figures[name]) for figures in seeds])
    return values[np.isfinite(values)]


def table(done: Done, grid: Grid) -> Table:
    """Make the table; no figure in it depends on how fast the cases were computed.

    Args:
        done: Figures by case.
        grid: The cases.

    Returns:
        One row for each combination of values and resolver.
    """
    note = (
        "Over all seeds. stopped: runs that ended early; error: root mean square of the tracking error over "
        "a run, median and largest of the runs [m]; last: largest error at the last tick [m]; jump: largest "
        "change of an answer in one tick [rad/s, m/s; at order 2 rad/s², m/s²]; active: share of the ticks "
        "at which a limit is active; claimed: share of the ticks; proven, refuted: of those that were judged."
    )
    heading = (
        *(one.address for one in grid.axes), "resolver", "runs", "stopped", "error p50", "error largest",
        "last", "jump", "active", "claimed", "proven", "refuted",
    )  # fmt: skip
    rows = tuple(
        (*(text.partition("=")[2] for text in settings), resolver, *_cells(seeds))
        for (settings, resolver), seeds in groups(done).items()
    )
    return Table("Sweep", note, heading, rows)


def _cells(seeds: Sequence[Mapping[str, Figure]]) -> Iterator[str]:
    """Yield the entries of a row of the table that come from its seeds."""
    errors, judged = column(seeds, "tracking"), float(column(seeds, "judged").sum())
    yield str(len(seeds))
    yield str(sum(figures["stopped"] != "" for figures in seeds))
    yield from (_number(errors, 50), _number(errors, 100))
    yield from (_number(column(seeds, name), 100) for name in ("tracking_last", "jump"))
    yield from (_share(column(seeds, name)) for name in ("active", "claimed"))
    for name in ("proven", "refuted"):
        yield _share(column(seeds, name).sum(keepdims=True) / judged) if judged else "–"


def write_csv(path: Path, done: Done, grid: Grid) -> None:
    """Write every case with all figures, also those of time.

    Args:
        path: The file.
        done: Figures by case.
        grid: The cases.
    """
    with path.open("w", encoding="utf-8", newline="") as file:
        lines = csv.writer(file)
        lines.writerow([*(one.address for one in grid.axes), "resolver", "seed", *FIGURES])
        for case, figures in done.items():
            values = (text.partition("=")[2] for text in case.settings)
            lines.writerow([*values, case.resolver, case.seed, *(figures[name] for name in FIGURES)])


def timeless(figures: Mapping[str, Figure]) -> dict[str, Figure]:
    """Return the figures that are the same whenever a case is computed.

    Args:
        figures: Figures of a case.

    Returns:
        Those of them that are no times.
    """
    return {name: value for name, value in figures.items() if name not in TIMES}


def _number(values: Array, percentile: float) -> str:
    """Return a percentile with three digits; a dash if there are no values."""
    return f"{np.percentile(values, percentile):.3g}" if len(values) else "–"


def _share(values: Array) -> str:
    """Return a mean share in per cent; a dash if there are no values."""
    return f"{100.0 * float(np.mean(values)):.4g} %" if len(values) else "–"
