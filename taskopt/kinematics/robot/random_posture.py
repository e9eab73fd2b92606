"""Random postures of a robot."""

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.robot.robot import Robot


def random_posture(robot: Robot, rng: np.random.Generator) -> Array:
    """Draw a posture uniformly from the position limits of a robot.

    A coordinate without limits is drawn from [−π, π] rad or m, a coordinate with only a lower limit from the
    2π above that limit, and one with only an upper limit from the π below it.

    Args:
        robot: The robot.
        rng: Source of random numbers.

    Returns:
        q (nq,) [rad, m].
    """
    q = robot.integrate(robot.posture("middle"), rng.uniform(-np.pi, np.pi, robot.nv), 1.0)
    has = robot.position_index >= 0
    lower, upper = robot.position_lower[has], robot.position_upper[has]
    lower = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper, 0.0) - np.pi)
    upper = np.where(np.isfinite(upper), upper, lower + 2.0 * np.pi)
    q[robot.position_index[has]] = lower + rng.random(len(lower)) * (np.maximum(lower, upper) - lower)
    return q
