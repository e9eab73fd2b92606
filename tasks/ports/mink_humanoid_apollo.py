"""A humanoid stands with its hands still and follows a target with its eyes.

This is `humanoid_apollo.py` of mink.
"""

import numpy as np

from taskopt import (
    CentreOfMassTask,
    Configuration,
    DampedTask,
    DampingTask,
    FrameTask,
    Function,
    JointPositionLimit,
    JointTask,
    LookAtTask,
    OrientationTask,
    Robot,
    Scenario,
    Stack,
)

robot, dt, eye = Robot.load("talos_reduced"), 5e-3, "rgbd_optical_frame"
K, q0 = 1.0 / dt, robot.posture("half_sitting")
face = Configuration(robot, q0).pose(eye)[:3, 3]
w = 2.0 * np.pi / 8.0  # [rad/s]

flight = Function(lambda t: face + [1.0, 1.1 * np.sin(w * t), 0.45 * np.sin(2.0 * w * t)])  # [m]
gaze = DampedTask(LookAtTask(eye, flight, gain=K), factor=1.0)
held = [
    DampedTask(FrameTask(frame, gain=K, weight=(position**2, 1.0)), factor=1.0)
    for frame, position in {
        "left_sole_link": 100.0,
        "right_sole_link": 100.0,
        "gripper_left_base_link": 5.0,
        "gripper_right_base_link": 5.0,
    }.items()
]
pelvis = DampedTask(OrientationTask("base_link", gain=K), factor=1.0)
centre = CentreOfMassTask(gain=K, weight=10.0**2)
posture = JointTask(joints=robot.joints[1:], gain=K, weight=0.1**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack(
        levels=[[gaze, *held, pelvis, centre, posture, DampingTask(weight=0.1)]],
        limits=[JointPositionLimit()],
    ),
    duration=8.0,
    dt=dt,
)
