"""The figures of a run or of a comparison, as a table for a terminal."""

from collections.abc import Callable, Iterable, Sequence
from os import environ
from typing import NamedTuple

import numpy as np
from rich import box
from rich.columns import Columns
from rich.console import Console
from rich.table import Table
from rich.text import Text

from taskopt.record.summary import Summary


class Figure(NamedTuple):
    """One figure of a summary: column heading (none if wide tables leave it out), words, and text."""

    heading: str
    label: str
    cell: Callable[[Summary], str]


_FIGURES = (
    Figure(
        "tracking\nmax [m]", "tracking error, largest [m]", lambda t: _number(max(t.tracking, default=np.nan))
    ),
    Figure("\nrms [m]", "tracking error, rms [m]", lambda t: _number(_rms(t.tracking))),
    Figure("over\n[rad]", "position over its limit [rad]", lambda t: _number(t.position_violation)),
    Figure("limits\n[rad/s]", "velocity over its limit [rad/s]", lambda t: _number(t.velocity_violation)),
    Figure(
        "",
        "change of a velocity in a tick, largest [rad/s]",
        lambda t: _number(t.continuity.jump),
    ),
    Figure(
        "closed\nform",
        "apart from the closed form [rad/s]",
        lambda t: _number(max(t.closed_form_distances, default=np.nan)),
    ),
    Figure(
        "nothing\nbinds", "… where nothing binds", lambda t: _share(len(t.closed_form_distances), t.ticks)
    ),
    Figure("path\n[rad]", "path apart from the reference [rad]", lambda t: _number(t.path_difference)),
    Figure("certi-\nficate", "worst certificate", lambda t: _number(max(t.certificates, default=np.nan))),
    Figure("claim-\ned", "claimed optimal", lambda t: _share(t.claimed, t.ticks)),
    Figure("certi-\nfied", "proven optimal", lambda t: _share(t.certified, t.ticks)),
    Figure("p50\n[µs]", "solve time, median [µs]", lambda t: _microseconds(t.seconds, 50)),
    Figure("p99\n[µs]", "solve time, 99 % [µs]", lambda t: _microseconds(t.seconds, 99)),
)
_LEGEND = (
    "tracking: error of the first task with a frame, its rows in metres; over limits: largest position after "
    "the step, largest velocity; closed form: largest difference to it on the same problem [rad/s], over the "
    "ticks where nothing binds; path: largest difference to {reference}; certificate: worst KKT residual, up "
    "to 1e-8 is a proof; claimed: the resolver says optimal; certified: proven."
)

_ENDLESS = 1000
_KINDS = ("limit", "rank", "damping", "accuracy")
_CAUSES = (
    "share of the ticks at which limits that bind, a rank that may go either way, damping or the solver's "
    "accuracy keep the answer apart from the undamped closed form; accurate: x is as near to its active set "
    "solved again as was asked for, whatever the claim; worst error: largest distance to that, relative to x."
)


def terminal() -> Console:
    """Where tables go: as wide as the terminal, 120 columns in a file or pipe."""
    console = Console()
    return console if console.is_terminal or "COLUMNS" in environ else Console(width=120)


