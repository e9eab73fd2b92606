"""Tasks that come and go: insertion, removal and swap without a jump in the velocities.

Rows that are not in force have no bounds, lower = −∞ and upper = ∞, and so change nothing. While a task
comes, its bounds close in from a band of ±β to what it asks for; while it goes, they open again. For
matrices that stand still the lexicographic optimum is a Lipschitz continuous function of all bounds: the
residuals of a level are the projection on a polyhedron, so are those of the next on what is left, and
polyhedra with fixed rows move no faster than their bounds, up to a factor L (Hoffman 1952). A band that
moves by dβ in a tick therefore moves v by at most L dβ, at whatever level it stands, while a task that is
switched jumps. Every tick is one strict hierarchy, resolved and certified as any other.

    β(u) = ε (e^(κu) − 1),  u from 1 to 0 while the task comes,  dβ/du = κ (β + ε)

closes at a rate in proportion to β, so that it suits goals that are near and far: a row that is D away from
its goal moves by at most κ (D + ε)/blend a second, with ε = reach/1000 and κ = log 1001 = 6.9.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, finite, number, positive
from taskopt.configuration import Configuration
from taskopt.errors import InvalidValue
from taskopt.problem.hierarchy import LevelRows
from taskopt.robot import Robot
from taskopt.task.base import BoundTask, Task

_SHARE = 1000.0  # reach/ε
_KAPPA = math.log(1.0 + _SHARE)


@dataclass(frozen=True, eq=False)
class During:
    """A task in force from `begin` to `end` [s]; it comes in `blend` seconds after `begin`, goes after `end`.

    Insert a task with `begin`, remove it with `end`, move it to another level by having it at both with the
    `end` of one the `begin` of the other. Its references are anchored where it begins. `reach`: the width
    of the band [m/s, rad/s] from which it closes in, more than its rows are ever away from their goals.
    """

    task: Task
    begin: float = field(default=-math.inf, kw_only=True)
    end: float = field(default=math.inf, kw_only=True)
    blend: float = field(default=0.25, kw_only=True)
    reach: float = field(default=10.0, kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.task, Task) or isinstance(self.task, During):
            raise InvalidValue(f"task must be a task that is not timed itself, got {self.task!r}")
        number("begin", self.begin, ())
        number("end", self.end, ())
        positive("reach", self.reach)
        if finite("blend", self.blend, ()) < 0.0 or self.begin + self.blend > self.end:
            raise InvalidValue(
                f"a task must have come before it goes: begin {self.begin:g} s + blend {self.blend:g} s must "
                f"be ≤ end {self.end:g} s, and blend ≥ 0"
            )

    @property
    def name(self) -> str | None:
        """The name of its task."""
        return self.task.name

    def default_name(self) -> str:
        return self.task.default_name()

    def bind(self, robot: Robot, name: str) -> "BoundDuring":
        return BoundDuring(self, self.task.bind(robot, name))

    def openness(self, t: float) -> float:
        """u at t [s]: 0 where the task is fully in force, 1 and more where it is not at all."""
        coming = self.begin - t + self.blend if math.isfinite(self.begin) else -math.inf
        going = t - self.end if math.isfinite(self.end) else -math.inf
        late = max(coming, going, 0.0)
        return late / self.blend if self.blend > 0.0 else math.copysign(math.inf, late) if late else 0.0


class BoundDuring:
    """The rows of its task, with the bounds that its time leaves them."""

    constant = False

    def __init__(self, declared: During, inner: BoundTask) -> None:
        self._declared, self._inner, self._begun = declared, inner, False
        self.name, self.row_names, self.row_units = inner.name, inner.row_names, inner.row_units
        self.column, self.weight, self.gain, self.error = inner.column, inner.weight, inner.gain, inner.error
        self.frame, self.target, self.actual = inner.frame, inner.target, inner.actual

    def prepare(self, rows: LevelRows) -> None:
        self._inner.prepare(rows)

    def start(self, at: Configuration, t: float) -> None:
        self._inner.start(at, t)
        self._begun = t >= self._declared.begin

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        if not self._begun and t >= self._declared.begin:
            self.start(at, t)
        self._inner.fill(at, t, rows)
        u = self._declared.openness(t)
        if u >= 1.0:
            rows.lower[:], rows.upper[:] = -np.inf, np.inf
        elif u > 0.0:
            band = self._declared.reach / _SHARE * math.expm1(_KAPPA * u)
            rows.lower[:] -= band
            rows.upper[:] += band


def largest_jump(velocities: Array) -> float:
    """The largest |v_k − v_(k−1)| of any velocity [rad/s, m/s] in a path (ticks, nv)."""
    path = finite("velocities", velocities, (None, None))
    return float(np.abs(np.diff(path, axis=0)).max(initial=0.0))
