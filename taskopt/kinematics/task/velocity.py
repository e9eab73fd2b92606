"""Standing still, as a task; and what every task has in common that asks for a joint velocity outright."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.rows import rate_units, weights


@dataclass(frozen=True, eq=False)
class DampingTask:
    """Stand still: v = 0, one row a velocity; below or beside other tasks, it damps what they leave.

    `weight` is the factor of ½‖v‖², one number or one a velocity. Beside a task of weight 1 it adds
    `weight` to the diagonal of JᵀJ, as k² in (3.59). It asks for every joint, so that nothing is left for
    levels below: above others take `LevelDamping`, which damps what its level decides and no more.
    """

    weight: ArrayLike = 1.0
    name: str | None = field(default=None, kw_only=True)

    def default_name(self) -> str:
        return "damping"

    def bind(self, robot: Robot, name: str) -> "BoundVelocity":
        return BoundVelocity(robot, name, self.weight)


class BoundVelocity:
    """Rows v = 0 for every velocity with a weight; written once."""

    frame = desired = actual = None
    constant = True

    def __init__(self, robot: Robot, name: str, weight: ArrayLike) -> None:
        every = weights(weight, robot.nv)
        self.name = name
        self._columns = np.flatnonzero(every)
        self.weight: Array = every[self._columns]
        self.row_names = tuple(robot.velocity_names[c] for c in self._columns)
        self.row_units = rate_units(robot.coordinate_units[c] for c in self._columns)
        self.column = tuple(self._columns.tolist())
        self.gain = np.zeros_like(self.weight)  # nothing here dies out at a rate of its own
        self.error = np.zeros_like(self.weight)

    def prepare(self, rows: LevelRows) -> None:
        rows.A[np.arange(self._columns.size), self._columns] = 1.0

    def start(self, at: Configuration, t: float) -> None:
        pass

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002 (protocol)
        rows.lower[:] = rows.upper[:] = 0.0
