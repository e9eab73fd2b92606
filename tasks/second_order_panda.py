"""The Panda's hand draws a vertical circle by accelerations; these, speeds and ranges are limited.

The circle of `panda_circle.py` at second order, with 60 % of the accelerations that the maker allows. In
places they are too small: the hand leaves the circle by up to 2 cm there and comes back, while the closed
form (3.104), which knows no limits, exceeds them. The second level keeps the joints near the posture of the
start.
"""

from taskopt import Circle, FrameTask, JointAccelerationLimit, JointTask, Robot, Scenario, Stack

circle = Circle(
    radius=0.2, period=2.5, toward=(-1, 0, 0), along=(0, 0, 1), turns=2, timing="trapezoidal"
)  # [m], [s]; from rest to rest
hand = FrameTask("panda_hand", target=circle, gain=20.0)  # K [1/s]: K_P = K², K_D = 2 K
posture = JointTask(gain=4.0)

scenario = Scenario(
    robot=Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2")),
    q0=[0.3, -0.7, 0.4, -2.3, -0.8, 0.8, 0.2],
    stack=Stack(
        levels=[[hand], [posture]],
        limits=[JointAccelerationLimit([9.0, 4.5, 6.0, 7.5, 9.0, 12.0, 12.0])],  # [rad/s²]
        order=2,
    ),
    duration=5.0,
    dt=1e-3,
)
