"""The tip goes twice around a circle while the joints stay away from their mechanical limits.

Sect. 3.7.5 of Siciliano et al., Fig. 3.20: the gradient of (3.57) with k₀ = 250 and the limits given there.
The gradient alone keeps the joints inside: this stack has no hard limit.
"""

import numpy as np

from taskopt import Circle, GradientTask, JointRange, PositionTask, Scenario, Stack, planar_arm

pi = np.pi
circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2)  # [m], [s]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5], lower=[-2 * pi, -pi / 2, -3 * pi / 2], upper=[2 * pi, pi / 2, -pi / 2]),
    q0=[pi, -pi / 2, -pi / 2],
    stack=Stack(
        levels=[
            [PositionTask("tip", target=circle, gain=500.0, axes="xy")],
            [GradientTask(JointRange(), gain=250.0)],
        ],
        damping=None,
    ),
    duration=5.0,
    dt=1e-3,
)
