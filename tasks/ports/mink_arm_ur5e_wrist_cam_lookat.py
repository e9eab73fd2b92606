"""A camera on the wrist of a UR5 stays on a target that flies around.

This is `arm_ur5e_wrist_cam_lookat.py` of mink.
"""

import numpy as np

from taskopt import (
    DampedTask,
    Function,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    LookAtTask,
    Robot,
    Scenario,
    Stack,
)

dt = 5e-3
robot = Robot.load("ur5_robot").with_frame("camera", "tool0", [0.0, 0.0, 0.1])
flight = Function(
    lambda t: np.array([0.7 + 0.3 * np.cos(t), 0.6 * np.sin(t), 0.55 + 0.25 * np.sin(2.0 * t)])  # [m]
)
look = DampedTask(LookAtTask("camera", flight, axis=(0.0, 0.0, 1.0), gain=1.0 / dt), factor=1e-3)
posture = JointTask(gain=1.0 / dt, weight=1e-2**2)

scenario = Scenario(
    robot=robot,
    q0=[0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, 0.0],
    stack=Stack([[look, posture]], [JointPositionLimit(), JointVelocityLimit(velocity=np.pi)]),
    duration=7.0,
    dt=dt,
)
