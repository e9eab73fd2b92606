"""A stretched arm is pulled sideways, which it can follow, and then towards its base, which it cannot.

Sect. 3.5.2: at a singularity the velocity of the tip may or may not be in the range of J. Sideways it is, and
J†v moves the tip as asked. Towards the base it is not: J†v is the best in the sense of least squares, which
is standstill, however large the error becomes. The second joint is held on the level below, because the
minimum norm alone would bend it. Near a singularity the exact answer is huge; damping or limits are needed.
"""

import numpy as np

from taskopt import Function, JointTask, PositionTask, Scenario, Stack, planar_arm


def target(t: float) -> np.ndarray:
    """Along the arc that a stretched arm can reach, for a second and a half; then inwards [m]."""
    angle = 0.4 * min(t, 1.5) - 0.3
    return (1.0 - 0.2 * max(t - 1.5, 0.0)) * np.array([np.cos(angle), np.sin(angle), 0.0])


def rate(t: float) -> np.ndarray:
    """Its derivative [m/s]."""
    angle = 0.4 * min(t, 1.5) - 0.3
    across = [-0.4 * np.sin(angle), 0.4 * np.cos(angle), 0.0]
    return np.array(across if t < 1.5 else [-0.2 * np.cos(angle), -0.2 * np.sin(angle), 0.0])


tip = PositionTask("tip", target=Function(target, derivative=rate), gain=10.0, axes="xy")

scenario = Scenario(
    robot=planar_arm([0.5, 0.5]),
    q0=[-0.3, 0.0],
    stack=Stack(levels=[[tip], [JointTask(joints=("joint2",))]], damping=None),
    duration=2.5,
    dt=1e-3,
)
