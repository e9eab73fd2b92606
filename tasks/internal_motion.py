"""The Panda's elbow swings from side to side while its hand does not move at all.

Internal motion: with v = 0, (3.54) is q̇ = (I − J†J) q̇₀. The velocity q̇₀ moves the first joint along a
sine, and the projector leaves the part of it that does not move the hand. The arm starts at rest, and catches
up with the sine as fast as the accelerations that its maker allows.
"""

import numpy as np

from taskopt import (
    FrameTask,
    Function,
    JointAccelerationLimit,
    JointTask,
    Robot,
    Scenario,
    Stack,
)

swing = Function(
    lambda t: {"panda_joint1": 0.7 * np.sin(0.5 * np.pi * t)},  # [rad]
    derivative=lambda t: {"panda_joint1": 0.35 * np.pi * np.cos(0.5 * np.pi * t)},
)
hand = FrameTask("panda_hand", gain=50.0)  # [1/s], holds the pose of the start
elbow = JointTask(swing, joints=("panda_joint1",), gain=5.0)

scenario = Scenario(
    robot=Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2")),
    q0=[0.0, -0.4, 0.0, -2.2, 0.0, 1.8, 0.8],
    stack=Stack(
        levels=[[hand], [elbow]],
        limits=[JointAccelerationLimit([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])],  # [rad/s²], the maker's
        damping=None,
    ),
    trails=["panda_link4"],  # the elbow
    duration=8.0,
    dt=1e-3,
)
