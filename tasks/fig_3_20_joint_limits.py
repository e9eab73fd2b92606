"""The tip of a planar three-link arm goes twice around a circle, away from the limits of its joints.

Fig. 3.20 of Sect. 3.7.5 of Siciliano et al.: q̇ = J†(ṗ_d + K e) + (I − J†J) q̇₀ (3.72) with K = 500 1/s, and q̇₀
the gradient of the distance from the joint limits (3.57) with k₀ = 250. Joints 2 and 3 turn back before they
reach their limits, on which the arm starts.
"""

import numpy as np

from taskopt import (
    Circle,
    GradientTask,
    JointPositionLimit,
    JointRange,
    JointVelocityLimit,
    PositionTask,
    Scenario,
    Stack,
    planar_arm,
)

circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2)  # [m], [s]
lower, upper = np.array([-2.0, -0.5, -1.5]) * np.pi, np.array([2.0, 0.5, -0.5]) * np.pi  # [rad]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5], lower=lower, upper=upper, velocity=10.0),
    q0=[np.pi, -np.pi / 2, -np.pi / 2],
    stack=Stack(
        levels=[
            [PositionTask("tip", target=circle, gain=500.0, axes="xy")],
            [GradientTask(JointRange(), gain=250.0)],
        ],
        limits=[JointPositionLimit(), JointVelocityLimit()],
        damping=None,
    ),
    duration=5.0,
    dt=1e-3,
)
