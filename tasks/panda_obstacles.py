"""The Panda's hand goes between two balls that are closer together than it is wide.

The orientation of the hand is on the same level as the path, with a small weight, and it gives way so that
the hand can pass: no link comes nearer than 2 cm to a ball, or 1 cm to another link. The closed form, which
knows no obstacles, goes into a ball. No joint accelerates harder than its maker allows. At the end the elbow
is nearly straight, which is a singularity; damping (3.59) keeps the joints slow there.
"""

from taskopt import (
    DampingTask,
    JointAccelerationLimit,
    Line,
    ObstacleLimit,
    OrientationTask,
    PositionTask,
    Robot,
    Scenario,
    SelfCollisionLimit,
    Sphere,
    Stack,
)

balls = [
    Sphere((0.55, 0.21, 0.58), 0.1, name="left ball"),
    Sphere((0.55, -0.19, 0.58), 0.1, name="right ball"),
]
path = PositionTask("panda_hand", target=Line(by=(0.51, 0.0, -0.1), duration=3.0), gain=5.0, name="path")
hold = OrientationTask("panda_hand", gain=2.0, weight=1e-4, name="orientation")
clear = [ObstacleLimit(balls, gain=0.02), SelfCollisionLimit()]
gentle = JointAccelerationLimit([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])  # [rad/s²], the maker's

scenario = Scenario(
    robot=Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2")),
    q0=[0.0, -0.7, 0.0, -2.3, 0.0, 1.6, 0.785],
    stack=Stack(levels=[[path, hold, DampingTask(weight=1e-3)]], limits=[*clear, gentle]),
    duration=4.0,
    dt=1e-3,
)
