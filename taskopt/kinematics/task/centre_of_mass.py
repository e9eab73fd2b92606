"""The task of the centre of mass."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike, IntArray
from taskopt.jit import kernel, kernel_apart
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.part import check_mass
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS, PoseSpace, Value, chosen_rows
from taskopt.kinematics.target import Hold, Target, as_target, check_target
from taskopt.kinematics.task.aimed import AimedTask
from taskopt.kinematics.task.base import Task, gains, task_rate, weights


@dataclass(frozen=True, eq=False)
class CentreOfMassTask(Task):
    """Bring the centre of mass c to a target point c_d(t): J_c v = ċ_d + K (c_d − c).

    J_c = Σ m_i J_i / Σ m_i, with m_i the mass of link i and J_i the Jacobian of its centre of mass. Links
    that are fixed to the world do not count. Rows x, y, z [m/s] along the axes of the world.

    Args:
        target: Target point (3,) [m] in the world, or a `Target`. Default: the point at the start.
        gain: K [1/s], one number or three. More lets the error die out faster and asks for larger velocities;
            it must stay below 2/Δt.
        weight: Factor of ½ (A v − b)² within the level [s²/m²], one number or three. More lets this task win
            over others of the same level.
        axes: Rows that are taken, such as "xy", or three truth values.
        name: Name in logs and plots. Default: "centre of mass".

    Raises:
        InvalidValue: A number is out of its range; or, when bound, the robot has no mass.

    Source:
        Equation (3.67), applied to the centre of mass.
    """

    target: Target | Value = field(default_factory=Hold)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    axes: str | Sequence[bool] = field(default="xyz", kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        chosen_rows(self.axes, "xyz")
        gains(self.gain, 3)
        weights(self.weight, 3)
        check_target(self.target, PoseSpace("target of the centre of mass"))

    def bind(self, robot: Robot, name: str) -> "BoundCentreOfMass":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            InvalidValue: The robot has no mass.
        """
        check_mass(robot, name)
        rows = chosen_rows(self.axes, "xyz")
        gain, weight = gains(self.gain, 3)[rows], weights(self.weight, 3)[rows]
        bound = BoundCentreOfMass(robot, name, rows, gain, weight)
        bound.attach(as_target(self.target))
        return bound


