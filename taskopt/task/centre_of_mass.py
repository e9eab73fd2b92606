"""The task of the centre of mass."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, IntArray
from taskopt.axes import ROW_NAMES, ROW_UNITS, chosen_rows
from taskopt.configuration import Configuration
from taskopt.errors import InvalidValue
from taskopt.problem.hierarchy import LevelRows
from taskopt.reference import Hold, Reference, as_reference
from taskopt.robot import Robot
from taskopt.space import PoseSpace
from taskopt.task.rows import gains, task_rate, weights


@dataclass(frozen=True, eq=False)
class CentreOfMassTask:
    """Bring the centre of mass to c_d(t), rows [m] along the axes of the world: J_c v = ċ_d + K (c_d − c).

    J_c = Σ m_i J_i / Σ m_i, with J_i the Jacobian of the centre of mass of link i. `reference` gives
    positions (3,). `gain` K [1/s] and `weight` (factor of ½‖·‖², [s²/m²]): one number, or three; `axes`:
    the rows taken, such as "xy". Raises `InvalidValue` for a robot without mass.
    """

    reference: Any = field(default_factory=Hold)
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
        return BoundCentreOfMass(name, as_reference(self.reference), rows, gain, weight)


class BoundCentreOfMass:
    """The rows of one robot; the pose that stands for a position is the identity but for its place."""

    frame = None
    constant = False

    def __init__(self, name: str, reference: Reference, rows: IntArray, gain: Array, weight: Array) -> None:
        self.name, self.gain, self.weight = name, gain, weight
        self.row_names = tuple(ROW_NAMES[i] for i in rows)
        self.row_units = tuple(ROW_UNITS[i] for i in rows)
        self.column: tuple[int, ...] = (-1,) * len(rows)
        self.error = np.zeros(len(rows))
        self.target, self.actual, self._twist = np.eye(4), np.eye(4), np.zeros(6)
        self._rows, self._reference = rows, reference
        self._space = PoseSpace(f"target of '{name}'")

    def prepare(self, rows: LevelRows) -> None:
        pass

    def start(self, at: Configuration, t: float) -> None:
        pose = np.eye(4)
        pose[:3, 3] = at.centre_of_mass()[0]
        self._course = self._reference.start(self._space, pose, t)

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        moving = self._course(t, self.target, self._twist)
        self.actual[:3, 3], J = at.centre_of_mass()
        rows.A[:] = J[self._rows]
        self.error[:] = (self.target[:3, 3] - self.actual[:3, 3])[self._rows]
        feedforward = self._twist[self._rows] if moving else np.zeros_like(self.error)
        rows.lower[:] = task_rate(feedforward, self.gain, self.error)
        rows.upper[:] = rows.lower
