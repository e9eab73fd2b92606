"""Tasks that are inserted, removed or swapped at given times, without a jump in the velocities.

Rows that are not in force have the bounds −∞ and ∞, and so change nothing. While a task comes, its bounds
close in from a band of ±β to what the task asks for; while it goes, they open again. For matrices that stand
still, the lexicographic optimum is a Lipschitz continuous function of all bounds: the residuals of a level
are the projection on a polyhedron, those of the next level are the same on what is left, and polyhedra with
fixed rows move no faster than their bounds, up to a factor L. A band that moves by dβ in a tick therefore
moves v by at most L dβ, at whatever level it stands, while a task that is switched makes v jump. Every tick
is one strict hierarchy, resolved and certified as any other.

    β(u) = ε (e^(κu) − 1),  u from 1 to 0 while the task comes,  dβ/du = κ (β + ε)

The band closes at a rate in proportion to its width, which suits goals that are near and goals that are far:
a row that is D away from its goal moves by at most κ (D + ε)/blend a second, with ε = reach/1000 and
κ = log 1001 = 6.9. A row comes from twice the distance at which it is then. How far it will be carried away
when it goes is not known beforehand: a row that is still held at the edge of its band when its time is over
stays until it is not, while the band opens on.

Source:
    Hoffman (1952), Journal of Research of the National Bureau of Standards 49(4), for the factor L.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, cast

import numpy as np

from taskopt.arrays import Array, ArrayLike, BoolArray, finite, number, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.hierarchy.tolerances import BAND_CLOSED
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Shape
from taskopt.kinematics.parameter import Parameter, Setting
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import BoundTask, Task
from taskopt.kinematics.task.level_damping import LevelDamping

_SHARE = 1000.0  # reach/ε
_KAPPA = math.log(1.0 + _SHARE)
_LEAST_REACH = 10.0  # [rad/s, m/s]
_HELD = 0.99  # share of its band's width beyond which a row counts as held by the band


@dataclass(frozen=True, eq=False)
class During(Task):
    """Have a task in force from `begin` to `end` only, and let it come and go without a jump.

    Rows, units and frame are those of the task. Insert a task with `begin`, remove it with `end`, and move it
    to another level by having it at both, with the `end` of one equal to the `begin` of the other; `swap`
    does that for levels. Targets that begin at the present posture are anchored at `begin`.

    Args:
        task: The task; not a `During` and not a `LevelDamping`.
        begin: Time [s] at which it begins to come. Default: always there.
        end: Time [s] at which it begins to go. Default: never.
        blend: Time that it takes to come, and to go [s]. More makes the velocities change more slowly; 0
            switches, which lets them jump.
        reach: Width of the band [m/s, rad/s] from which the bounds close in, and to which they open. It
            should exceed the distance of the rows from their goals when the task comes; more makes the band
            move faster. Default: twice that distance and twice what the rows ask for, and at least 10.

    Raises:
        InvalidValue: The task cannot be timed, or begin + blend is later than end.
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
    def name(self) -> str | None:  # type: ignore[override]
        """Name of the task, or None."""
        return self.task.name

    def default_name(self) -> str:
        """Return the default name of the task."""
        return self.task.default_name()

    @property
    def obstacles(self) -> Sequence[Shape]:
        """Shapes that the task depends on, which a viewer draws."""
        return self.task.obstacles

    def bind(self, robot: Robot, name: str) -> "BoundDuring":
        """Return the rows for a robot; see `Task.bind`."""
        return BoundDuring(self, self.task.bind(robot, name))

    def openness(self, t: float) -> float:
        """Return u(t), which says how far the bounds of the task are opened.

        Args:
            t: Time [s].

        Returns:
            0 while the task is fully in force, and 1 or more while it is not in force at all.
        """
        coming = self.begin - t + self.blend if math.isfinite(self.begin) else -math.inf
        going = t - self.end if math.isfinite(self.end) else -math.inf
        late = max(coming, going, 0.0)
        return late / self.blend if self.blend > 0.0 else math.copysign(math.inf, late) if late else 0.0


