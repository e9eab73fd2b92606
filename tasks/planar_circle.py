"""The tip of a planar three-link arm goes twice around a circle; on the second level the arm stays bent.

Sect. 3.7.5 of Siciliano et al., Figs. 3.17 and 3.19: Jacobian pseudo-inverse (3.72), K = 500 1/s,
and the gradient of w = ½(s₂² + s₃²) with k₀ = 50. After 4 s the tip holds its position for another second.
"""

import numpy as np

from taskopt import Circle, GradientTask, PositionTask, Scenario, Stack, UserFunction, planar_arm

bent = UserFunction(
    lambda at: 0.5 * (np.sin(at.q[1]) ** 2 + np.sin(at.q[2]) ** 2),
    derivative=lambda at: 0.5 * np.array([0.0, np.sin(2 * at.q[1]), np.sin(2 * at.q[2])]),
)
circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2)  # [m], [s]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5]),
    q0=[np.pi, -np.pi / 2, -np.pi / 2],
    stack=Stack(
        levels=[
            [PositionTask("tip", target=circle, gain=500.0, axes="xy")],
            [GradientTask(bent, gain=50.0)],
        ],
        damping=None,
    ),
    duration=5.0,
    dt=1e-3,
)