def wide_table(summaries: Sequence[Summary], title: str) -> Table:
    """One row a resolver."""
    out = Table(title=title, box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    out.add_column("resolver", no_wrap=True)
    figures = [figure for figure in _figures(summaries) if figure.heading]
    for figure in figures:
        out.add_column(Text(figure.heading), justify="right", no_wrap=True)
    for summary in summaries:
        out.add_row(summary.resolver, *(figure.cell(summary) for figure in figures))
    return out


def tall_table(summaries: Sequence[Summary], title: str) -> Table:
    """One column a resolver, for one alone or a narrow terminal."""
    out = Table(title=title, box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    out.add_column("")
    for summary in summaries:
        out.add_column(summary.resolver, justify="right", no_wrap=True)
    for figure in _figures(summaries):
        out.add_row(Text(figure.label), *(figure.cell(summary) for summary in summaries))
    return out


def cause_table(summaries: Sequence[Summary]) -> Table:
    """How often each resolver was apart from its closed form, and why; how accurate it was."""
    out = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    out.add_column("apart from the closed form by", no_wrap=True)
    for heading in ("limits", "rank", "damping", "solver", "accurate", "worst error"):
        out.add_column(heading, justify="right", no_wrap=True)
    for summary in summaries:
        counts = (_share(summary.causes[kind], summary.ticks) for kind in _KINDS)
        accuracy = (
            _share(summary.accurate, summary.judged),
            _number(summary.error) if summary.judged else "–",
        )
        out.add_row(summary.resolver, *counts, *accuracy)
    return out


def show(summaries: Iterable[Summary], console: Console, reference: str, title: str = "") -> None:
    """Print the table, what its columns mean, what bound most, and who stopped early."""
    summaries = list(summaries)
    wide = wide_table(summaries, title)
    room = console.options.update(max_width=_ENDLESS)  # else the table would be cut to what there is
    if len(summaries) > 1 and console.measure(wide, options=room).maximum <= console.width:
        console.print(wide)
        console.print(_LEGEND.format(reference=reference), style="dim", highlight=False, markup=False)
    else:
        console.print(tall_table(summaries, title))
    if any(summary.causes or summary.accurate < summary.judged for summary in summaries):
        console.print(cause_table(summaries))
        console.print(_CAUSES, style="dim", highlight=False, markup=False)
    held: dict[str, list[str]] = {}
    for summary in summaries:
        if summary.active:
            held.setdefault(_most_bound(summary), []).append(summary.resolver)
    for limits, names in held.items():
        console.print(f"{', '.join(names)} held by: {limits} of the ticks", highlight=False, markup=False)
    for summary in summaries:
        for sentence in summary.continuity.sentences():
            console.print(f"{summary.resolver}: {sentence}", highlight=False, markup=False)
    for summary in summaries:
        if summary.stopped:
            console.print(f"stopped: {summary.stopped}", style="bold red", highlight=False, markup=False)


def _figures(summaries: Sequence[Summary]) -> tuple[Figure, ...]:
    """The figures, with the least distance of each limit that keeps any."""
    limits = dict.fromkeys(limit for summary in summaries for limit in summary.least_distance)
    least = [
        Figure(
            f"{limit[:8]}\nleast [m]",
            f"least distance, {limit} [m]",
            lambda t, limit=limit: _signed(t.least_distance.get(limit, np.nan)),
        )
        for limit in limits
    ]
    return (*_FIGURES[:4], *least, *_FIGURES[4:])


def _most_bound(summary: Summary, count: int = 4) -> str:
    """The names that were active most often, as shares of the ticks."""
    most = summary.active.most_common(count)
    return ", ".join(f"{name} {_share(ticks, summary.ticks)}" for name, ticks in most)


def show_inventory(console: Console) -> None:
    """Robots, resolvers, solvers with the line that installs them, scenarios."""
    from taskopt.kinematics.robot import robot_names
    from taskopt.loop.scenario import scenario_files
    from taskopt.resolver.registry import resolver_names
    from taskopt.solver.registry import solvers

    robots = robot_names()
    if robots:
        console.print(Text("robots", style="bold"))
        console.print(Columns(robots, padding=(0, 2)))
    else:
        console.print("no named robots; install them with: pip install 'taskopt[robots]'", markup=False)
    rows = Table("solver", "method", "installed", box=box.SIMPLE_HEAD, pad_edge=False)
    for solver in solvers():
        rows.add_row(
            solver.name, solver.method, "yes" if solver.installed else f"no: pip install {solver.install}"
        )
    console.print(rows)
    plain = [name for name in resolver_names() if "/" not in name or name.startswith("dls")]
    families = "wqp/<solver>, hqp/<solver>, cvxpy/<solver>"
    console.print(f"resolvers: {', '.join(plain)}, {families}", highlight=False)
    files = ", ".join(map(str, scenario_files())) or "none in tasks/ of this folder"
    console.print(f"scenarios: {files}", highlight=False, markup=False)


def _number(value: float) -> str:
    """Two digits; nothing where there is none, 0 for what is not over."""
    if np.isnan(value):
        return "–"
    return f"{value:.1e}" if value > 0.0 else "0"


def _signed(distance: float) -> str:
    """Three digits: a margin that is kept exactly is to be seen; < 0 is depth."""
    return "–" if np.isnan(distance) else f"{distance:.3g}"


def _share(count: int, ticks: int) -> str:
    """Per cent, rounded so that 100 % means all and 0 % none."""
    if ticks == 0:
        return "–"
    percent = 100.0 * count / ticks
    if 0 < count < ticks:
        percent = min(max(percent, 0.01), 99.99)
        return f"{percent:.2f} %" if percent > 99.5 or percent < 0.5 else f"{percent:.0f} %"
    return f"{percent:.0f} %"


def _rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values else np.nan


def _microseconds(seconds: list[float], percentile: float) -> str:
    return f"{1e6 * float(np.percentile(seconds, percentile)):.1f}" if seconds else "–"
