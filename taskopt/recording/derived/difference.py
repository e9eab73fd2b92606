"""How far the postures and velocities of two arms are apart, tick by tick."""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.kinematics.robot import Robot
from taskopt.recording.derived.answers import Answers


class Difference(NamedTuple):
    """The differences at the ticks that both have.

    Attributes:
        places: Places of these ticks among those of the second, (s,).
        posture: ‖q ⊖ q of the first‖∞, (s,) [rad, m].
        velocity: ‖v − v of the first‖∞, (s,) [rad/s, m/s].
    """

    places: IntArray
    posture: Array
    velocity: Array


def differences(first: Answers, second: Answers, robot: Robot) -> Difference:
    """Compare two arms of one robot at equal times.

    Args:
        first: Ticks of the one.
        second: Ticks of the other.
        robot: The robot of both.

    Returns:
        The differences at times, to the nanosecond, at which both have a tick.
    """
    _, mine, places = np.intersect1d(first.time, second.time, return_indices=True)
    pairs = zip(first.q[mine], second.q[places], strict=True)
    posture = np.array([np.abs(robot.difference(a, b)).max() for a, b in pairs])
    velocity = np.abs(first.x[mine] - second.x[places]).max(axis=1, initial=0.0)
    return Difference(places, posture, velocity)
