"""The files of a sweep: its table in Markdown, all cases as CSV, and a plot."""

from pathlib import Path

from taskopt.bench.comparison.tables import markdown
from taskopt.bench.sweep.grid import Grid
from taskopt.bench.sweep.plot import has_numbers, write_plot
from taskopt.bench.sweep.sweep import read_sweep
from taskopt.bench.sweep.table import table, write_csv


def write_all(folder: Path, grid: Grid) -> tuple[str, list[Path]]:
    """Write the table, the cases and, if the first axis has numbers, the plot.

    Args:
        folder: Folder of the sweep.
        grid: The cases that are shown.

    Returns:
        The table in Markdown, and the files that were written.
    """
    done = read_sweep(folder, grid)
    text, files = markdown(table(done, grid)), [folder / "sweep.md", folder / "sweep.csv"]
    files[0].write_text(text, encoding="utf-8")
    write_csv(files[1], done, grid)
    if has_numbers(grid):
        files.append(folder / "sweep.svg")
        write_plot(files[-1], done, grid)
    return text, files
