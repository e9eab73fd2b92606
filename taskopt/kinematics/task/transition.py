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
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, finite, number, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import BoundTask, Task
from taskopt.kinematics.task.damping import LevelDamping

_SHARE = 1000.0  # reach/ε
_KAPPA = math.log(1.0 + _SHARE)
_LEAST_REACH = 10.0  # [rad/s, m/s]
_CLOSED = 1e-6  # of u: a band that only rounding keeps open would be two bounds in one place


@dataclass(frozen=True, eq=False)
class During:
    """A task in force from `begin` to `end` [s]; it comes in `blend` seconds after `begin`, goes after `end`.

    Insert a task with `begin`, remove it with `end`, move it to another level by having it at both with the
    `end` of one the `begin` of the other (`swap` does that for levels). Its references are anchored where it
    begins. `reach`: the width of the band [m/s, rad/s] from which it closes in, and to which it opens, more
    than its rows are then away from their goals; None: twice what they ask for there, and at least 10.
    """

    task: Task
    begin: float = field(default=-math.inf, kw_only=True)
    end: float = field(default=math.inf, kw_only=True)
    blend: float = field(default=0.25, kw_only=True)
    reach: float | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.task, Task) or isinstance(self.task, During | LevelDamping):
            raise InvalidValue(
                "task must be a task that is not timed itself, nor by its level as damping is, "
                f"got {self.task!r}"
            )
        number("begin", self.begin, ())
        number("end", self.end, ())
        if self.reach is not None:
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
        self.declared, self._inner, self._begun = declared, inner, False
        self._reach: dict[bool, float] = {}  # while it comes (True), and while it goes (False)
        self.name, self.row_names, self.row_units = inner.name, inner.row_names, inner.row_units
        self.column, self.weight, self.gain, self.error = inner.column, inner.weight, inner.gain, inner.error
        self.frame, self.desired, self.actual = inner.frame, inner.desired, inner.actual
        self.box, self.cone = getattr(inner, "box", None), getattr(inner, "cone", None)

    def prepare(self, rows: LevelRows) -> None:
        self._inner.prepare(rows)

    def start(self, at: Configuration, t: float) -> None:
        self._inner.start(at, t)
        self._begun = t >= self.declared.begin
        self._reach.clear()

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        if not self._begun and t >= self.declared.begin:
            self.start(at, t)
        self._inner.fill(at, t, rows)
        u = self.declared.openness(t)
        if u >= 1.0:
            rows.lower[:], rows.upper[:] = -np.inf, np.inf
        elif u > _CLOSED:
            band = self._reach_at(t, rows) / _SHARE * math.expm1(_KAPPA * u)
            rows.lower[:] -= band
            rows.upper[:] += band

    def _reach_at(self, t: float, rows: LevelRows) -> float:
        """The reach of a transition, the same from its first tick to its last."""
        comes = t < self.declared.begin + self.declared.blend
        if comes not in self._reach:
            asked = max(float(np.abs(b[np.isfinite(b)]).max(initial=0.0)) for b in (rows.lower, rows.upper))
            self._reach[comes] = self.declared.reach or max(_LEAST_REACH, 2.0 * asked)
        return self._reach[comes]


class Transition(NamedTuple):
    """A task that comes or goes, from `begin` to `end` [s]."""

    task: str
    what: str
    begin: float
    end: float


def transitions(tasks: Iterable[BoundTask]) -> tuple[Transition, ...]:
    """When the tasks of a plan come and go."""
    out: list[Transition] = []
    for task in tasks:
        if isinstance(task, BoundDuring):
            times = (("comes", task.declared.begin), ("goes", task.declared.end))
            out += [
                Transition(task.name, what, t, t + task.declared.blend)
                for what, t in times
                if math.isfinite(t)
            ]
    return tuple(out)


def swap(
    first: Sequence[Task], second: Sequence[Task], at: float, blend: float = 0.25, reach: float | None = None
) -> list[list[Task]]:
    """Levels in which the tasks of `first` stand above those of `second` until `at` [s], then below them.

    `Stack(levels=[*swap([a], [b], at=2.0), [c]])` is a, b, c, then b, a, c. The tasks of `second` go below
    and come above those of `first`, as `During` does it.
    """
    above: list[Task] = [During(task, begin=at, blend=blend, reach=reach) for task in second]
    below: list[Task] = [During(task, end=at, blend=blend, reach=reach) for task in second]
    return [above, list(first), below]


def largest_jump(velocities: Array) -> float:
    """The largest |v_k − v_(k−1)| of any velocity [rad/s, m/s] in a path (ticks, nv)."""
    path = finite("velocities", velocities, (None, None))
    return float(np.abs(np.diff(path, axis=0)).max(initial=0.0))
