"""Tasks in joint space, which bring joints to a posture or along a path of postures."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike, IntArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.jit import kernel_apart
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import CIRCLE, OTHER, SCALAR, PostureSpace, Value, coordinate_table
from taskopt.kinematics.target import Hold, Target, as_target, check_target
from taskopt.kinematics.task.aimed import AimedTask
from taskopt.kinematics.task.base import (
    Task,
    gains,
    rate_gains,
    rate_units,
    task_acceleration,
    task_rate,
    weights,
)


@dataclass(frozen=True, eq=False)
class JointTask(Task):
    """Bring joints to a target posture q_d(t): v = q̇_d + K e with e = q_d ⊖ q.

    One row for each velocity of each joint [rad/s, m/s]. The difference q_d ⊖ q is taken on the manifold, so
    that continuous joints go the short way round. The rows of a joint with one degree of freedom are unit
    vectors; those of a free-flyer or ball joint, which must be named in `joints`, are A = −∂e/∂v, the exact
    derivative.

    Args:
        target: Target posture: all of it (nq,), one number for each joint [rad, m], a mapping from joint to
            number, or a `Target`. Default: the posture at the start.
        joints: Names of joints. Default: all that have one degree of freedom.
        gain: K [1/s], one number or one for each row. More lets the error die out faster and asks for larger
            velocities; it must stay below 2/Δt.
        weight: Factor of ½ (A v − b)² within the level [s²/rad², s²/m²], one number or one for each row. More
            lets this task win over others of the same level; a row of weight 0 is left out.
        rate_gain: K_D [1/s] in a stack of order 2, given like `gain`; K_P is K². Default: 2 K, for critical
            damping.
        name: Name in logs and plots. Default: "posture", or "joints" if some are named.

    Raises:
        InvalidValue: A joint is named twice, or a number is out of its range.

    Source:
        Equation (3.67), applied to the joint variables.
    """

    target: Target | Value = field(default_factory=Hold)
    joints: Sequence[str] | None = field(default=None, kw_only=True)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    rate_gain: ArrayLike | None = field(default=None, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        check_distinct(self.joints)
        gains(self.gain, np.size(self.gain))
        rate_gains(self.rate_gain, 1 if self.rate_gain is None else np.size(self.rate_gain))
        weights(self.weight, np.size(self.weight))

    def default_name(self) -> str:
        """Return "posture" for all joints, "joints" for some."""
        return "posture" if self.joints is None else "joints"

    def bind(self, robot: Robot, name: str) -> "BoundJoints":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            InvalidValue: The task has no joint, or the number of gains or weights does not fit its rows.
            UnknownName: The robot has no joint of that name.
        """
        joints = one_dof_joints(robot) if self.joints is None else tuple(self.joints)
        spans = [robot.velocity_index(joint) for joint in joints]
        columns = np.array([c for span in spans for c in range(span.start, span.stop)], dtype=np.int64)
        if columns.size == 0:
            raise InvalidValue(f"task '{name}' has no joint")
        weight = weights(self.weight, columns.size)
        kept = weight > 0.0
        gain = gains(self.gain, columns.size)[kept]
        kind = BoundPosture if (coordinate_table(robot)[columns, 0] == OTHER).any() else BoundJoints
        bound = kind(robot, name, columns[kept], gain, weight[kept])
        bound.rate_gain = rate_gains(self.rate_gain, columns.size)[kept]
        space = PostureSpace(f"target of '{name}'", robot, joints)
        check_target(self.target, space, robot.neutral)
        bound.attach(as_target(self.target), space)
        return bound


def check_distinct(joints: Sequence[str] | None) -> None:
    """Check that names of joints are a list without repetition.

    Args:
        joints: Names, or None for the default of a task.

    Raises:
        InvalidValue: The names are a single text instead of a list, or one name occurs twice.
    """
    names = () if joints is None else joints
    if isinstance(names, str) or not isinstance(names, Sequence) or len(set(names)) != len(names):
        raise InvalidValue(f"joints must be different names in a list, got {joints!r}")


def one_dof_joints(robot: Robot) -> tuple[str, ...]:
    """Return the names of the joints with one velocity each; on most robots these are all with a motor.

    Args:
        robot: The robot.

    Returns:
        Names in the order of the robot.
    """
    spans = {joint: robot.velocity_index(joint) for joint in robot.joints}
    return tuple(joint for joint, span in spans.items() if span.stop - span.start == 1)


