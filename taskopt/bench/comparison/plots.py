"""The figures of a comparison, drawn by Matplotlib as SVG text."""

from collections.abc import Callable, Iterator
from io import StringIO
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from taskopt.bench.comparison.results import Results, all_figures, figures, growth, profile

_KEPT = 12  # curves of one figure; those that are worse are in the tables
_SIZE = (7.5, 4.6)  # [inch]
_FLOOR = 1e-17  # where a distance of zero is drawn


class Plot(NamedTuple):
    """A figure.

    Attributes:
        name: Name of its file, without ending.
        caption: What it shows, and how to read it.
        svg: The picture as text.
    """

    name: str
    caption: str
    svg: str


def plots(rows: Results) -> Iterator[Plot]:
    """Draw all figures for which there are rows.

    Args:
        rows: All rows.

    Yields:
        The figures.
    """
    some = rows.well_scaled
    if _are_timed(some):
        yield _drawn(
            "profile",
            "Performance profile over all sets but the badly scaled ones: share of the problems that a "
            "resolver answers with a proof within a multiple of the quickest such answer (Dolan and Moré "
            "2002). Left is quick, high is reliable.",
            lambda axes: _profile(axes, some),
        )
        yield _drawn(
            "accuracy",
            "Accuracy against time: 95th percentile of the distance from the exact strict optimum, and mean "
            "of the processor time. Left and low is better; what finds no answer stands at the top.",
            lambda axes: _accuracy(axes, some),
        )
        yield _drawn(
            "tails",
            "Tails: share of the answers that take longer than a time of the wall clock.",
            lambda axes: _tails(axes, some),
        )
    snakes, near = rows.where(set="snakes"), rows.where(set="near-singular")
    if _are_timed(snakes):
        yield _drawn(
            "growth",
            "Growth: mean of the processor time against the number of joints of a planar arm.",
            lambda axes: _growth(axes, snakes),
        )
    if _are_timed(near):
        yield _drawn(
            "singular",
            "Near a singularity: largest distance from the exact optimum against the exponent e, with the "
            "smallest singular value near 2^-e.",
            lambda axes: _singular(axes, near),
        )


def _are_timed(rows: Results) -> bool:
    """Return True if a row has a time, without which there is nothing to draw."""
    return bool(np.isfinite(rows.columns["cpu"]).any())


def _drawn(name: str, caption: str, draw: Callable[[Axes], None]) -> Plot:
    """Draw one figure."""
    figure = Figure(figsize=_SIZE, layout="constrained")
    axes = figure.add_subplot()
    axes.grid(visible=True, alpha=0.3)
    draw(axes)
    text = StringIO()
    with rc_context({"svg.hashsalt": name}):  # else every drawing has other names inside
        figure.savefig(text, format="svg", metadata={"Date": None})
    return Plot(name, caption, text.getvalue())


def _style(index: int) -> dict[str, Any]:
    """Return colour and dashes of a curve, so that no two are alike."""
    return {"color": f"C{index % 10}", "linestyle": ("-", "--", ":")[index // 10 % 3]}


def _profile(axes: Axes, rows: Results) -> None:
    """Draw the performance profile of those that are proven most often."""
    order = sorted(all_figures(rows), key=lambda one: (-one.proven, one.mean))[:_KEPT]
    curves = profile(rows, [(one.resolver, one.setting) for one in order])
    for index, ((resolver, setting), ratios) in enumerate(curves.items()):
        if len(ratios):
            share = np.arange(1, len(ratios) + 1) / len(ratios)
            axes.step(ratios, share, where="post", label=f"{resolver} {setting}", **_style(index))
    axes.set(xscale="log", xlabel="processor time / least", ylabel="share of problems", ylim=(0.0, 1.02))
    axes.legend(fontsize="x-small", loc="lower right")


def _accuracy(axes: Axes, rows: Results) -> None:
    """Draw a point for each resolver and setting."""
    found = [one for one in all_figures(rows) if np.isfinite(one.mean)]
    largest = max((one.distance[1] for one in found if np.isfinite(one.distance[1])), default=1.0)
    for one in found:
        y = one.distance[1] if np.isfinite(one.distance[1]) else 10.0 * largest
        marker = {"cold": "o", "warm": "^"}.get(one.setting, "s")
        colour = {"hqp": "C0", "wqp": "C1", "cvxpy": "C4"}.get(one.resolver.partition("/")[0], "C2")
        axes.plot(1e6 * one.mean, max(y, _FLOOR), marker, color=colour, alpha=0.7)
        named = one.resolver if one.setting == "cold" else f"{one.resolver} {one.setting}"
        axes.annotate(
            named, (1e6 * one.mean, max(y, _FLOOR)), fontsize=5, xytext=(3, 2), textcoords="offset points"
        )
    axes.set(xscale="log", yscale="log", xlabel="processor time, mean [µs]", ylabel="distance, 95 %")


def _tails(axes: Axes, rows: Results) -> None:
    """Draw the share of answers above each time."""
    order = sorted(all_figures(rows), key=lambda one: (-one.proven, one.mean))[:_KEPT]
    for index, one in enumerate(order):
        wall = rows.where(resolver=one.resolver, setting=one.setting).columns["wall"]
        wall = np.sort(wall[np.isfinite(wall)])
        above = 1.0 - np.arange(len(wall)) / max(1, len(wall))
        axes.step(1e6 * wall, above, where="post", label=f"{one.resolver} {one.setting}", **_style(index))
    axes.axvline(1e3, color="grey", linewidth=0.8)
    axes.set(xscale="log", yscale="log", xlabel="wall clock [µs]; grey: 1 kHz", ylabel="share above")
    axes.legend(fontsize="x-small", loc="upper right")


def _growth(axes: Axes, rows: Results) -> None:
    """Draw the time of each resolver against the number of unknowns."""
    order = sorted(all_figures(rows), key=lambda one: (-one.proven, one.mean))[:_KEPT]
    for index, one in enumerate(order):
        points = [(size, 1e6 * mean) for size, mean in growth(rows, one)]
        axes.plot(
            *zip(*points, strict=True),
            marker=".",
            label=f"{one.resolver} {one.setting}",
            **_style(index),
        )
    axes.set(xscale="log", yscale="log", xlabel="unknowns", ylabel="processor time, mean [µs]")
    axes.legend(fontsize="x-small")


def _singular(axes: Axes, rows: Results) -> None:
    """Draw the largest distance of each resolver against the exponent."""
    order = sorted(all_figures(rows), key=lambda one: (one.distance[2], one.mean))
    for index, one in enumerate(order[:_KEPT]):
        mine = rows.where(resolver=one.resolver, setting=one.setting)
        points = []
        for name in mine.names("sequence"):
            worst = figures(mine.where(sequence=name)).distance[2]
            points.append(
                (int(name.removeprefix("2^-")), max(worst, _FLOOR) if np.isfinite(worst) else np.nan)
            )
        axes.plot(
            *zip(*points, strict=True), marker=".", label=f"{one.resolver} {one.setting}", **_style(index)
        )
    axes.set(yscale="log", xlabel="exponent e", ylabel="largest distance")
    axes.legend(fontsize="x-small")
