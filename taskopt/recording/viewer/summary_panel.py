"""The summary panel of a recording: the run, its figures and a guide to the views, as Markdown."""

import numpy as np

from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.summary import Summary
from taskopt.recording.violation import LimitGauge

_SHOWN = 5  # largest number of limits that are named for each resolver


class SummaryPanel:
    """Collect the summary of each resolver, and write all of them as one Markdown text."""

    def __init__(self, info: RunInfo, gauge: LimitGauge) -> None:
        """Begin with empty summaries.

        Args:
            info: The facts about the run.
            gauge: The limits of the run.
        """
        self._info = info
        self._summaries = {name: Summary(name, gauge) for name in info.resolvers}
        self._tracks = any(task.frame is not None for task in info.plan.tasks)

    def take(self, batch: Batch) -> None:
        """Add a batch to the summary of its resolver.

        Args:
            batch: Consecutive steps of one resolver.
        """
        self._summaries[batch.resolver].add(batch)

    def text(self, status: str) -> str:
        """Write the panel.

        Args:
            status: "running", "finished" or "interrupted".

        Returns:
            Markdown: the scenario, a table with one row for each resolver, the limits that were active most
            often, the stack, and a guide to the views.
        """
        scenario = self._info.scenario
        head = f"# {scenario.name.replace('_', ' ')}\n\n{scenario.description}\n"
        facts = (
            f"**{scenario.robot.name}**, {scenario.robot.nv} velocities, {scenario.duration:g} s in steps of "
            f"{1e3 * scenario.dt:g} ms, {status}."
        )
        guide = _GUIDE + (_DISTANCE_GUIDE if self._info.plan.distance_limits else "")
        return "\n".join([head, facts, "", *self._figures(), *self._stack(), guide])

    def _figures(self) -> list[str]:
        """Write the table of figures and the lists of active limits; nothing before the first batch."""
        summaries = [summary for summary in self._summaries.values() if summary.ticks]
        if not summaries:
            return []
        least = [f"{limit.replace('_', ' ')}, least [mm]" for limit in self._info.plan.distance_limits]
        headings = [*_HEADINGS[:4], *least, *_HEADINGS[4:]]
        head = [f"| {' | '.join(headings)} |", "|---" * len(headings) + "|"]
        rows = [self._row(summary) for summary in summaries]
        active = [line for summary in summaries for line in _active_lines(summary)]
        return [*head, *rows, "", "Active limits, share of the ticks:", *active, ""]

    def _row(self, summary: Summary) -> str:
        """Write one line of the table of figures."""
        judged = summary.judged
        figures = (
            summary.resolver,
            f"{1e3 * max(summary.tracking):.3g}" if self._tracks else "–",
            _violation(summary.position_violation),
            _violation(summary.velocity_violation),
            *(f"{1e3 * least:.3g}" for least in summary.least_distance.values()),
            _share(summary.ticks_active, summary.ticks),
            _share(summary.claimed, summary.ticks),
            _share(judged.proven, judged.ticks),
            _share(judged.refuted, judged.ticks),
            _share(judged.undecided, judged.ticks),
            f"{1e6 * np.median(summary.seconds):.0f}",
        )
        return f"| {' | '.join(figures)} |"

    def _stack(self) -> list[str]:
        """List the levels as declared, and the limits around them."""
        plan, lines = self._info.plan, ["### The stack"]
        for level in range(1, plan.layout.level_count + 1):
            blocks = [block for block in plan.layout.blocks if block.level == level]
            tasks = ", ".join(f"{block.name} ({block.stop - block.start} rows)" for block in blocks)
            lines.append(f"{level}. {tasks}")
        names = [limit.name for limit in self._info.scenario.stack.limits]
        lines.append(f"\nHard limits: {', '.join(names) or 'none'}\n")
        return lines


_HEADINGS = (
    "resolver", "max error [mm]", "over position [rad]", "over velocity [rad/s]",
    "limit active", "claimed", "proven", "refuted", "undecided", "solve p50 [µs]",
)  # fmt: skip
_GUIDE = """### How to read it
- White: the desired path and pose, and the box or cone that a task keeps a frame in. Coloured: the path of \
the frame. Red: the error between them. Violet: trails that the scenario asks for.
- Yellow ellipsoid: the velocities that the frame can reach with ‖v‖ ≤ 1; it is flat near a singularity. \
Green wire frame: the forces that torques of norm 1 balance, long where the yellow one is short. Select one \
to read its axes.
- q and v are scaled so that their limits are at ±1. In the active-set timeline a row is red while the upper \
limit is active, blue while the lower one is, and yellow where an answer that knows no limits is beyond it.
- Multiplier (price): what the limit costs the first level that it holds back; > 0 at an upper limit.
- Claimed: the resolver says that it has the optimum. Of the ticks that are judged: proven, if the error \
bound of every unknown x is below 1e-8 · max(1, |x|); refuted, if one is certainly further off; else \
undecided.
- Proof: log10 of the largest error bound over max(1, |x|), at the ticks that are judged; proven below −8.
"""
_DISTANCE_GUIDE = """- Two points joined by a line: the nearest points of a link and of what it must not \
touch; red while the limit is active, yellow below the margin. The number is the least distance.
"""


def _active_lines(summary: Summary) -> list[str]:
    """List the limits that were active most often, what is proven, jumps, alternating limits, conflicts."""
    most = summary.active.most_common(_SHOWN)
    words = ", ".join(f"{limit} {_share(ticks, summary.ticks)}" for limit, ticks in most)
    told = [*summary.judged.sentences(summary.ticks), *summary.continuity.sentences()]
    sentences = [f"    - {sentence}" for sentence in told]
    return [f"- **{summary.resolver}**: {words or 'none was ever active'}", *sentences]


def _share(count: int, ticks: int) -> str:
    """Write a share in per cent, with a decimal unless it is exactly none or all; a dash of no ticks."""
    if not ticks:
        return "–"
    return f"{100 * count / ticks:.0f} %" if count in (0, ticks) else f"{100 * count / ticks:.1f} %"


def _violation(value: float) -> str:
    """Write a violation with two digits, or 0 if the limit is kept."""
    return f"{value:.2g}" if value > 0.0 else "0"
