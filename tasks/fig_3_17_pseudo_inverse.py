"""The tip of a planar three-link arm goes twice around a circle; its orientation is free.

Fig. 3.17 of Sect. 3.7.5 of Siciliano et al.: q̇ = J†(ṗ_d + K e) (3.72) with K = 500 1/s and q̇₀ = 0. The third
joint is redundant, and nothing uses it: after each circle the arm is in another posture.
"""

import numpy as np

from taskopt import Circle, JointVelocityLimit, PositionTask, Scenario, Stack, planar_arm

circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2)  # [m], [s]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5], velocity=1.0),
    q0=[np.pi, -np.pi / 2, -np.pi / 2],
    stack=Stack(
        levels=[[PositionTask("tip", target=circle, gain=500.0, axes="xy")]],
        limits=[JointVelocityLimit()],
        damping=None,
    ),
    duration=5.0,
    dt=1e-3,
)
