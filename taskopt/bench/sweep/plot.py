"""The plot of a sweep: tracking error over the first parameter, for each resolver."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from taskopt.bench.sweep.grid import Grid
from taskopt.bench.sweep.table import Done, column, groups

_FAR = 100.0  # values that are positive and further apart than this get a logarithmic axis


def write_plot(path: Path, done: Done, grid: Grid) -> None:
    """Draw the median of the tracking error, and the band of all runs, over the first parameter.

    Args:
        path: File of the picture; its ending decides on the format.
        done: Figures by case.
        grid: The cases; the first axis must have numbers.
    """
    figure = Figure(figsize=(7.5, 4.6), layout="constrained")
    axes = figure.add_subplot()
    found, first = groups(done), grid.axes[0]
    for resolver in grid.resolvers:
        points = []
        for value in first.values:
            mine = [
                figures
                for (settings, name), seeds in found.items()
                if name == resolver and settings[0] == f"{first.address}={value}"
                for figures in seeds
            ]
            errors = column(mine, "tracking")
            if len(errors):
                points.append((float(value), *np.percentile(errors, [0, 50, 100])))
        if points:
            x, low, middle, high = np.array(points).T
            (line,) = axes.plot(x, middle, marker=".", label=resolver)
            axes.fill_between(x, low, high, color=line.get_color(), alpha=0.15)
    numbers = np.array([float(value) for value in first.values])
    if numbers.min() > 0.0 and numbers.max() / numbers.min() >= _FAR:
        axes.set_xscale("log")
    axes.set(xlabel=first.address, ylabel="tracking error, root mean square [m]", yscale="log")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")
    figure.savefig(path)


def has_numbers(grid: Grid) -> bool:
    """Return True if the first axis can be drawn.

    Args:
        grid: The cases.

    Returns:
        True if there is one, and its values are numbers.
    """
    try:
        return bool(grid.axes) and all(np.isfinite(float(value)) for value in grid.axes[0].values)
    except ValueError:
        return False
