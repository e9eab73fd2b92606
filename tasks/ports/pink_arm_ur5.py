"""A UR5 holds its flange on a target that swings sideways, as in `arm_ur5.py` of pink.

The posture of the start has a thousandth of the cost of the hand, and damping slows the way to the target.
"""

import numpy as np

from taskopt import (
    Configuration,
    DampedTask,
    FrameTask,
    Function,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Robot,
    Scenario,
    Stack,
)

robot, dt = Robot.load("ur5_robot"), 5e-3
q0 = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
start = Configuration(robot, q0).pose("ee_link")


def swing(t: float) -> np.ndarray:
    """Return the desired pose of the flange (4, 4) [m] at t [s]."""
    pose = start.copy()
    pose[1:3, 3] = 0.5 + 0.1 * np.sin(2.0 * t), 0.2
    return pose


hand = DampedTask(FrameTask("ee_link", target=Function(swing), gain=1.0 / dt), factor=1.0)
posture = JointTask(gain=1.0 / dt, weight=1e-3**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[hand, posture]], [JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=5.0,
    dt=dt,
)
