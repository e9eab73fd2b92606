"""Damping of one task, which grows with the error of that task."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Shape
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
        if finite("factor", self.factor, ()) < 0.0:
            raise InvalidValue(f"factor must be ≥ 0, got {self.factor:g}")

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
        self._inner, self._own, self._factor = inner, slice(0, m), factor
        self.frame, self.desired, self.actual = inner.frame, inner.desired, inner.actual
        self.box, self.cone = inner.box, inner.cone
        self.follows_velocity = inner.follows_velocity

    def moved(self, v: Array) -> None:
        """Tell the task the velocity; see `BoundTask.moved`."""
        self._inner.moved(v)

    def prepare(self, rows: LevelRows) -> None:
        """Write what never changes in the rows of the task; see `RowPart.prepare`."""
        self._inner.prepare(_part(rows, self._own))

    def start(self, configuration: Configuration, t: float) -> None:
        """Anchor the target of the task; see `RowPart.start`."""
        self._inner.start(configuration, t)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows; see `RowPart.fill`."""
        inner, m = self._inner, self._own.stop
        rows.lower[:] = rows.upper[:] = 0.0
        if not inner.constant:
            inner.fill(configuration, t, _part(rows, self._own))
        self.error[:m] = inner.error
        k = np.sqrt(self._factor * float(inner.weight @ inner.error**2))
        np.fill_diagonal(rows.A[m:], k)


def _part(rows: LevelRows, chosen: slice) -> LevelRows:
    """Return some of the rows as views."""
    return LevelRows(rows.A[chosen], rows.lower[chosen], rows.upper[chosen], rows.weight[chosen])