class BoundCentreOfMass(AimedTask):
    """The rows of one robot; `desired` and `actual` are poses whose rotation is the identity.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        rows: Rows of three that are taken, (m,).
        gain: K of each row [1/s], (m,).
        weight: Weight of each row, (m,).
    """

    def __init__(self, robot: Robot, name: str, rows: IntArray, gain: Array, weight: Array) -> None:
        super().__init__(name, [ROW_NAMES[i] for i in rows], [ROW_UNITS[i] for i in rows], gain, weight)
        self._rows, self.kernel = rows, centre_of_mass_rows
        parents, bodies = robot.carried()
        head = [len(rows), len(parents)]
        self.parameters = np.concatenate([head, rows, parents, robot.column_joint]).astype(np.int64)
        self.use(np.zeros(6 * (_LINKS + 2 * len(parents))))
        self._table[_LINKS : _LINKS + len(parents), :4] = bodies
        self.gain[:] = gain
        self._table[_TARGET : _TARGET + 4, :4] = self._table[_ACTUAL : _ACTUAL + 4, :4] = np.eye(4)

    def attach(self, target: Target) -> None:
        """Set the target.

        Args:
            target: Target, in the terms of `taskopt.kinematics.target`.
        """
        self.take_target(target, PoseSpace(f"target of '{self.name}'"))

    def use(self, memory: Array) -> None:
        """Re-bind this part to a memory; see `Part.use`."""
        m, self.memory, self._table = len(self._rows), memory, memory.reshape(-1, 6)
        self.desired = self.goal = self._table[_TARGET : _TARGET + 4, :4]
        self.actual = self._table[_ACTUAL : _ACTUAL + 4, :4]
        self.gain, self.error = self._table[_GAIN, :m], self._table[_ERROR, :m]
        self._twist, self._moving = self._table[_TWIST], self._table[_MOVING]  # kept: a view costs 0.2 µs

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the target from the present centre of mass; see `RowPart.start`."""
        pose = np.eye(4)
        pose[:3, 3] = configuration.centre_of_mass()[0]
        self.begin(pose, t)

    def aim(self, t: float) -> None:
        """Write the target point at t [s], and its rate where it has one."""
        self._moving[0] = self._course(t, self.goal, self._twist)


# Rows of the table (rows, 6): two poses, then three numbers each; for each joint the mass of its body and the
# place of its centre in the joint's frame, then the same summed over all that the joint carries.
_TARGET, _ACTUAL, _TWIST, _GAIN, _ERROR, _MOVING, _LINKS = 0, 4, 8, 9, 10, 11, 12


@kernel_apart
def centre_of_mass_rows(parameters, memory, state, rows):
    """Fill the rows of the centre of mass.

    A column (v, ω) of the spatial Jacobian moves what its joint carries, of mass μ and centred at s, so that
    J_c = μ/M (v + ω × s), with M the mass of the robot.

    Args:
        parameters: Flat array of integers: m, the number of joints, the m rows chosen of three, the parent of
            each joint, and the joint of each column (nv of them).
        memory: Flat table with six columns: target and actual pose, rate, gains, errors, then the joints'
            masses.
        state: The robot, see `RobotState`.
        rows: The m rows, see `RowArrays`.
    """
    m, joints = parameters[0], parameters[1]
    J, table = state.jacobians, memory.reshape((memory.size // 6, 6))
    taken, parents, carrier = (
        parameters[2 : 2 + m],
        parameters[2 + m : 2 + m + joints],
        parameters[2 + m + joints :],
    )
    carried = table[_LINKS + joints : _LINKS + 2 * joints]
    _carried_into(state.placements, parents, table[_LINKS : _LINKS + joints], carried)
    total = carried[0, 0]
    for i in range(3):
        table[_ACTUAL + i, 3] = carried[0, 1 + i] / total
    for j in range(joints):
        for i in range(4):
            carried[j, i] *= 1.0 / total
    for k in range(carrier.size):
        j = carrier[k]
        mass, x, y, z = carried[j, 0], carried[j, 1], carried[j, 2], carried[j, 3]
        column = (
            mass * J[0, k] + J[4, k] * z - J[5, k] * y,
            mass * J[1, k] + J[5, k] * x - J[3, k] * z,
            mass * J[2, k] + J[3, k] * y - J[4, k] * x,
        )
        for r in range(m):
            rows.A[r, k] = column[taken[r]]
    for r in range(m):
        i = taken[r]
        error = table[_TARGET + i, 3] - table[_ACTUAL + i, 3]
        feedforward = table[_TWIST, i] if table[_MOVING, 0] != 0.0 else 0.0
        rows.lower[r] = rows.upper[r] = task_rate(feedforward, table[_GAIN, r], error)
        table[_ERROR, r] = error


@kernel
def _carried_into(placements, parents, body, carried):
    """Sum mass, and centre times mass, of all bodies that each joint carries, from the tips to the root.

    Args:
        placements: (joints, 12) poses of the joints, rotations by columns, see `RobotState`.
        parents: (joints,) the parent of each joint.
        body: (joints, 6) mass of each joint's body, then its centre in the joint's frame.
        carried: (joints, 6) filled with mass, and with centre in the world times mass.
    """
    for j in range(parents.size):
        place, mass = placements[j], body[j, 0]
        x, y, z = body[j, 1], body[j, 2], body[j, 3]
        carried[j, 0] = mass
        for i in range(3):  # rotations stand by columns
            centre = place[9 + i] + place[i] * x + place[3 + i] * y + place[6 + i] * z
            carried[j, 1 + i] = mass * centre
    for j in range(parents.size - 1, 0, -1):
        for i in range(4):
            carried[parents[j], i] += carried[j, i]
