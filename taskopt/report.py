"""Tables of the figures of a run or of a comparison, for a terminal."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from os import environ
from platform import python_version
from typing import NamedTuple

import numpy as np
from rich import box
from rich.columns import Columns
from rich.console import Console
from rich.table import Table
from rich.text import Text

from taskopt.hierarchy.layout import Layout
from taskopt.kinematics.robot import robot_names
from taskopt.kinematics.robot.arms import ARMS
from taskopt.log.provenance import machine, versions
from taskopt.loop.scenario import scenario_files
from taskopt.recording.summary import Summary
from taskopt.resolver.registry import resolver_names
from taskopt.solver.registry import solvers


class Figure(NamedTuple):
    """One figure of a summary.

    Attributes:
        heading: Heading of its column in a wide table; "" if wide tables leave it out.
        label: Its name in words, in a tall table.
        cell: Function that returns its text for a summary.
    """

    heading: str
    label: str
    cell: Callable[[Summary], str]


_FIGURES = (
    Figure(
        "tracking\nerror,\nmax [m]",
        "tracking error, largest [m]",
        lambda s: _number(max(s.tracking, default=np.nan)),
    ),
    Figure("\n\nrms [m]", "tracking error, root mean square [m]", lambda s: _number(_rms(s.tracking))),
    Figure(
        "position\nexcess\n[rad]",
        "excess over position limits [rad]",
        lambda s: _number(s.position_violation),
    ),
    Figure(
        "velocity\nexcess\n[rad/s]",
        "excess over velocity limits [rad/s]",
        lambda s: _number(s.velocity_violation),
    ),
    Figure(
        "",
        "change of {noun} in one tick, largest [{unit}]",
        lambda s: _number(s.continuity.jump),
    ),
    Figure(
        "closed\nform\n[{unit}]",
        "distance to the closed form where no limit is active [{unit}]",
        lambda s: _number(max(s.closed_form_distances, default=np.nan)),
    ),
    Figure(
        "no limit\nactive",
        "ticks at which no limit is active",
        lambda s: _share(len(s.closed_form_distances), s.ticks),
    ),
    Figure("path\n[rad]", "distance to the path of {baseline} [rad]", lambda s: _number(s.path_difference)),
    Figure("claimed", "ticks claimed to be optimal", lambda s: _share(s.claimed, s.ticks)),
    Figure("proven", "judged ticks proven", lambda s: _share(s.judged.proven, s.judged.ticks)),
    Figure("re-\nfuted", "judged ticks refuted", lambda s: _share(s.judged.refuted, s.judged.ticks)),
    Figure(
        "un-\ndecided",
        "judged ticks undecided",
        lambda s: _share(s.judged.undecided, s.judged.ticks),
    ),
    Figure(
        "error\nbound\n[{unit}]",
        "error bound, largest [{unit}]",
        lambda s: _number(np.nan if s.judged.bound is None else s.judged.bound.value),
    ),
    Figure("", "KKT residual, largest", lambda s: _number(s.kkt_residual)),
    Figure("solve\np50\n[µs]", "solve time, median [µs]", lambda s: _microseconds(s.seconds, 50)),
    Figure("solve\np99\n[µs]", "solve time, 99th percentile [µs]", lambda s: _microseconds(s.seconds, 99)),
    Figure(
        "in\nsolver\n[µs]",
        "time inside the solver, median [µs]",
        lambda s: _microseconds(s.solver_seconds, 50),
    ),
    Figure("around\n[µs]", "time around the solver, median [µs]", lambda s: _microseconds(_around(s), 50)),
    Figure("", "solve time, shifted geometric mean [µs]", lambda s: _geometric_mean(s.seconds)),
)
_ACCELERATION = Figure(
    "accel.\nexcess\n[rad/s²]",
    "excess over acceleration limits [rad/s²]",
    lambda s: _number(s.acceleration_violation),
)
_LEGEND = (
    "tracking error: of the first task with a frame; excess: over position limits after the step, and over "
    "velocity limits; closed form: largest distance to the closed-form answer of the same problem, over the "
    "ticks at which no limit is active; path: largest distance to the path of {baseline}; claimed: share "
    "of the ticks at which the resolver says that it has the optimum; of the ticks that are judged, proven: "
    "no unknown x is further than 1e-8 · max(1, |x|) from the exact optimum, by a bound on its error; "
    "refuted: one certainly is; undecided: all others; p50, p99: median and 99th percentile."
)

_ENDLESS = 1000
_SHIFT = 10e-6  # [s] of the geometric mean, so that ticks of a microsecond do not decide it
_KINDS = ("limit", "rank", "damping", "formula", "accuracy")
_CAUSES = (
    "Share of the ticks at which the answer differs from the undamped closed form because of active limits, "
    "a rank that could be decided either way, damping, a formula that does not solve the problem, or the "
    "accuracy of the solver."
)


def terminal() -> Console:
    """Make the console for tables.

    Returns:
        A console as wide as the terminal, or of 120 columns if the output goes to a file or pipe.
    """
    console = Console()
    return console if console.is_terminal or "COLUMNS" in environ else Console(width=120)


def wide_table(summaries: Sequence[Summary], title: str) -> Table:
    """Make a table with one row for each resolver.

    Args:
        summaries: One for each resolver.
        title: Title of the table.

    Returns:
        The table.
    """
    out = Table(title=title, box=box.SIMPLE_HEAD, pad_edge=False, padding=0)
    out.add_column("resolver", no_wrap=True)
    figures = [figure for figure in _figures(summaries) if figure.heading]
    for figure in figures:
        out.add_column(Text(figure.heading), justify="right", no_wrap=True)
    for summary in summaries:
        out.add_row(summary.resolver, *(figure.cell(summary) for figure in figures))
    return out


def tall_table(summaries: Sequence[Summary], title: str, baseline: str) -> Table:
    """Make a table with one column for each resolver, for a single resolver or a narrow terminal.

    Args:
        summaries: One for each resolver.
        title: Title of the table.
        baseline: Name of the resolver with whose path the others are compared.

    Returns:
        The table.
    """
    out = Table(title=title, box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    out.add_column("")
    for summary in summaries:
        out.add_column(summary.resolver, justify="right", no_wrap=True)
    for figure in _figures(summaries):
        out.add_row(
            Text(figure.label.format(baseline=baseline)), *(figure.cell(summary) for summary in summaries)
        )
    return out


def cause_table(summaries: Sequence[Summary]) -> Table:
    """Make a table of the causes by which each resolver differs from its closed form, with their counts.

    Args:
        summaries: One for each resolver.

    Returns:
        One row for each resolver.
    """
    out = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    out.add_column("differs from the closed form by", no_wrap=True)
    for heading in ("limits", "rank", "damping", "formula", "accuracy"):
        out.add_column(heading, justify="right", no_wrap=True)
    for summary in summaries:
        counts = (_share(summary.causes[kind], summary.ticks) for kind in _KINDS)
        out.add_row(summary.resolver, *counts)
    return out


def show(summaries: Iterable[Summary], console: Console, baseline: str, title: str = "") -> None:
    """Print the figures of a run or of a comparison with explanations.

    Args:
        summaries: One for each resolver.
        console: Console on which the text is printed.
        baseline: Name of the resolver with whose path the others are compared.
        title: Title of the table.
    """
    summaries = list(summaries)
    wide = wide_table(summaries, title)
    room = console.options.update(max_width=_ENDLESS)  # else the table would be cut to what there is
    if len(summaries) > 1 and console.measure(wide, options=room).maximum <= console.width:
        console.print(wide)
        console.print(_LEGEND.format(baseline=baseline), style="dim", highlight=False, markup=False)
    else:
        console.print(tall_table(summaries, title, baseline))
    if any(summary.causes for summary in summaries):
        console.print(cause_table(summaries))
        console.print(_CAUSES, style="dim", highlight=False, markup=False)
    for sentence in _sentences(summaries):
        console.print(sentence, highlight=False, markup=False)
    for sentence in _conditions(summaries):
        console.print(sentence, style="dim", highlight=False, markup=False)
    for summary in summaries:
        if summary.stopped:
            console.print(f"stopped: {summary.stopped}", style="bold red", highlight=False, markup=False)


def _sentences(summaries: Sequence[Summary]) -> Iterator[str]:
    """Yield sentences on the most active limits, proofs, fallbacks, and the smoothness of each resolver."""
    active: dict[str, list[str]] = {}
    for summary in summaries:
        if summary.active:
            active.setdefault(_most_active(summary), []).append(summary.resolver)
    for limits, names in active.items():
        yield f"{', '.join(names)}: active limits, share of the ticks: {limits}"
    for summary in summaries:
        yield from (f"{summary.resolver}: {line}" for line in summary.judged.sentences(summary.ticks))
        if summary.fallbacks:
            yield f"{summary.resolver}: a fallback answered {summary.fallbacks} of {summary.ticks} ticks"
        if summary.damped:
            yield (
                f"{summary.resolver}: {_share(summary.damped, summary.ticks)} of the ticks are damped, up to "
                f"{summary.damping_distance:.2g} {summary.layout.angular_unit} from the optimum "
                "without damping"
            )
        yield from (f"{summary.resolver}: {sentence}" for sentence in summary.continuity.sentences())


def _conditions(summaries: Sequence[Summary]) -> Iterator[str]:
    """Yield sentences on the measurement of times: mean, start of each tick, machine, versions."""
    means = ", ".join(f"{summary.resolver} {_geometric_mean(summary.seconds)} µs" for summary in summaries)
    yield (
        f"solve time, shifted geometric mean (shift {_SHIFT * 1e6:.0f} µs): {means}; wall clock, each tick "
        "started from the memory of the tick before (warm)"
    )
    here = machine()
    yield f"machine: {here['cpu']}, {here['cores']} cores, {here['system']}"
    known = {"Python": python_version()} | versions()
    yield "versions: " + ", ".join(f"{name} {number}" for name, number in known.items())


def _figures(summaries: Sequence[Summary]) -> tuple[Figure, ...]:
    """Return the figures, with the least distance of each limit that keeps distances."""
    limits = dict.fromkeys(limit for summary in summaries for limit in summary.least_distance)
    least = [
        Figure(
            f"least\n{limit[:8]}\n[m]",
            f"least distance, {limit} [m]",
            lambda t, limit=limit: _signed(t.least_distance.get(limit, np.nan)),
        )
        for limit in limits
    ]
    alone = len(summaries) == 1  # then there is no other path
    layout = summaries[0].layout
    strongest = (_ACCELERATION,) if layout.is_of_accelerations else ()
    figures = (*_FIGURES[:4], *strongest, *least, *_FIGURES[4:])
    return tuple(_worded(f, layout) for f in figures if not (alone and f.heading.startswith("path")))


def _worded(figure: Figure, layout: Layout) -> Figure:
    """Return a figure with the word for an unknown and its unit."""
    words = {"{noun}": layout.noun, "{unit}": layout.angular_unit}
    heading, label = figure.heading, figure.label
    for place, word in words.items():
        heading, label = heading.replace(place, word), label.replace(place, word)
    return Figure(heading, label, figure.cell)


def _most_active(summary: Summary, count: int = 4) -> str:
    """Return the names of the limits that were active most often, with their shares of the ticks."""
    most = summary.active.most_common(count)
    return ", ".join(f"{name} {_share(ticks, summary.ticks)}" for name, ticks in most)


def show_inventory(console: Console, part: str = "") -> None:
    """Print robots, solvers with the command that installs them, resolvers and scenarios.

    Args:
        console: Console on which the text is printed.
        part: Only names that contain these letters are printed.
    """
    names = robot_names()
    groups = {"arms of the textbook": names[: len(ARMS)], "robots": names[len(ARMS) :]}
    for title, known in groups.items():
        if found := [name for name in known if part in name]:
            console.print(Text(title, style="bold"))
            console.print(Columns(found, padding=(0, 2)))
    if len(names) == len(ARMS):
        console.print("no other robots; install them with: pip install 'taskopt[robots]'", markup=False)
    rows = Table("solver", "method", "installed", box=box.SIMPLE_HEAD, pad_edge=False)
    for solver in (solver for solver in solvers() if part in solver.name):
        rows.add_row(
            solver.name, solver.method, "yes" if solver.installed else f"no: pip install {solver.install}"
        )
    if rows.row_count:
        console.print(rows)
    plain = [name for name in resolver_names() if "/" not in name or name.startswith("dls")]
    families = "wqp/<solver>, pqp/<solver>, hqp/<solver>, cvxpy/<solver>"
    if found := [name for name in [*plain, families] if part in name]:
        console.print(f"resolvers: {', '.join(found)}", highlight=False)
    scenarios = ["demo", *map(str, scenario_files())]
    files = ", ".join(name for name in scenarios if part in name) or "none of that name"
    console.print(f"scenarios: {files}", highlight=False, markup=False)


def _number(value: float) -> str:
    """Return two digits; a dash for NaN, 0 for a limit that is not exceeded."""
    if np.isnan(value):
        return "–"
    return f"{value:.1e}" if value > 0.0 else "0"


def _signed(distance: float) -> str:
    """Return three digits, so that a margin that is kept exactly can be seen; < 0 is a penetration depth."""
    return "–" if np.isnan(distance) else f"{distance:.3g}"


def _share(count: int, ticks: int) -> str:
    """Return a share in per cent, rounded so that 100 % means all and 0 % none."""
    if ticks == 0:
        return "–"
    percent = 100.0 * count / ticks
    if 0 < count < ticks:
        percent = min(max(percent, 0.01), 99.99)
        return f"{percent:.2f} %" if percent > 99.5 or percent < 0.5 else f"{percent:.0f} %"
    return f"{percent:.0f} %"


def _rms(values: list[float]) -> float:
    """Return the root mean square; NaN if there are no values."""
    return float(np.sqrt(np.mean(np.square(values)))) if values else np.nan


def _geometric_mean(seconds: list[float]) -> str:
    """Return the shifted geometric mean of times in µs, exp(mean log(t + s)) − s, or a dash."""
    if not seconds:
        return "–"
    mean = float(np.exp(np.mean(np.log(np.add(seconds, _SHIFT))))) - _SHIFT
    return f"{1e6 * mean:.1f}"


def _around(summary: Summary) -> list[float]:
    """Return the times of each tick that a resolver spent outside the package of its solver [s]."""
    return np.subtract(summary.seconds, summary.solver_seconds).tolist()


def _microseconds(seconds: list[float], percentile: float) -> str:
    """Return a percentile of times in µs; a dash if there are none."""
    return f"{1e6 * float(np.percentile(seconds, percentile)):.1f}" if seconds else "–"
