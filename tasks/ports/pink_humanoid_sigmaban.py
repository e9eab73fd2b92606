"""A humanoid spreads its feet below a torso that stays, as in `humanoid_sigmaban.py` of pink."""

import numpy as np

from taskopt import (
    Configuration,
    FrameTask,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Robot,
    Scenario,
    Stack,
)

robot, dt = Robot.load("romeo_small"), 5e-3
K, q0 = 1.0 / dt, robot.posture("half_sitting")
at = Configuration(robot, q0)


def aside(foot: str, by: float) -> np.ndarray:
    """Return the pose of a foot at the start, moved along its own y axis [m]."""
    pose = np.array(at.pose(foot))
    pose[:3, 3] += by * pose[:3, 1]
    return pose


feet = [FrameTask(foot, target=aside(foot, by), gain=K) for foot, by in (("l_sole", 0.03), ("r_sole", -0.03))]
posture = JointTask(joints=robot.joints[1:], gain=K, weight=1e-2**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack(
        levels=[[*feet, FrameTask("torso", gain=K), posture]],
        limits=[JointPositionLimit(0.5), JointVelocityLimit()],
    ),
    duration=1.0,
    dt=dt,
)
