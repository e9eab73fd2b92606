"""Two hands are led together and keep 25 cm between points ahead of their wrists.

This is `barriers/yumi_self_collision.py` of pink.
"""

import numpy as np

from taskopt import (
    Configuration,
    FrameDistanceLimit,
    FrameTask,
    Function,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Robot,
    Scenario,
    Stack,
)

whole, dt = Robot.load("baxter"), 5e-3
robot = whole.lock([joint for joint in whole.joints if not joint.startswith(("left", "right"))])
for side in ("left", "right"):
    robot = robot.with_frame(f"{side}_centre", f"{side}_wrist", [0.0, 0.0, 0.05])
q0 = robot.posture("middle")
at = Configuration(robot, q0)


def together(frame: str, side: float) -> Function:
    """Return the target of a hand, which swings across the middle of the robot."""
    start = at.pose(frame)

    def pose(t: float) -> np.ndarray:
        desired = start.copy()
        desired[:3, 3] = 0.7, side * (0.1 + 0.1 * np.sin(t)), 0.2 + 0.1 * np.sin(t)
        return desired

    return Function(pose)


hands = [
    FrameTask(frame, target=together(frame, side), gain=1.0 / dt, weight=(50.0**2, 10.0**2))
    for frame, side in (("left_wrist", 1.0), ("right_wrist", -1.0))
]
posture = JointTask(gain=1.0 / dt, weight=1e-3**2)
apart = FrameDistanceLimit("left_centre", "right_centre", lower=0.25)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[*hands, posture]], [apart, JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=7.0,
    dt=dt,
)
