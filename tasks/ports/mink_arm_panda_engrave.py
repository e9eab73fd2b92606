"""A Panda leads the tip of a mill over a dome, with the mill normal to it.

This is `arm_panda_engrave.py` of mink, with a figure of eight for the letter there. The mill is normal to a
sphere where it points at its centre; the turn about it stays free.
"""

import numpy as np

from taskopt import (
    DampedTask,
    Function,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    LookAtTask,
    PositionTask,
    Robot,
    Scenario,
    Stack,
)

dt, top, radius = 5e-3, np.array([0.5, 0.0, 0.17]), 0.26  # [s], [m], [m], the highest point of the dome
centre = top - [0.0, 0.0, radius]
robot = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
robot = robot.with_frame("tip", "panda_link8", [0.0, 0.0, 0.14])


def eight(t: float) -> np.ndarray:
    """Return the desired position of the tip (3,) [m] at t [s], on the dome."""
    x, y = 0.08 * np.sin(2.0 * t), 0.08 * np.sin(t)
    return centre + [x, y, np.sqrt(radius**2 - x**2 - y**2)]


tip = DampedTask(PositionTask("tip", target=Function(eight), gain=1.0 / dt), factor=1e-2)
mill = DampedTask(LookAtTask("tip", target=centre, gain=1.0 / dt), factor=1e-3)
posture = JointTask(gain=1.0 / dt, weight=1e-2**2)

scenario = Scenario(
    robot=robot,
    q0=robot.posture("default"),
    stack=Stack([[tip, mill, posture]], [JointPositionLimit(), JointVelocityLimit()]),
    duration=7.0,
    dt=dt,
)
