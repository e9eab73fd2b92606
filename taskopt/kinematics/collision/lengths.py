"""Bounds on the lengths between the joints of a robot, which hold in every posture."""

import numpy as np

from taskopt.kinematics.robot.joints import velocity_slice
from taskopt.kinematics.robot.robot import Robot


def slide_length(robot: Robot, joint: int) -> float:
    """Return a bound on the displacement of a joint's origin along the link before, over its whole range.

    Args:
        robot: The robot.
        joint: Pinocchio's index of the joint.

    Returns:
        The bound [m]: 0 for a joint that only turns, inf for one that slides without limits.
    """
    own = velocity_slice(robot.model.joints[joint])
    ends = np.maximum(np.abs(robot.position_lower[own]), np.abs(robot.position_upper[own]))
    slides = [unit == "m" for unit in robot.coordinate_units[own]]
    return float(ends[slides].sum())


def link_length(robot: Robot, joint: int) -> float:
    """Return a bound on the distance from the origin of the joint before to that of a joint.

    Args:
        robot: The robot.
        joint: Pinocchio's index of the joint.

    Returns:
        The bound [m]; inf if the joint slides without limits.
    """
    place = robot.model.jointPlacements[joint].translation
    return float(np.linalg.norm(place)) + slide_length(robot, joint)
