"""A UR3 follows its target with a posture task, then with low accelerations.

This is `arm_ur3_velocity_smoothing.py` of pink. The two tasks change places at half time within a quarter of
a second, where the example there switches.
"""

import numpy as np

from taskopt import (
    Configuration,
    DampedTask,
    During,
    FrameTask,
    Function,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    LowAccelerationTask,
    Robot,
    Scenario,
    Stack,
)

robot, dt, half = Robot.load("ur3_robot"), 5e-3, 7.5
q0 = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
start = Configuration(robot, q0).pose("ee_link")


def swing(t: float) -> np.ndarray:
    """Return the desired pose of the flange (4, 4) [m] at t [s]."""
    pose = start.copy()
    pose[1:3, 3] = 0.5 + 0.1 * np.sin(2.0 * t), 0.2
    return pose


hand = DampedTask(FrameTask("ee_link", target=Function(swing), gain=1.0 / dt), factor=1.0)
posture = During(JointTask(gain=1.0 / dt, weight=1e-3**2), end=half)
smooth = During(LowAccelerationTask(weight=0.1**2), begin=half)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[hand, posture, smooth]], [JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=2.0 * half,
    dt=dt,
)
