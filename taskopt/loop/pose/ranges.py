"""The ranges to which the limits of a stack restrict single coordinates of a posture."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.tolerances import JOINT_RANGE
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import JointPositionLimit, Limit
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True, eq=False)
class PositionRanges:
    """Ranges of the coordinates whose rate is a velocity of the robot.

    Attributes:
        places: Indices of these coordinates in q, (k,).
        columns: Indices of their rates in v, (k,).
        lower: Lower ends, (k,) [rad, m]; −inf where there is none.
        upper: Upper ends, (k,) [rad, m]; inf where there is none.
    """

    places: IntArray
    columns: IntArray
    lower: Array
    upper: Array

    def contain(self, q: Array) -> bool:
        """Return True if a posture is inside the ranges, up to rounding.

        Args:
            q: Posture, (nq,) [rad, m].
        """
        value = q[self.places]
        return bool(((value >= self.lower - JOINT_RANGE) & (value <= self.upper + JOINT_RANGE)).all())

    def moved_inside(self, q: Array) -> Array:
        """Move a posture into the ranges.

        Args:
            q: Posture, (nq,) [rad, m].

        Returns:
            A new array, (nq,).
        """
        out = q.copy()
        out[self.places] = np.clip(out[self.places], self.lower, self.upper)
        return out


def position_ranges(limits: Iterable[Limit], robot: Robot) -> PositionRanges:
    """Return the ranges to which position limits restrict a robot, reduced by their margins.

    Args:
        limits: Limits with gain 1, of which only those of the class `JointPositionLimit` are read.
        robot: The robot.

    Returns:
        The ranges, which are infinite for coordinates without a limit.
    """
    at = Configuration(robot, robot.posture("middle"))
    bounds = np.array([[-np.inf], [np.inf], [0.0], [0.0]]).repeat(robot.nv, axis=1)
    for limit in limits:
        if isinstance(limit, JointPositionLimit):
            limit.bind(robot, 1.0).narrow(at, bounds, 0)  # from the middle, the room to either side
    columns = np.flatnonzero(robot.position_index >= 0)
    places = robot.position_index[columns]
    return PositionRanges(
        places, columns, at.q[places] + bounds[0, columns], at.q[places] + bounds[1, columns]
    )
