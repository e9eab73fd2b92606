"""All joints of a Z1 are to move at 2 sin t rad/s, and stop where their ranges end.

This is `arm_z1_joint_velocity_tracking.py` of pink.
"""

import numpy as np

from taskopt import JointPositionLimit, JointVelocityLimit, JointVelocityTask, Robot, Scenario, Stack

robot = Robot.load("z1")
wave = JointVelocityTask(lambda t: np.full(robot.nv, 2.0 * np.sin(t)))  # [rad/s]

scenario = Scenario(
    robot=robot,
    q0=robot.neutral,
    stack=Stack([[wave]], [JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=7.0,
    dt=5e-3,
)
