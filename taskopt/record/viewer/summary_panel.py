"""The run card: what was run, what to look at, and, once it is over, what came of it."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from taskopt.loop.run import tracking_error
from taskopt.record.batch import Batch
from taskopt.record.recorder import RunInfo
from taskopt.record.summary import Continuity
from taskopt.record.violation import LimitGauge

CARD = "/run/card"
_SHOWN = 5  # limits named in the summary


@dataclass
class Outcome:
    """What the batches of one resolver come to, so far."""

    continuity: Continuity
    ticks: int = 0
    certified: int = 0
    bound: int = 0
    worst: float = 0.0
    position: float = 0.0
    velocity: float = 0.0
    error: float = 0.0
    nearest: dict[str, float] = field(default_factory=dict)
    seconds: list[np.ndarray] = field(default_factory=list)
    limits: Counter[str] = field(default_factory=Counter)

    def add(self, batch: Batch, gauge: LimitGauge) -> None:
        """Take a batch in."""
        self.ticks += len(batch.steps)
        self.certified += int(batch.certified.sum())
        self.worst = max(self.worst, float(batch.worst.max()))
        self.position = max(self.position, float(gauge.position_violation(batch).max()))
        self.velocity = max(self.velocity, float(gauge.velocity_violation(batch).max()))
        for limit in batch.distance_limits:
            least = float(batch.distance(limit).min())
            self.nearest[limit] = min(self.nearest.get(limit, np.inf), least)
        self.seconds.append(batch.seconds)
        for step in batch.steps:
            self.continuity.add(step)
        code = batch.active_code
        self.bound += int((code != 0).any(axis=1).sum())
        for row, value in {(int(r), int(c)) for r, c in _pairs(code)}:
            self.limits[batch.active_name(row, value)] += int((code[:, row] == value).sum())
        if batch.steps[0].desired:
            self.error = max(self.error, *map(tracking_error, batch.steps))

    def row(self, name: str) -> str:
        """A line of the Markdown table."""
        times = np.concatenate(self.seconds) * 1e6
        figures = (
            f"{1e3 * self.error:.3g}",
            _excess(self.position),
            _excess(self.velocity),
            *(f"{1e3 * least:.3g}" for least in self.nearest.values()),
            _share(self.bound, self.ticks),
            f"{self.worst:.1e}",
            _share(self.certified, self.ticks),
            f"{np.median(times):.0f}",
        )
        return f"| {name} | " + " | ".join(figures) + " |"

    def held(self, name: str) -> str:
        """What bound most often."""
        most = self.limits.most_common(_SHOWN)
        words = ", ".join(f"{limit} {_share(n, self.ticks)}" for limit, n in most)
        return "\n".join([f"- **{name}**: {words or 'nothing ever bound'}", *self._continuity()])

    def _continuity(self) -> list[str]:
        return [f"    - {sentence}" for sentence in self.continuity.sentences()]


class Card:
    """Markdown for the viewer."""

    def __init__(self, info: RunInfo, gauge: LimitGauge) -> None:
        self._info, self._gauge = info, gauge
        self._outcomes = {name: Outcome(Continuity(info.plan)) for name in info.resolvers}

    def take(self, batch: Batch) -> None:
        self._outcomes[batch.resolver].add(batch, self._gauge)

    def text(self, status: str) -> str:
        """The card; `status` is running, finished or interrupted."""
        scenario = self._info.scenario
        head = f"# {scenario.name.replace('_', ' ')}\n\n{scenario.description}\n"
        facts = (
            f"**{scenario.robot.name}**, {scenario.robot.nv} velocities, {scenario.duration:g} s in steps of "
            f"{1e3 * scenario.dt:g} ms, {status}."
        )
        guide = _GUIDE + (_NEAR if self._info.plan.distance_limits else "")
        return "\n".join([head, facts, "", *self._summary(), *self._stack(), guide])

    def _summary(self) -> list[str]:
        ran = {name: outcome for name, outcome in self._outcomes.items() if outcome.ticks}
        if not ran:
            return []
        rows = [outcome.row(name) for name, outcome in ran.items()]
        held = [outcome.held(name) for name, outcome in ran.items()]
        least = [f"{limit.replace('_', ' ')}, least [mm]" for limit in self._info.plan.distance_limits]
        headings = [*_HEADINGS[:4], *least, *_HEADINGS[4:]]
        head = [f"| {' | '.join(headings)} |", "|---" * len(headings) + "|"]
        return [*head, *rows, "", "What held the arm back, share of the ticks:", *held, ""]

    def _stack(self) -> list[str]:
        """The levels as declared, and the limits around them."""
        plan, lines = self._info.plan, ["### The stack"]
        for level in range(1, plan.layout.level_count + 1):
            blocks = [b for b in plan.layout.blocks if b.level == level]
            tasks = ", ".join(f"{b.name} ({b.stop - b.start} rows)" for b in blocks)
            lines.append(f"{level}. {tasks}")
        names = [limit.name for limit in self._info.scenario.stack.limits]
        lines.append(f"\nHard limits: {', '.join(names) or 'none'}\n")
        return lines


_HEADINGS = (
    "resolver", "error max [mm]", "out of position [rad]", "over velocity [rad/s]", "ticks bound",
    "worst KKT", "proven", "solve p50 [µs]",
)  # fmt: skip
_GUIDE = """### How to read it
- White: the desired path and pose, the box or cone to stay in. Coloured: where the frame went. \
Red: the error between them.
- Yellow ellipsoid: velocities that the frame can reach with ‖v‖ ≤ 1; flat where it is near a singularity.
- q and v run between their limits, drawn at ±1. A lane is red while the upper limit binds, blue while the \
lower does, yellow where an answer that knows no limits is over it.
- Multiplier: what the limit costs the first level that it holds back; > 0 at an upper limit.
- Proof: log10 of the worst KKT residual; below −8 the answer is certified to be the optimum.
"""
_NEAR = """- Beads on a line: the nearest points of a link and what it must not touch; red while their \
limit holds the link off, yellow below the margin. The number is the least distance.
"""


def _pairs(code: np.ndarray) -> zip:
    rows = np.nonzero(code)
    return zip(rows[1].tolist(), code[rows].tolist(), strict=True)


def _share(count: int, ticks: int) -> str:
    return f"{100 * count / ticks:.0f} %" if count in (0, ticks) else f"{100 * count / ticks:.1f} %"


def _excess(value: float) -> str:
    return f"{value:.2g}" if value > 0.0 else "0"
