"""Standing still as a task, and the base of tasks that ask for a joint velocity outright."""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import ArrayLike
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import BoundTask, Task, rate_units, weights


@dataclass(frozen=True, eq=False)
class DampingTask(Task):
    """Stand still: v = 0, one row for each velocity [rad/s, m/s].

    Below or beside other tasks it damps what they leave. Beside a task of weight 1 it adds `weight` to the
    diagonal of JᵀJ, as k² in (3.59). It asks for every joint, so that nothing is left for levels below; above
    other levels take `LevelDamping`, which damps what its level decides and no more.

    Args:
        weight: Factor of ½ v² within the level, one number or one for each velocity. More keeps velocities
            smaller near singularities, and lets the other tasks of the level lag farther behind.
        name: Name in logs and plots. Default: "damping".

    Raises:
        InvalidValue: A weight is out of its range; when bound.

    Source:
        Equation (3.59).
    """

    weight: ArrayLike = 1.0
    name: str | None = field(default=None, kw_only=True)

    def bind(self, robot: Robot, name: str) -> "BoundVelocity":
        """Return the rows for a robot; see `Task.bind`."""
        return BoundVelocity(robot, name, self.weight)


class BoundVelocity(BoundTask):
    """Rows v = 0 for every velocity with a weight; they never change.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        weight: Factor of ½ v², one number or one for each velocity; rows of weight 0 are left out.
    """

    constant = True

    def __init__(self, robot: Robot, name: str, weight: ArrayLike) -> None:
        every = weights(weight, robot.nv)
        self._columns = columns = np.flatnonzero(every)
        names = [robot.velocity_names[c] for c in columns]
        units = rate_units(robot.coordinate_units[c] for c in columns)
        super().__init__(name, names, units, 0.0, every[columns], columns.tolist())  # no error dies out here

    def prepare(self, rows: LevelRows) -> None:
        """Write the unit vectors; the bounds stay zero. See `RowPart.prepare`."""
        rows.A[np.arange(self._columns.size), self._columns] = 1.0
