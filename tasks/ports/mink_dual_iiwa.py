"""Two hands change sides while their forearms keep 10 cm from each other, as in `dual_iiwa.py` of mink."""

import numpy as np

from taskopt import (
    Configuration,
    DampingTask,
    FrameTask,
    Function,
    JointPositionLimit,
    JointVelocityLimit,
    Robot,
    Scenario,
    SelfCollisionLimit,
    Stack,
)

whole, dt = Robot.load("baxter"), 2e-2
robot = whole.lock([joint for joint in whole.joints if not joint.startswith(("left", "right"))])
q0 = robot.posture("middle")
at = Configuration(robot, q0)
outer = ("lower_forearm", "wrist", "hand_link", "gripper_base_link")
pairs = [(f"left_{one}", f"right_{other}") for one in outer for other in outer]


def across(frame: str, side: float) -> Function:
    """Return the target of a hand, which goes from its own side (left is 1, right -1) across and back."""
    start = at.pose(frame)

    def pose(t: float) -> np.ndarray:
        desired, share = start.copy(), 0.5 * (1.0 - np.cos(t))
        desired[:3, 3] = 0.7, side * (0.4 - 0.8 * share), 0.2 + 0.25 * side * np.sin(np.pi * share) ** 2
        return desired

    return Function(pose)


hands = [
    FrameTask(frame, target=across(frame, side), gain=5.0, weight=(2.0**2, 1.0))
    for frame, side in (("left_gripper", 1.0), ("right_gripper", -1.0))
]
apart = SelfCollisionLimit(margin=0.1, influence=0.2, pairs=pairs)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack(
        levels=[[*hands, DampingTask(weight=1e-2)]],
        limits=[apart, JointPositionLimit(), JointVelocityLimit()],
    ),
    duration=6.0,
    dt=dt,
)
