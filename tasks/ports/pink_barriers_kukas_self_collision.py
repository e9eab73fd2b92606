"""Two hands change sides and go around each other, as in `barriers/kukas_self_collision.py` of pink."""

import numpy as np

from taskopt import (
    Configuration,
    FrameTask,
    Function,
    JointPositionLimit,
    JointTask,
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
left, right = np.array([0.7, 0.4, 0.2]), np.array([0.7, -0.4, 0.2])  # [m]


def across(frame: str, here: np.ndarray, there: np.ndarray, up: float) -> Function:
    """Return the target of a hand, which goes to the other side and back, `up` higher in the middle [m]."""
    start = at.pose(frame)

    def pose(t: float) -> np.ndarray:
        desired, share = start.copy(), 0.5 * (1.0 - np.cos(t))
        desired[:3, 3] = here + share * (there - here)
        desired[2, 3] += up * np.sin(np.pi * share) ** 2
        return desired

    return Function(pose)


hands = [
    FrameTask(frame, target=target, gain=5.0, weight=(50.0**2, 10.0**2))
    for frame, target in (
        ("left_gripper", across("left_gripper", left, right, 0.2)),
        ("right_gripper", across("right_gripper", right, left, -0.1)),
    )
]
posture = JointTask(gain=5.0, weight=1e-3**2)
apart = SelfCollisionLimit(margin=0.05, influence=0.15)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[*hands, posture]], [apart, JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=6.0,
    dt=dt,
)
