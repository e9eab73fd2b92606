"""The tip of a SCARA manipulator follows a straight line and a turn by the transposed Jacobian.

Problem 3.22 of Siciliano et al.: both links are 0.5 m long, 1 m above the base; from (0.7, 0, 0) to (0,
0.8, 0.5) m and from 0 to π/2 rad in 2 s with a sinusoidal timing law, by Euler's method at 1 ms. The
algorithm is (3.76) with K = 300, by the resolver `transpose`.
"""

import numpy as np

from taskopt import FrameTask, Function, JointVelocityLimit, Scenario, Stack, WithoutRate, scara

bend = np.arccos((0.7**2 - 0.5) / 0.5)  # ϑ₂ at the start, elbow on the right


def pose(t: float) -> np.ndarray:
    """Return the desired pose (4, 4) [m] at t [s]."""
    s = 0.5 - 0.5 * np.cos(0.5 * np.pi * min(t, 2.0))
    phi, desired = 0.5 * np.pi * s, np.eye(4)
    desired[:2, :2] = [[np.cos(phi), -np.sin(phi)], [np.sin(phi), np.cos(phi)]]
    desired[:3, 3] = 0.7 * (1.0 - s), 0.8 * s, 0.5 * s
    return desired


def twist(t: float) -> np.ndarray:
    """Return its velocity (6,) [m/s, rad/s] at t [s]."""
    rate = (t < 2.0) * 0.25 * np.pi * np.sin(0.5 * np.pi * t)
    return rate * np.array([-0.7, 0.8, 0.5, 0.0, 0.0, 0.5 * np.pi])


hand = FrameTask(
    "tip", target=WithoutRate(Function(pose, twist)), gain=300.0, axes="xyz y", expressed="world"
)

scenario = Scenario(
    robot=scara(0.5, 0.5, height=1.0, velocity=1.5),
    q0=[-0.5 * bend, bend, -1.0, -0.5 * bend],
    stack=Stack([[hand]], limits=[JointVelocityLimit()], damping=None),
    duration=2.5,
    dt=1e-3,
)
