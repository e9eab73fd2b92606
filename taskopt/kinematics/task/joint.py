"""Tasks in joint space: a posture, or the path of one."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, IntArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.jit import kernel
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import CIRCLE, OTHER, SCALAR, PostureSpace, coordinate_table
from taskopt.kinematics.target import Hold, Target, as_target
from taskopt.kinematics.task.rows import gains, rate_units, task_rate, weights


@dataclass(frozen=True, eq=False)
class JointTask:
    """Bring joints to q_d(t): v = q̇_d + K (q_d − q), one row a velocity of each joint.

    The difference is taken on the manifold: continuous joints go the short way round, and a free-flyer
    or ball joint, if named, has e = q_d ⊖ q and A its exact derivative. `joints`: names, by default all
    with one degree of freedom. `target`: a `Target`, or a posture to hold, as a whole (nq,), one
    number a joint, or a mapping. `gain` K [1/s] and `weight` (factor of ½‖·‖²): one number, or one a row.
    """

    target: Any = field(default_factory=Hold)
    joints: Sequence[str] | None = field(default=None, kw_only=True)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if isinstance(self.joints, str) or (
            self.joints is not None and len(set(self.joints)) != len(self.joints)
        ):
            raise InvalidValue(f"joints must be different names in a list, got {self.joints!r}")
        gains(self.gain, np.size(self.gain))
        weights(self.weight, np.size(self.weight))

    def default_name(self) -> str:
        return "posture" if self.joints is None else "joints"

    def bind(self, robot: Robot, name: str) -> "BoundJoints":
        joints = one_dof_joints(robot) if self.joints is None else tuple(self.joints)
        space = PostureSpace(f"target of '{name}'", robot, joints)
        spans = [robot.velocity_index(joint) for joint in joints]
        columns = np.array([c for span in spans for c in range(span.start, span.stop)], dtype=np.int64)
        if columns.size == 0:
            raise InvalidValue(f"task '{name}' has no joint")
        weight = weights(self.weight, columns.size)
        kept = weight > 0.0
        gain = gains(self.gain, columns.size)[kept]
        kind = BoundPosture if (coordinate_table(robot)[columns, 0] == OTHER).any() else BoundJoints
        return kind(robot, name, as_target(self.target), space, columns[kept], gain, weight[kept])


def one_dof_joints(robot: Robot) -> tuple[str, ...]:
    """Joints with one velocity each: all that have a motor, on most robots."""
    spans = {joint: robot.velocity_index(joint) for joint in robot.joints}
    return tuple(joint for joint, span in spans.items() if span.stop - span.start == 1)


class BoundJoints:
    """Joints with one degree of freedom: the rows are unit vectors, only b changes."""

    kind: str | None = "joints"
    frame = desired = actual = None
    constant = False

    def __init__(
        self,
        robot: Robot,
        name: str,
        reference: Target,
        space: PostureSpace,
        columns: IntArray,
        gain: Array,
        weight: Array,
    ) -> None:
        self.name, self.weight = name, weight
        self.row_names = tuple(robot.velocity_names[c] for c in columns)
        self.row_units = rate_units(robot.coordinate_units[c] for c in columns)
        self._reference, self._space, self._columns = reference, space, columns
        self.holds = isinstance(reference, Hold)
        m, nq, nv = columns.size, robot.nq, robot.nv
        places = np.column_stack([columns, coordinate_table(robot)[columns]])
        self.program = np.concatenate([[m, nq, nv], places.ravel()])
        self._parts = np.cumsum([1, nq, nv, m])
        self.use(np.zeros(1 + nq + nv + 2 * m))
        self.gain[:] = gain
        self.column: tuple[int, ...] = tuple(columns.tolist())

    def use(self, memory: Array) -> None:
        self.memory = memory
        _, self.posture, self._rate, self.gain, self.error = np.split(memory, self._parts)

    def prepare(self, rows: LevelRows) -> None:
        rows.A[np.arange(self._columns.size), self._columns] = 1.0

    def start(self, at: Configuration, t: float) -> None:
        self._course = self._reference.start(self._space, at.q, t)

    def aim(self, t: float) -> None:
        self.memory[0] = self._course(t, self.posture, self._rate)

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        self.aim(t)
        joint_rows(self.program, at.q, self.memory, rows.lower, rows.upper)


class BoundPosture(BoundJoints):
    """Joints of any kind, free-flyers and ball joints included: e = q_d ⊖ q, A = −∂e/∂q."""

    kind = None

    def __init__(self, robot: Robot, *arguments: Any) -> None:
        super().__init__(robot, *arguments)
        self._robot = robot
        self.column = (-1,) * self._columns.size

    def prepare(self, rows: LevelRows) -> None:
        pass

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        self.aim(t)
        from_q, from_target = self._robot.difference_rates(at.q, self.posture)
        self.error[:] = self._robot.difference(at.q, self.posture)[self._columns]
        rows.A[:] = -from_q[self._columns]
        feedforward = from_target[self._columns] @ self._rate if self.memory[0] else np.zeros_like(self.error)
        rows.lower[:] = task_rate(feedforward, self.gain, self.error)
        rows.upper[:] = rows.lower


@kernel
def joint_rows(program, q, memory, lower, upper):
    """Fill lower and upper of joints with one degree of freedom; their A never changes.

    `program` is m, nq, nv, and for each of the m rows its column, its kind and its place in q. `memory`
    is moving (1), target (nq), rate of the target (nv), gain (m), error (m).
    """
    m, rates = program[0], 1 + program[1]
    gain = rates + program[2]
    for i in range(m):
        column, kind, at = program[3 + 3 * i], program[4 + 3 * i], program[5 + 3 * i]
        if kind == SCALAR:
            error = memory[1 + at] - q[at]
        elif kind == CIRCLE:
            c, s, cd, sd = q[at], q[at + 1], memory[1 + at], memory[2 + at]
            error = np.arctan2(sd * c - cd * s, cd * c + sd * s)
        else:
            error = np.nan
        feedforward = memory[rates + column] if memory[0] != 0.0 else 0.0
        lower[i] = upper[i] = task_rate(feedforward, memory[gain + i], error)
        memory[gain + m + i] = error