class BoundDuring(BoundTask):
    """The rows of a task, whose bounds are opened outside the time in which the task is in force.

    Args:
        declared: The declaration, which states when the task is in force.
        inner: The task as bound to the robot.
    """

    def __init__(self, declared: During, inner: BoundTask) -> None:
        super().__init__(inner.name, inner.row_names, inner.row_units, inner.gain, inner.weight, inner.column)
        self.declared, self._inner, self._begun, self._came_later = declared, inner, False, False
        self._band, self._velocity = Band(len(inner.row_names), declared.reach), np.zeros(0)
        self.weight, self.gain, self.error = inner.weight, inner.gain, inner.error
        self.frame, self.desired, self.actual = inner.frame, inner.desired, inner.actual
        self.box, self.cone = inner.box, inner.cone
        self.follows_velocity = True

    def moved(self, v: Array) -> None:
        """Tell the task the velocity; see `BoundTask.moved`."""
        self._velocity = v
        if self._inner.follows_velocity:
            self._inner.moved(v)

    def prepare(self, rows: LevelRows) -> None:
        """Write what never changes in the rows of the task; see `RowPart.prepare`."""
        self._inner.prepare(rows)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return the parameters of the task; see `Part.adjustable`."""
        return self._inner.adjustable()

    def each_weight(self, weight: ArrayLike) -> Array | float:
        """Return a weight for each row, as the task takes it; see `BoundTask.each_weight`."""
        return self._inner.each_weight(weight)

    def rows_of_axes(self, axes: Setting) -> BoolArray:
        """Return which rows a choice of axes takes; see `BoundTask.rows_of_axes`."""
        return self._inner.rows_of_axes(axes)

    def recall(self) -> object:
        """Refuse a copy once the task has come, since its target was started then; see `Part.recall`.

        Raises:
            InvalidValue: The task came after the start.
        """
        if self._begun and self._came_later:
            raise InvalidValue(
                f"'{self.name}' came after the start, and is anchored where the robot was then; the loop can "
                "no longer be copied, so copy it earlier, or make a new one"
            )
        return self._inner.recall(), self._band.copy()

    def remember(self, kept: object) -> None:
        """Restore the state of the task; see `Part.remember`."""
        inner, band = cast("tuple[object, Band]", kept)
        self._inner.remember(inner)
        self._band = band.copy()

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the target of the task; see `RowPart.start`."""
        self._inner.start(configuration, t)
        self._begun, self._came_later = t >= self.declared.begin, False
        self._band.forget()

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows; see `RowPart.fill`."""
        if not self._begun and t >= self.declared.begin:
            self.start(configuration, t)
            self._came_later = True
        if self._inner.constant:
            rows.lower[:] = rows.upper[:] = 0.0
        else:
            self._inner.fill(configuration, t, rows)
        u = self.declared.openness(t)
        self._band.open(rows, np.full(len(rows.lower), u), self._velocity)


class Band:
    """The band around the goal of each row of a task while the task comes or goes.

    Args:
        count: Number of rows, m.
        reach: Width [m/s, rad/s] from which the band closes and to which it opens; None for twice what the
            rows ask for and twice their distance from it, and at least 10.
    """

    def __init__(self, count: int, reach: float | None = None) -> None:
        self._declared = reach
        self._reach = 0.0  # of the transition that is under way; 0 without any
        self.width: Array = np.full(count, np.inf)
        """Width at the last tick, (m,): 0 for a row in force, infinite for one that is not."""

    def copy(self) -> "Band":
        """Return a band in the same state."""
        new = Band(len(self.width), self._declared)
        new._reach, new.width = self._reach, self.width.copy()
        return new

    def forget(self) -> None:
        """Forget the transition that is under way, as if no row had been in force before."""
        self._reach, self.width = 0.0, np.full(len(self.width), np.inf)

    def open(self, rows: LevelRows, openness: Array, v: Array) -> None:
        """Open the bounds of rows.

        Args:
            rows: Rows with the bounds that the task asks for; their bounds are changed.
            openness: u of each row, (m,): 0 for a row in force, 1 or more for one whose time is over or has
                not come.
            v: Velocity that the robot has until now, (n,) [rad/s, m/s]; empty where it is not known.
        """
        opened = openness > BAND_CLOSED
        if self._reach == 0.0 and not (opened & (openness < 1.0)).any():  # most often; the rest takes longer
            self.width = np.where(opened, np.inf, 0.0)
            rows.lower[opened], rows.upper[opened] = -np.inf, np.inf
            return
        away = np.abs(rows.distance(v)) if v.size else np.zeros(len(openness))
        held = np.isfinite(self.width) & np.isfinite(openness) & (away >= _HELD * self.width)
        between = opened & ((openness < 1.0) | (held & (self.width > 0.0)))
        if not between.any():
            self._reach = 0.0
        elif self._reach == 0.0:
            self._reach = self._declared or max(reach_of(rows), 2.0 * float(away.max()))
        self.width = np.where(opened, np.inf, 0.0)
        self.width[between] = width_of_band(openness[between], self._reach)
        rows.lower[:] -= self.width
        rows.upper[:] += self.width

    @property
    def under_way(self) -> bool:
        """True if a row was neither fully in force nor without bounds at the last tick."""
        return self._reach > 0.0


def width_of_band(openness: float | Array, reach: float) -> Array:
    """Return β(u), the distance of the bounds from what a task asks for.

    Args:
        openness: u ≥ 0, any shape.
        reach: β(1) [m/s, rad/s].

    Returns:
        β of each u [m/s, rad/s].
    """
    return np.asarray(reach / _SHARE * np.expm1(_KAPPA * np.asarray(openness)))


def reach_of(rows: LevelRows) -> float:
    """Return the least width from which a band closes: twice what the rows ask for, and at least 10.

    Args:
        rows: Rows of a task, filled.

    Returns:
        Width [m/s, rad/s].
    """
    asked = max(float(np.abs(b[np.isfinite(b)]).max(initial=0.0)) for b in (rows.lower, rows.upper))
    return max(_LEAST_REACH, 2.0 * asked)


class Transition(NamedTuple):
    """One interval of time in which a task is blended in or out.

    Attributes:
        task: Name of the task.
        what: "comes" or "goes".
        begin: Time at which the transition begins [s].
        end: Time at which the transition is complete [s].
    """

    task: str
    what: str
    begin: float
    end: float


def transitions(tasks: Iterable[BoundTask]) -> tuple[Transition, ...]:
    """List the transitions of the tasks of a plan.

    Args:
        tasks: Tasks of a plan.

    Returns:
        One entry for each time a task comes or goes.
    """
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
    first: Sequence[Task],
    second: Sequence[Task],
    *,
    at: float,
    blend: float = 0.25,
    reach: float | None = None,
) -> list[list[Task]]:
    """Make levels in which one group of tasks is above another until a time, and below it afterwards.

    `Stack(levels=[*swap([a], [b], at=2.0), [c]])` has the order a, b, c before t = 2 s and b, a, c after. The
    tasks of `second` leave the level below those of `first` and enter a level above, as `During` does it.

    Args:
        first: Tasks that are on the higher level until `at`.
        second: Tasks that are on the higher level from then on.
        at: Time of the swap [s].
        blend: Duration of the change [s], see `During`.
        reach: Width of the band, see `During`.

    Returns:
        Three levels: `second` after the swap, `first` all the time, `second` before the swap.
    """
    above: list[Task] = [During(task, begin=at, blend=blend, reach=reach) for task in second]
    below: list[Task] = [During(task, end=at, blend=blend, reach=reach) for task in second]
    return [above, list(first), below]


def largest_jump(velocities: Array) -> float:
    """Return the largest change of any velocity from one tick to the next.

    Args:
        velocities: Velocities of all ticks, (ticks, nv) [rad/s, m/s].

    Returns:
        max |v_k − v_(k−1)| [rad/s, m/s].
    """
    path = finite("velocities", velocities, (None, None))
    return float(np.abs(np.diff(path, axis=0)).max(initial=0.0))
