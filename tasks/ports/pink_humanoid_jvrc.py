"""A humanoid stands on two feet and waves its right hand, as in `humanoid_jvrc.py` of pink."""

import numpy as np

from taskopt import (
    Configuration,
    FrameTask,
    Function,
    JointPositionLimit,
    JointVelocityLimit,
    PositionTask,
    Robot,
    Scenario,
    Stack,
)

robot, dt = Robot.load("simple_humanoid"), 5e-3
K, apart = 1.0 / dt, np.zeros(robot.nv)
for shoulder in ("LARM_SHOULDER_R", "RARM_SHOULDER_R"):  # their ranges begin above zero
    apart[robot.velocity_index(shoulder)] = 0.1  # [rad]
q0 = robot.integrate(robot.neutral, apart, 1.0)
at = Configuration(robot, q0)
turned = np.array(at.pose("r_wrist"))
turned[:3, :3] @= [[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]  # half a turn


def wave(t: float) -> np.ndarray:
    """Return the desired pose of the wrist (4, 4) [m] at t [s]."""
    pose = turned.copy()
    pose[:3, 3] += 0.5, -0.1 + 0.05 * np.sin(8.0 * t), 0.5
    return pose


def moved(frame: str, by: float) -> np.ndarray:
    """Return the pose of a frame at the start, moved along its own x axis [m]."""
    pose = np.array(at.pose(frame))
    pose[:3, 3] += by * pose[:3, 0]
    return pose


weight = (1.0, 3.0**2)
wrist = FrameTask("r_wrist", target=Function(wave), gain=K, weight=weight)
left = FrameTask("l_ankle", target=moved("l_ankle", 0.1), gain=K, weight=weight)
right = FrameTask("r_ankle", target=moved("r_ankle", -0.1), gain=K, weight=weight)
pelvis = PositionTask("base_link", gain=K)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[wrist, left, right, pelvis]], [JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=4.0,
    dt=dt,
)