class BoundJoints(AimedTask):
    """The rows of a `JointTask` whose joints have one degree of freedom: unit vectors; only b changes.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        columns: Column of the joint velocities of each row, (m,).
        gain: K of each row [1/s], (m,).
        weight: Weight of each row, (m,).
    """

    def __init__(self, robot: Robot, name: str, columns: IntArray, gain: Array, weight: Array) -> None:
        names = [robot.velocity_names[c] for c in columns]
        units = rate_units(robot.coordinate_units[c] for c in columns)
        super().__init__(name, names, units, gain, weight, columns.tolist())
        self._columns, self.kernel = columns, joint_rows
        m, nq, nv = columns.size, robot.nq, robot.nv
        places = np.column_stack([columns, coordinate_table(robot)[columns]])
        self.parameters = np.concatenate([[m, nq, nv], places.ravel()])
        self._parts = np.cumsum([1, nq, nv, m, m, nv])
        self.use(np.zeros(1 + nq + 2 * nv + 3 * m))
        self.gain[:] = gain

    def attach(self, target: Target, space: PostureSpace) -> None:
        """Set the target.

        Args:
            target: Target, in the terms of `taskopt.kinematics.target`.
            space: The joints for which it has values.
        """
        self.take_target(target, space)

    def use(self, memory: Array) -> None:
        """Re-bind this part to a memory; see `Part.use`."""
        self.memory = memory
        parts = np.split(memory, self._parts)
        _, self.goal, self._rate, self.gain, self.error, self._acceleration, self._rate_gain = parts

    def accelerate(self) -> None:
        """Set the kernel of second order; see `BoundTask.accelerate`.

        Raises:
            InvalidValue: A joint of the task has more than one degree of freedom.
        """
        self.lift_kernel = joint_lift if self.kernel is not None else None
        self._rate_gain[:] = self.rate_gain
        super().accelerate()

    def prepare(self, rows: LevelRows) -> None:
        """Write the unit vectors; see `RowPart.prepare`."""
        rows.A[np.arange(self._columns.size), self._columns] = 1.0

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the target from the present posture; see `RowPart.start`."""
        self.begin(configuration.q, t)

    def aim(self, t: float) -> None:
        """Write the target posture at t [s], and its rate where it has one."""
        self.memory[0] = self.aimed(t, self._rate, self._acceleration)


class BoundPosture(BoundJoints):
    """The rows of a `JointTask` with joints of any kind: e = q_d ⊖ q, A = −∂e/∂v.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        columns: Column of the joint velocities of each row, (m,).
        gain: K of each row [1/s], (m,).
        weight: Weight of each row, (m,).
    """

    def __init__(self, robot: Robot, name: str, columns: IntArray, gain: Array, weight: Array) -> None:
        super().__init__(robot, name, columns, gain, weight)
        self._robot, self.kernel, self.column = robot, None, (-1,) * columns.size

    def prepare(self, rows: LevelRows) -> None:
        """Do nothing: `fill` writes every row at every tick. See `RowPart.prepare`."""

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows; see `RowPart.fill`."""
        self.aim(t)
        q = configuration.q
        from_q, from_target = self._robot.difference_rates(q, self.goal)
        self.error[:] = self._robot.difference(q, self.goal)[self._columns]
        rows.A[:] = -from_q[self._columns]
        feedforward = from_target[self._columns] @ self._rate if self.memory[0] else np.zeros_like(self.error)
        rows.lower[:] = task_rate(feedforward, self.gain, self.error)
        rows.upper[:] = rows.lower


@kernel_apart
def joint_rows(parameters, memory, state, rows):
    """Fill the bounds of joints with one degree of freedom; their A never changes.

    Args:
        parameters: Flat array of integers: m, nq, nv, and for each of the m rows its column, its kind of
            coordinate and its place in q.
        memory: Flat array: 1.0 if the target moves, else 0.0; target posture (nq,), its rate (nv,), gains
            (m,), errors (m,); then, read at second order only, acceleration of the target (nv,), K_D (m,).
        state: The robot, see `RobotState`.
        rows: The m rows, see `RowArrays`.
    """
    q, m, rates = state.q, parameters[0], 1 + parameters[1]
    gain = rates + parameters[2]
    for i in range(m):
        column, kind, at = parameters[3 + 3 * i], parameters[4 + 3 * i], parameters[5 + 3 * i]
        if kind == SCALAR:
            error = memory[1 + at] - q[at]
        elif kind == CIRCLE:
            c, s, cd, sd = q[at], q[at + 1], memory[1 + at], memory[2 + at]
            error = np.arctan2(sd * c - cd * s, cd * c + sd * s)
        else:
            error = np.nan
        feedforward = memory[rates + column] if memory[0] != 0.0 else 0.0
        rows.lower[i] = rows.upper[i] = task_rate(feedforward, memory[gain + i], error)
        memory[gain + m + i] = error


@kernel_apart
def joint_lift(parameters, memory, state, motion, rows):  # noqa: ARG001 (a `LiftKernel`)
    """Fill the bounds of joints with one degree of freedom in a stack of second order.

    Args:
        parameters: As for `joint_rows`.
        memory: As for `joint_rows`.
        state: The robot, see `RobotState`.
        motion: Its motion, see `Motion`.
        rows: The m rows, see `RowArrays`.
    """
    m, rates = parameters[0], 1 + parameters[1]
    nv = parameters[2]
    gain, error = rates + nv, rates + nv + m
    acceleration, rate_gain = error + m, error + m + nv
    for i in range(m):
        column = parameters[3 + 3 * i]
        rate = feedforward = 0.0
        if memory[0] != 0.0:
            rate, feedforward = memory[rates + column], memory[acceleration + column]
        rows.lower[i] = rows.upper[i] = task_acceleration(
            feedforward,
            memory[gain + i],
            memory[rate_gain + i],
            memory[error + i],
            rate - motion.velocity[column],
        )
