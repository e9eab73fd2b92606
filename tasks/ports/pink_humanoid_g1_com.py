"""A G1 squats by a target for its centre of mass, on fixed feet, as in `humanoid_g1_com.py` of pink."""

import numpy as np

from taskopt import (
    CentreOfMassTask,
    Configuration,
    DampingTask,
    FrameTask,
    Function,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    OrientationTask,
    PositionTask,
    Robot,
    Scenario,
    Stack,
)

robot, dt = Robot.load("g1_29dof_rev_1_0"), 5e-3
K = 1.0 / dt
q0 = robot.neutral.copy()
q0[2] = 0.72
at = Configuration(robot, q0)


def squat(t: float) -> np.ndarray:
    """Return the desired centre of mass (3,) [m] at t [s]."""
    return np.array([0.0, 0.0, 0.55 + 0.05 * np.sin(np.pi * t)])


feet = [
    FrameTask(f"{side}_ankle_roll_link", gain=K, weight=(200.0**2, 10.0**2)) for side in ("left", "right")
]
hands = [
    PositionTask(hand, target=at.pose(hand)[:3, 3] - [0.1, 0.0, 0.2], gain=K, weight=4.0**2)
    for hand in ("left_rubber_hand", "right_rubber_hand")
]
pelvis = OrientationTask("pelvis", gain=K, weight=10.0**2)
centre = CentreOfMassTask(Function(squat), gain=K, weight=200.0**2)
posture = JointTask(joints=robot.joints[1:], gain=K, weight=0.1**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack(
        levels=[[centre, *feet, pelvis, *hands, posture, DampingTask(weight=0.01)]],
        limits=[JointPositionLimit(0.5), JointVelocityLimit()],
    ),
    duration=4.0,
    dt=dt,
)
