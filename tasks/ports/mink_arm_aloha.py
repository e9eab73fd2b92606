"""Two arms work above a table and keep 5 cm from it and from each other, as in `arm_aloha.py` of mink."""

from taskopt import (
    Box,
    DampedTask,
    FrameTask,
    JointPositionLimit,
    JointVelocityLimit,
    Line,
    ObstacleLimit,
    Robot,
    Scenario,
    SelfCollisionLimit,
    Stack,
)

whole, dt = Robot.load("baxter"), 5e-3
robot = whole.lock([joint for joint in whole.joints if not joint.startswith(("left", "right"))])
hands, below = ["left_gripper_base_link", "right_gripper_base_link"], -0.35
table = Box((0.8, 0.0, below), (1.0, 2.4, 0.04), name="table")  # centre and size [m]

grippers = [
    DampedTask(
        FrameTask(f"{side}_gripper", target=Line(by=(0.0, y, -0.4), duration=2.0), gain=20.0), factor=1.0
    )
    for side, y in (("left", -0.85), ("right", 0.85))
]
clear = [
    SelfCollisionLimit(margin=0.05, influence=0.1, pairs=[(hands[0], hands[1])]),
    ObstacleLimit(table, margin=0.05, influence=0.1, links=hands),
]

scenario = Scenario(
    robot=robot,
    q0=robot.posture("middle"),
    stack=Stack([grippers], [*clear, JointPositionLimit(), JointVelocityLimit()]),
    duration=3.0,
    dt=dt,
)
