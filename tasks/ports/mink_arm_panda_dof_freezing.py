"""A Panda's hand swings around the base, with three joints frozen at first and free later.

This is `arm_panda_dof_freezing.py` of mink.
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
    JointVelocityTask,
    Robot,
    Scenario,
    Stack,
)

robot, dt = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2")), 5e-3
q0 = robot.posture("default")
start = Configuration(robot, q0).pose("panda_hand")
radius, angle = np.hypot(*start[:2, 3]), np.arctan2(start[1, 3], start[0, 3])


def around(t: float) -> np.ndarray:
    """Return the desired pose of the hand (4, 4) [m] at t [s], which swings by 60° and back in 5 s."""
    pose, turned = start.copy(), angle - np.pi / 3.0 * abs(np.sin(0.2 * np.pi * t))
    pose[:2, 3] = radius * np.cos(turned), radius * np.sin(turned)
    return pose


frozen = During(JointVelocityTask({f"panda_joint{i}": 0.0 for i in (1, 2, 3)}), end=5.0)
hand = DampedTask(FrameTask("panda_hand", target=Function(around), gain=1.0 / dt), factor=1.0)
posture = JointTask(gain=1.0 / dt, weight=0.1**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[frozen], [hand, posture]], [JointPositionLimit(), JointVelocityLimit()]),
    duration=10.0,
    dt=dt,
)
