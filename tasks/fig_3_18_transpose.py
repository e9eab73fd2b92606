"""The tip of a planar three-link arm follows a circle by the transposed Jacobian.

Fig. 3.18 of Sect. 3.7.5 of Siciliano et al.: q̇ = Jᵀ K e (3.76) with K = 500, by the resolver `transpose`.
There is no feedforward, so the tip lags behind while the target moves, and arrives when it has stopped.
"""

import numpy as np

from taskopt import Circle, JointVelocityLimit, PositionTask, Scenario, Stack, WithoutRate, planar_arm

circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2)  # [m], [s]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5], velocity=1.0),
    q0=[np.pi, -np.pi / 2, -np.pi / 2],
    stack=Stack(
        levels=[[PositionTask("tip", target=WithoutRate(circle), gain=500.0, axes="xy")]],
        limits=[JointVelocityLimit()],
        damping=None,
    ),
    duration=5.0,
    dt=1e-3,
)
