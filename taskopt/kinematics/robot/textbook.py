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
    """Make an arm with parallel revolute joints, which moves in the x-y plane.

    With three links: x = a₁ c₁ + a₂ c₁₂ + a₃ c₁₂₃, and y likewise with sines.

    Args:
        lengths: a (n,) [m], one for each link.
        lower: Lower position limits [rad], one number for all joints or one for each.
        upper: Upper position limits [rad], likewise.
        velocity: Velocity limits [rad/s], likewise.
        radius: Of the capsules that are the links [m]; default: 6 % of the longest link.

    Returns:
        The robot; its last frame is "tip".

    Raises:
        InvalidValue: a length is not finite, or the limits do not fit.

    Source: Fig. 2.20 and (2.83) of the textbook.
    """
    a = finite("lengths", lengths, (None,))
    n = len(a)
    own = (_one_each(name, x, n) for name, x in (("lower", lower), ("upper", upper), ("velocity", velocity)))
    rows = [
        DHRow(a_i, 0.0, 0.0, 0.0, "revolute", *limits) for a_i, *limits in zip(a.tolist(), *own, strict=True)
    ]
    return Robot.from_dh(rows, name=f"planar{n}", radius=radius)


def _one_each(name: str, value: ArrayLike, n: int) -> list[float]:
    """Return one limit for each joint, from one number for all or one for each."""
    return bound(name, np.full(n, value) if np.ndim(value) == 0 else value, (n,)).tolist()
