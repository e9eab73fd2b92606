"""The tip goes around its circle with little motion of the first joint, which carries the whole arm.

A weighted norm (3.50): q̇ᵀ W q̇ with W = diag(20, 1, 1) makes a motion of the first joint cost twenty
times as much as one of the others. With W = I the scenario is `minimum_norm`.
"""

import numpy as np

from taskopt import Circle, PositionTask, Scenario, Stack, planar_arm

circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2)  # [m], [s]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5]),
    q0=[np.pi, -np.pi / 2, -np.pi / 2],
    stack=Stack(
        levels=[[PositionTask("tip", target=circle, gain=500.0, axes="xy")]],
        norm=[20.0, 1.0, 1.0],
        damping=None,
    ),
    duration=4.0,
    dt=1e-3,
)
