"""The task of standing still, whose rows are also the base of those of `GradientTask`."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import ArrayLike
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.parameter import Parameter
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import BoundTask, Task, rate_units, weights


@dataclass(frozen=True, eq=False)
class DampingTask(Task):
    """Stand still: v = 0, one row for each velocity [rad/s, m/s].

    On a level below other tasks it stops the motion that they leave free. On the level of a task of weight 1
    it adds `weight` to the diagonal of JᵀJ, as k² in (3.59). It has a row for every joint, so that levels
    below it have no freedom left; where there are such levels, use `LevelDamping`, which damps only the
    directions that its own level decides.

    Args:
        weight: Factor of ½ v² within the level, one number for all velocities or one for each (nv,). More
            keeps velocities smaller near singularities, and lets the other tasks of the level lag farther
            behind.
        name: Name in logs and plots. Default: "damping".

    Raises:
        InvalidValue: When the task is bound to a robot: a weight is negative or not finite, all are 0, or
            their number does not fit.

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
        weight: Factor of ½ v², one number for all velocities or one for each (nv,); a velocity of weight 0
            has no row.
    """

    constant = True

    def __init__(self, robot: Robot, name: str, weight: ArrayLike) -> None:
        every = weights(weight, robot.nv)
        self._columns = columns = np.flatnonzero(every)
        names = [robot.velocity_names[c] for c in columns]
        units = rate_units(robot.coordinate_units[c] for c in columns)
        super().__init__(name, names, units, 0.0, every[columns], columns.tolist())  # no error dies out here

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return no gain, since no error dies out here; see `Part.adjustable`."""
        return {}

    def prepare(self, rows: LevelRows) -> None:
        """Write the unit vectors; the bounds stay zero. See `RowPart.prepare`."""
        rows.A[np.arange(self._columns.size), self._columns] = 1.0
