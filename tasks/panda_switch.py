"""The Panda changes its tasks while it moves: they come, go and change places without a jump.

The hand draws a circle. From 1.5 s to 4 s its orientation is held as well, on a level above the circle; at
3 s a point takes the place of the circle. Each change takes 0.3 s, during which every tick is one strict
hierarchy, as before and after, and no joint accelerates harder than its maker allows.
"""

from taskopt import (
    Circle,
    During,
    JointAccelerationLimit,
    JointTask,
    OrientationTask,
    PositionTask,
    Robot,
    Scenario,
    Stack,
)

hand = "panda_hand"
circle = Circle(radius=0.1, period=2.5, turns=2, timing="trapezoidal")  # [m], [s], from rest to rest
draw = PositionTask(hand, name="circle", target=circle, gain=10.0)  # [1/s]
visit = PositionTask(hand, name="point", target=(0.5, 0.2, 0.5), gain=3.0)  # [m]
upright = OrientationTask(hand, name="upright", gain=10.0)

scenario = Scenario(
    robot=Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2")),
    q0=[0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785],
    stack=Stack(
        levels=[
            [During(upright, begin=1.5, end=4.0, blend=0.3)],
            [During(draw, end=3.0, blend=0.3), During(visit, begin=3.0, blend=0.3)],
            [JointTask()],
        ],
        limits=[JointAccelerationLimit([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])],  # [rad/s²], the maker's
    ),
    duration=5.0,
    dt=2e-3,
)
