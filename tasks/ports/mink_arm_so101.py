"""An SO-101 draws a circle in a vertical plane while its gripper rolls to and fro.

This is `arm_so101.py` of mink.
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

robot, dt = Robot.load("so101"), 5e-3
q0 = robot.posture("middle")
start = Configuration(robot, q0).pose("gripper_frame_link")


def circle(t: float) -> np.ndarray:
    """Return the desired pose of the gripper (4, 4) [m] at t [s]."""
    pose, angle, roll = start.copy(), 0.4 * np.pi * t, np.radians(30.0) * np.cos(np.pi * t)
    pose[:3, 3] += 0.05 * np.cos(angle), 0.0, 0.05 * np.sin(angle)
    pose[:3, :3] @= [[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]]
    return pose


gripper = DampedTask(FrameTask("gripper_frame_link", target=Function(circle), gain=1.0 / dt), factor=1.0)
posture = JointTask(gain=1.0 / dt, weight=1e-2**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[gripper, posture]], [JointPositionLimit(), JointVelocityLimit()]),
    duration=5.0,
    dt=dt,
)
