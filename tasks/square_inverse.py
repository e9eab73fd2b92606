"""A Panda with one locked joint has as many joints as its hand has directions, so nothing is left to choose.

The inverse of a square Jacobian, q̇ = J⁻¹ v (3.47), draws a circle. A norm and lower levels would change
nothing, nor do limits that are not active; the QP gives the answer of the formula.
"""

from taskopt import Circle, FrameTask, JointAccelerationLimit, Robot, Scenario, Stack

circle = Circle(radius=0.1, period=5.0, turns=1, timing="trapezoidal")  # [m], [s], from rest to rest
held = ("panda_joint3", "panda_finger_joint1", "panda_finger_joint2")

scenario = Scenario(
    robot=Robot.load("panda", lock=held),
    q0=[0.3, -0.4, -2.2, 0.0, 1.8, 0.8],
    stack=Stack(
        levels=[[FrameTask("panda_hand", target=circle, gain=20.0)]],  # [1/s]
        limits=[JointAccelerationLimit([15.0, 7.5, 12.5, 15.0, 20.0, 20.0])],  # [rad/s²], the maker's
        damping=None,
    ),
    duration=5.0,
    dt=1e-3,
)
