"""The tip of a planar three-link arm goes twice around a circle and turns, without looking at its error.

Fig. 3.15 of Sect. 3.7.5 of Siciliano et al.: q̇ = J⁻¹ ẋ_d (3.47), integrated by Euler's method at 1 ms. What
the integration leaves undone adds up: the tip drifts off the circle, and the error stays when the motion has
ended.
"""

import numpy as np

from taskopt import FrameTask, Function, JointVelocityLimit, Scenario, Stack, planar_arm


def pose(t: float) -> np.ndarray:
    """Return the desired pose (4, 4) [m] at t [s]: two circles and a turn of 0.5 rad in 4 s, then at rest."""
    t = min(t, 4.0)
    phi = np.sin(np.pi / 24.0 * t)
    desired = np.eye(4)
    desired[:2, :2] = [[np.cos(phi), -np.sin(phi)], [np.sin(phi), np.cos(phi)]]
    desired[:2, 3] = 0.25 * (1.0 - np.cos(np.pi * t)), 0.25 * (2.0 + np.sin(np.pi * t))
    return desired


def twist(t: float) -> np.ndarray:
    """Return its velocity (6,) [m/s, rad/s] at t [s]."""
    x, y = 0.25 * np.pi * np.sin(np.pi * t), 0.25 * np.pi * np.cos(np.pi * t)
    return (t < 4.0) * np.array([x, y, 0.0, 0.0, 0.0, np.pi / 24.0 * np.cos(np.pi / 24.0 * t)])


scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5], velocity=6.0),
    q0=[np.pi, -np.pi / 2, -np.pi / 2],
    stack=Stack(
        levels=[[FrameTask("tip", target=Function(pose, twist), gain=0.0, axes="xy y", expressed="world")]],
        limits=[JointVelocityLimit()],
        damping=None,
    ),
    duration=5.0,
    dt=1e-3,
)
