"""The Panda's hand draws a vertical circle; on the second level the joints stay near mid-range.

The circle is too large and too fast for this start: on the way a joint reaches its position limit, others
their velocity limits, and most of them the accelerations that the maker allows. The closed form, which knows
no limits, goes through them; a QP leaves the circle a little instead. The second level also keeps the
manipulability of the hand high.
"""

from taskopt import (
    Circle,
    FrameTask,
    GradientTask,
    JointAccelerationLimit,
    JointRange,
    Manipulability,
    Robot,
    Scenario,
    Stack,
)

circle = Circle(
    radius=0.2, period=2.5, toward=(-1, 0, 0), along=(0, 0, 1), turns=2, timing="trapezoidal"
)  # [m], [s]; from rest to rest
hand = FrameTask("panda_hand", target=circle, gain=20.0)  # [1/s]
climb = GradientTask(5.0 * JointRange() + 1.0 * Manipulability("panda_hand"))

scenario = Scenario(
    robot=Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2")),
    q0=[0.3, -0.7, 0.4, -2.3, -0.8, 0.8, 0.2],
    stack=Stack(
        levels=[[hand], [climb]],
        limits=[JointAccelerationLimit([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])],  # [rad/s²], the maker's
    ),
    duration=5.0,
    dt=1e-3,
)
