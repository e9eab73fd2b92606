"""A humanoid whose knees are coupled waves its right hand, as in `humanoid_draco3.py` of pink.

Draco couples the two joints of each knee; TALOS has one joint a knee, and its two knees are coupled here.
"""

import numpy as np

from taskopt import (
    Configuration,
    FrameTask,
    Function,
    JointCouplingTask,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    PositionTask,
    Robot,
    Scenario,
    Stack,
)

robot, dt, hand = Robot.load("talos_reduced"), 5e-3, "gripper_right_base_link"
K, q0 = 1.0 / dt, robot.posture("half_sitting")
at = Configuration(robot, q0)


def wave(t: float) -> np.ndarray:
    """Return the desired pose of the hand (4, 4) [m] at t [s]."""
    pose = np.array(at.pose(hand))
    pose[:3, 3] += 0.2, 0.1 + 0.05 * np.sin(8.0 * t), 0.3
    return pose


def moved(frame: str, by: float) -> np.ndarray:
    """Return the pose of a frame at the start, moved along its own x axis [m]."""
    pose = np.array(at.pose(frame))
    pose[:3, 3] += by * pose[:3, 0]
    return pose


wrist = FrameTask(hand, target=Function(wave), gain=K, weight=4.0**2)
knees = JointCouplingTask({"leg_left_4_joint": 1.0, "leg_right_4_joint": -1.0}, gain=K, weight=100.0**2)
left = FrameTask("left_sole_link", target=moved("left_sole_link", 0.1), gain=K)
right = FrameTask("right_sole_link", target=moved("right_sole_link", -0.1), gain=K)
torso = PositionTask("torso_2_link", gain=K)
posture = JointTask(joints=robot.joints[1:], gain=K, weight=0.1**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack(
        levels=[[wrist, knees, left, right, torso, posture]],
        limits=[JointPositionLimit(0.5), JointVelocityLimit()],
    ),
    duration=4.0,
    dt=dt,
)
