"""Damping of one task, which grows with the error of that task."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike, BoolArray, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Shape
from taskopt.kinematics.parameter import Followed, Numbers, Parameter, Setting
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import BoundTask, Task
from taskopt.kinematics.task.level_damping import LevelDamping
from taskopt.kinematics.task.transition import During


@dataclass(frozen=True, eq=False)
class DampedTask(Task):
    """Add rows k v = 0 to a task, whose factor k² = μ Σ w_i e_i² grows with the error of the task.

    Far from its target a task that cannot be met asks for large velocities; the damping slows it down there,
    and vanishes at the target. After the rows of the task there is one row for each velocity, without a unit.
    While the error is not zero these rows decide the velocity of every joint, so that nothing is left to the
    levels below. `LevelDamping` with `Sugihara` damps only the directions that its level decides.

    Args:
        task: The task; not a `During`, `LevelDamping` or `DampedTask`. To time a damped task, put it into
            `During`.
        factor: μ ≥ 0 [1/rad², 1/m²]. A larger factor slows the task down at smaller errors.
        name: Name in logs and plots. Default: the name of the task.

    Raises:
        InvalidValue: The task cannot be damped, or the factor is out of its range.

    Source:
        Sugihara (2011), IEEE Transactions on Robotics 27(5).
    """

    task: Task
    factor: float
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.task, Task) or isinstance(self.task, During | LevelDamping | DampedTask):
            raise InvalidValue(
                f"task must be a task that is neither timed nor damping itself, got {self.task!r}; "
                "During takes a damped task"
            )
        checked_factor("factor", self.factor)

    @property
    def obstacles(self) -> Sequence[Shape]:
        """Shapes that the task depends on, which a viewer draws."""
        return self.task.obstacles

    def default_name(self) -> str:
        """Return the name of the task."""
        return self.task.name or self.task.default_name()

    def bind(self, robot: Robot, name: str) -> "BoundDamped":
        """Return the rows for a robot; see `Task.bind`."""
        return BoundDamped(robot, self.task.bind(robot, name), float(self.factor))


class BoundDamped(BoundTask):
    """The rows of a task, then one row k v_j = 0 for each velocity.

    Args:
        robot: The robot.
        inner: The task, bound.
        factor: μ.
    """

    def __init__(self, robot: Robot, inner: BoundTask, factor: float) -> None:
        m, n = len(inner.row_names), robot.nv
        super().__init__(
            inner.name,
            (*inner.row_names, *(f"damping {name}" for name in robot.velocity_names)),
            (*inner.row_units, *[""] * n),
            np.concatenate([inner.gain, np.zeros(n)]),
            np.concatenate([inner.weight, np.ones(n)]),
            (*inner.column, *[-1] * n),
        )
        self._inner, self._own, self._factor = inner, slice(0, m), np.array([factor])
        self.frame, self.desired, self.actual = inner.frame, inner.desired, inner.actual
        self.box, self.cone = inner.box, inner.cone
        self.follows_velocity = inner.follows_velocity

    def retime(self, dt: float) -> None:
        """Change Δt [s]; see `Part.retime`."""
        self._inner.dt = dt
        self._inner.retime(dt)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return the factor, and the parameters of the task; see `Part.adjustable`."""
        self._inner.dt = self.dt
        of_task = self._inner.adjustable().items()
        followed = {name: Followed(parameter, self._copy_gain) for name, parameter in of_task}
        return {**followed, "factor": Numbers(self._factor, self._one_factor)}

    def _copy_gain(self) -> None:
        """Take over the gain of the task."""
        self.gain[self._own] = self._inner.gain

    def _one_factor(self, factor: ArrayLike) -> float:
        """Return a factor that is in its range."""
        return checked_factor(f"factor of '{self.name}'", factor)

    def each_weight(self, weight: ArrayLike) -> Array:
        """Return the weights of all rows; see `BoundTask.each_weight`.

        Numbers for the rows of the task leave 1 for each row that damps.
        """
        each = np.ones(len(self.row_names))
        if np.shape(weight) == each.shape:
            each[:] = super().each_weight(weight)
        else:
            each[self._own] = self._inner.each_weight(weight)
        return each

    def rows_of_axes(self, axes: Setting) -> BoolArray:
        """Return which rows a choice of axes takes; see `BoundTask.rows_of_axes`.

        Axes of the task leave all rows that damp.
        """
        if isinstance(axes, list | tuple | np.ndarray) and self._names_damping(axes):
            return super().rows_of_axes(axes)
        chosen = np.ones(len(self.row_names), dtype=bool)
        chosen[self._own] = self._inner.rows_of_axes(axes)
        return chosen

    def _names_damping(self, axes: Sequence[object] | Array) -> bool:
        """Return True if a choice speaks of all rows, those that damp among them."""
        damping = self.row_names[self._own.stop :]
        return len(axes) == len(self.row_names) or any(name in damping for name in axes)

    def recall(self) -> object:
        """Return what the task remembers; see `Part.recall`."""
        return self._inner.recall()

    def remember(self, kept: object) -> None:
        """Hand on what the task remembers; see `Part.remember`."""
        self._inner.remember(kept)

    def moved(self, v: Array) -> None:
        """Tell the task the velocity; see `BoundTask.moved`."""
        self._inner.moved(v)

    def prepare(self, rows: LevelRows) -> None:
        """Write what never changes in the rows of the task; see `RowPart.prepare`."""
        self._inner.prepare(_part(rows, self._own))

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the target of the task; see `RowPart.start`."""
        self._inner.start(configuration, t)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows; see `RowPart.fill`."""
        inner, m = self._inner, self._own.stop
        if inner.constant:
            rows.lower[:m] = rows.upper[:m] = 0.0
        else:
            inner.fill(configuration, t, _part(rows, self._own))
        rows.lower[m:] = rows.upper[m:] = 0.0  # `During` may have opened them
        self.error[:m] = inner.error
        k = np.sqrt(self._factor[0] * float(self.weight[:m] @ inner.error**2))
        np.fill_diagonal(rows.A[m:], k)


def _part(rows: LevelRows, chosen: slice) -> LevelRows:
    """Return some of the rows as views."""
    return LevelRows(rows.A[chosen], rows.lower[chosen], rows.upper[chosen], rows.weight[chosen])


def checked_factor(name: str, factor: ArrayLike) -> float:
    """Return a factor of damping.

    Args:
        name: Name of the factor in messages.
        factor: μ.

    Returns:
        The factor.

    Raises:
        InvalidValue: The value is not a number ≥ 0.
    """
    number = float(finite(name, factor, ()))
    if number < 0.0:
        raise InvalidValue(f"{name} must be ≥ 0, got {number:g}")
    return number
