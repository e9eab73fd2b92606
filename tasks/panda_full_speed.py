"""All joints of the Panda are sent far beyond their ranges, and back, as fast as they can move.

They accelerate, move at their velocity limits, and stop at the ends of their ranges with the acceleration
that is allowed. The bounds are exact for steps of this length, and they are never empty.
"""

from taskopt import Function, JointAccelerationLimit, JointTask, Robot, Scenario, Stack

to_and_fro = Function(lambda t: [9.0, -9.0, 9.0, -9.0, 9.0, -9.0, 9.0] if t < 2.0 else [0.0] * 7)  # [rad]

scenario = Scenario(
    robot=Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2")),
    q0=[0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785],
    stack=Stack(
        levels=[[JointTask(to_and_fro, gain=100.0)]],  # [1/s]
        limits=[JointAccelerationLimit([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])],  # [rad/s²], the maker's
    ),
    duration=4.0,
    dt=2e-3,
)
