"""Tasks that ask for given joint velocities, or for those of the last tick."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.parameter import Parameter
from taskopt.kinematics.redirection import VelocityTarget
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import PostureSpace, Value
from taskopt.kinematics.task.base import BoundTask, Task, rate_units, weights
from taskopt.kinematics.task.joint import check_distinct, one_dof_joints

Velocity = Value | Callable[[float], Value]


@dataclass(frozen=True, eq=False)
class JointVelocityTask(Task):
    """Move joints at given velocities: v = q̇_d, one row for each velocity [rad/s, m/s].

    There is no position error: a displacement that is missed in one tick is not made up for later.
    `JointTask` with a moving target follows a path instead.

    Args:
        target: q̇_d: a mapping from joint to number, one number for each joint, all velocities (nv,), or a
            function of the time t [s] that returns one of these.
        joints: Names of joints. Default: those of the mapping; else all that have one degree of freedom.
        weight: Factor of ½ (v − q̇_d)² within the level [s²/rad², s²/m²], one number or one for each row.
            More lets this task win over others of the same level; a row of weight 0 is left out.
        name: Name in logs and plots. Default: "joint velocity".

    Raises:
        InvalidValue: A weight or a velocity is out of its range or has the wrong size. The error is raised
            when the task is bound, or when a function returns the velocity.
    """

    target: Velocity
    joints: Sequence[str] | None = field(default=None, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        check_distinct(self.joints)

    def bind(self, robot: Robot, name: str) -> "BoundJointVelocities":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no joint of that name.
            InvalidValue: The velocities do not fit the joints.
        """
        joints = self.joints
        if joints is None and isinstance(self.target, Mapping):
            joints = tuple(self.target)
        bound = BoundJointVelocities(robot, name, joints, self.weight)
        bound.attach(self.target, PostureSpace(f"target of '{name}'", robot, bound.joints))
        return bound


@dataclass(frozen=True, eq=False)
class LowAccelerationTask(Task):
    """Keep the velocities of the last tick: v = v_last, one row for each velocity [rad/s, m/s].

    Together with other tasks of its level it makes changes of velocity expensive. The first tick starts from
    rest, or from the velocity that is given to `Controller.step`. It does not bring the robot to rest; add a
    `DampingTask` to its level for that.

    Args:
        weight: Factor of ½ (v − v_last)² within the level [s²/rad², s²/m²], one number or one for each row.
            More lets velocities change more slowly; a row of weight 0 is left out.
        joints: Names of joints. Default: all that have one degree of freedom.
        name: Name in logs and plots. Default: "low acceleration".

    Raises:
        InvalidValue: A joint is named twice; or, when bound, a weight is out of its range.
    """

    weight: ArrayLike = 1.0
    joints: Sequence[str] | None = field(default=None, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        check_distinct(self.joints)

    def bind(self, robot: Robot, name: str) -> "BoundLowAcceleration":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no joint of that name.
        """
        return BoundLowAcceleration(robot, name, self.joints, self.weight)


class _BoundUnitRows(BoundTask):
    """Unit vectors for the velocities of some joints; subclasses say which velocities they ask for."""

    def __init__(self, robot: Robot, name: str, joints: Sequence[str] | None, weight: ArrayLike) -> None:
        self.joints = one_dof_joints(robot) if joints is None else tuple(joints)
        spans = [robot.velocity_index(joint) for joint in self.joints]
        columns = np.array([c for span in spans for c in range(span.start, span.stop)], dtype=np.int64)
        if columns.size == 0:
            raise InvalidValue(f"task '{name}' has no joint")
        every = weights(weight, columns.size)
        self._columns = columns = columns[every > 0.0]
        names = [robot.velocity_names[c] for c in columns]
        units = rate_units(robot.coordinate_units[c] for c in columns)
        super().__init__(name, names, units, 0.0, every[every > 0.0], columns.tolist())

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return no gain, since no error dies out here; see `Part.adjustable`."""
        return {}

    def prepare(self, rows: LevelRows) -> None:
        """Write the unit vectors; see `RowPart.prepare`."""
        rows.A[np.arange(self._columns.size), self._columns] = 1.0


class BoundJointVelocities(_BoundUnitRows):
    """The rows of a `JointVelocityTask`.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        joints: Names of joints, or None for all that have one degree of freedom.
        weight: Weight, one number or one for each velocity of the joints.

    Attributes:
        joints: Names of the joints.
    """

    def attach(self, target: Velocity, space: PostureSpace) -> None:
        """Set the velocities that the task asks for.

        Args:
            target: q̇_d (m,) [rad/s, m/s], or a function of the time [s] that returns it.
            space: The joints for which it has values.
        """
        self._space, self._of_time = space, target if callable(target) else None
        self._velocity = np.zeros(space.tangent) if callable(target) else space.convert_rate(target)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return the velocities, as "target"; see `Part.adjustable`."""
        return {"target": VelocityTarget(self._velocity, self._space.convert_rate, self._drop_function)}

    def recall(self) -> Array | None:
        """Return the velocities, or None while a function of time gives them; see `Part.recall`."""
        return None if self._of_time is not None else self._velocity.copy()

    def remember(self, kept: object) -> None:
        """Restore the velocities; see `Part.remember`."""
        if isinstance(kept, np.ndarray):
            self._velocity[:], self._of_time = kept, None

    def _drop_function(self) -> None:
        """Forget a function of time, since other velocities were set."""
        self._of_time = None

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the bounds; see `RowPart.fill`."""
        if self._of_time is not None:
            self._velocity[:] = self._space.convert_rate(self._of_time(t))
        rows.lower[:] = rows.upper[:] = self._velocity[self._columns]


class BoundLowAcceleration(_BoundUnitRows):
    """The rows of a `LowAccelerationTask`, for which the robot is at rest until `moved` is called.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        joints: Names of joints, or None for all that have one degree of freedom.
        weight: Weight, one number or one for each velocity of the joints.

    Attributes:
        joints: Names of the joints.
    """

    follows_velocity = True

    def __init__(self, robot: Robot, name: str, joints: Sequence[str] | None, weight: ArrayLike) -> None:
        super().__init__(robot, name, joints, weight)
        self._last: Array = np.zeros(self._columns.size)

    def moved(self, v: Array) -> None:
        """Remember the velocity that the robot has until the next tick; see `BoundTask.moved`."""
        self._last[:] = v[self._columns]

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the bounds; see `RowPart.fill`."""
        rows.lower[:] = rows.upper[:] = self._last
