"""Arms of the textbook: Siciliano, Sciavicco, Villani and Oriolo, Robotics, Sect. 2.9."""

from collections.abc import Sequence

import numpy as np

from taskopt.arrays import ArrayLike, bound, finite
from taskopt.kinematics.robot.dh import DHRow
from taskopt.kinematics.robot.robot import Robot


def planar_arm(
    lengths: Sequence[float] = (0.5, 0.5, 0.5),
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Robot:
    """Arm with parallel revolute joints in the x-y plane, links of the lengths [m] given.

    Three links are Fig. 2.20 with direct kinematics (2.83): x = a₁ c₁ + a₂ c₁₂ + a₃ c₁₂₃, likewise y.
    Limits [rad], [rad/s] are a number for all joints, or one for each; none by default.
    """
    a = finite("lengths", lengths, (None,))
    n = len(a)
    own = (_one_each(name, x, n) for name, x in (("lower", lower), ("upper", upper), ("velocity", velocity)))
    rows = [
        DHRow(a_i, 0.0, 0.0, 0.0, "revolute", *limits) for a_i, *limits in zip(a.tolist(), *own, strict=True)
    ]
    return Robot.from_dh(rows, name=f"planar{n}", radius=radius)


def _one_each(name: str, value: ArrayLike, n: int) -> list[float]:
    return bound(name, np.full(n, value) if np.ndim(value) == 0 else value, (n,)).tolist()
