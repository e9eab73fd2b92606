"""The task of the centre of mass."""

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
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS, PoseSpace, chosen_rows
from taskopt.kinematics.target import Hold, Target, as_target
from taskopt.kinematics.task.rows import gains, task_rate, weights


@dataclass(frozen=True, eq=False)
class CentreOfMassTask:
    """Bring the centre of mass to c_d(t), rows [m] along the axes of the world: J_c v = ċ_d + K (c_d − c).

    J_c = Σ m_i J_i / Σ m_i, with J_i the Jacobian of the centre of mass of link i; what is fixed to the
    world does not count. `target` gives positions (3,). `gain` K [1/s] and `weight` (factor of
    ½‖·‖², [s²/m²]): one number, or three; `axes`:
    the rows taken, such as "xy". Raises `InvalidValue` for a robot without mass.
    """

    target: Any = field(default_factory=Hold)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    axes: str | Sequence[bool] = field(default="xyz", kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        chosen_rows(self.axes, "xyz")
        gains(self.gain, 3)
        weights(self.weight, 3)

    def default_name(self) -> str:
        return "centre of mass"

    def bind(self, robot: Robot, name: str) -> "BoundCentreOfMass":
        if not robot.mass > 0.0:
            raise InvalidValue(f"'{name}' needs masses, and {robot.name} has none; give its links inertia")
        rows = chosen_rows(self.axes, "xyz")
        gain, weight = gains(self.gain, 3)[rows], weights(self.weight, 3)[rows]
        return BoundCentreOfMass(robot, name, as_target(self.target), rows, gain, weight)


class BoundCentreOfMass:
    """The rows of one robot; the pose that stands for a position is the identity but for its place."""

    kind = "centre of mass"
    frame = None
    constant = False

    def __init__(
        self, robot: Robot, name: str, reference: Target, rows: IntArray, gain: Array, weight: Array
    ) -> None:
        self.name, self.weight = name, weight
        self.row_names = tuple(ROW_NAMES[i] for i in rows)
        self.row_units = tuple(ROW_UNITS[i] for i in rows)
        self.column: tuple[int, ...] = (-1,) * len(rows)
        self._rows, self._reference = rows, reference
        self.holds = isinstance(reference, Hold)
        self._space = PoseSpace(f"target of '{name}'")
        parents, bodies = robot.carried()
        head = [len(rows), len(parents)]
        self.program = np.concatenate([head, rows, parents, robot.column_joint]).astype(np.int64)
        self.use(np.zeros((_LINKS + 2 * len(parents), 6)))
        self.memory[_LINKS : _LINKS + len(parents), :4] = bodies
        self.gain[:] = gain
        self.desired[:] = self.actual[:] = np.eye(4)

    def use(self, memory: Array) -> None:
        m, self.memory = len(self._rows), memory
        self.desired, self.actual = memory[_TARGET : _TARGET + 4, :4], memory[_ACTUAL : _ACTUAL + 4, :4]
        self.gain, self.error = memory[_GAIN, :m], memory[_ERROR, :m]

    def prepare(self, rows: LevelRows) -> None:
        pass

    def start(self, at: Configuration, t: float) -> None:
        pose = np.eye(4)
        pose[:3, 3] = at.centre_of_mass()[0]
        self._course = self._reference.start(self._space, pose, t)

    def aim(self, t: float) -> None:
        self.memory[_MOVING, 0] = self._course(t, self.desired, self.memory[_TWIST])

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        self.aim(t)
        J, placements = at.joint_jacobians, at.joint_placements
        centre_of_mass_rows(self.program, J, placements, self.memory, rows.A, rows.lower, rows.upper)


# Rows in the memory (rows, 6): two poses, then three numbers each; for each joint the mass of its body
# and where that is centred in the joint's frame, then the same summed over all that the joint carries.
_TARGET, _ACTUAL, _TWIST, _GAIN, _ERROR, _MOVING, _LINKS = 0, 4, 8, 9, 10, 11, 12


@kernel
def centre_of_mass_rows(program, J, joint_placements, memory, A, lower, upper):
    """Fill A, lower and upper (m rows) from joint Jacobians and joint poses.

    A column (v, ω) of the spatial J moves what its joint carries, of mass μ and centred at s, so that
    J_c = μ/M (v + ω × s). `program` is m, joints, the m rows, the joints' parents, and each column's joint.
    """
    m, joints = program[0], program[1]
    rows, parents, carrier = program[2 : 2 + m], program[2 + m : 2 + m + joints], program[2 + m + joints :]
    body, carried = memory[_LINKS : _LINKS + joints], memory[_LINKS + joints : _LINKS + 2 * joints]
    for j in range(joints):
        place, mass = joint_placements[j], body[j, 0]
        x, y, z = body[j, 1], body[j, 2], body[j, 3]
        carried[j, 0] = mass
        for i in range(3):  # rotations stand by columns
            centre = place[9 + i] + place[i] * x + place[3 + i] * y + place[6 + i] * z
            carried[j, 1 + i] = mass * centre
    for j in range(joints - 1, 0, -1):
        for i in range(4):
            carried[parents[j], i] += carried[j, i]
    total = carried[0, 0]
    for i in range(3):
        memory[_ACTUAL + i, 3] = carried[0, 1 + i] / total
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
            A[r, k] = column[rows[r]]
    for r in range(m):
        i = rows[r]
        error = memory[_TARGET + i, 3] - memory[_ACTUAL + i, 3]
        feedforward = memory[_TWIST, i] if memory[_MOVING, 0] != 0.0 else 0.0
        lower[r] = upper[r] = task_rate(feedforward, memory[_GAIN, r], error)
        memory[_ERROR, r] = error
