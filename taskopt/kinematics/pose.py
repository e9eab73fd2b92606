"""Rigid-body poses as (4, 4) homogeneous arrays: logarithm, exponential, and their derivatives.

Twists and logarithms have the linear part [m] first, then the angular part [rad], and are expressed
in the moving (body) frame: T exp6(ξ) moves T along its own axes. Functions here return new arrays;
`taskopt.kinematics.lie` has the kernels behind them, for loops that must not allocate.

Source: Solà, Deray and Atchuthan (2018), arXiv:1812.01537, appendices B (SO(3)) and D (SE(3)).
"""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import LAST_ROW, ROTATION
from taskopt.jit import kernel
from taskopt.kinematics.lie import (
    exp3_into,
    exp6_into,
    jlog3_into,
    jlog6_into,
    log3_into,
    log6_into,
    relative_into,
)


def log3(R: Array) -> Array:
    """Compute the rotation vector ω of a rotation matrix, R = exp3(ω).

    Args:
        R: (3, 3) rotation matrix. A pose (4, 4) works as well; its upper left part is used.

    Returns:
        ω (3,) [rad], with ‖ω‖ in [0, π].

    Source:
        Solà et al. (2018), appendix B, logarithm of SO(3).
    """
    out = np.empty(3)
    log3_into(R, out)
    return out


def jlog3(R: Array) -> Array:
    """Compute the inverse of the right Jacobian of SO(3): log3(R exp3(δ)) ≈ log3(R) + jlog3(R) δ.

    Args:
        R: (3, 3) rotation matrix.

    Returns:
        (3, 3) matrix, which maps a body rotation δ [rad] to the change of the logarithm [rad].

    Source:
        Solà et al. (2018), appendix B, inverse of the right Jacobian.
    """
    out = np.empty((3, 3))
    jlog3_into(R, out)
    return out


def exp3(omega: Array) -> Array:
    """Compute the rotation matrix of a rotation vector (Rodrigues' formula).

    Args:
        omega: (3,) [rad], axis times angle.

    Returns:
        (3, 3) rotation matrix.

    Source:
        Solà et al. (2018), appendix B, exponential of SO(3).
    """
    out = np.empty((3, 3))
    exp3_into(omega, out)
    return out


def log6(T: Array) -> Array:
    """Compute the body twist ξ that leads from the identity to a pose in unit time, T = exp6(ξ).

    Args:
        T: (4, 4) pose, translation in [m].

    Returns:
        ξ (6,), linear [m] then angular [rad], in the body frame.

    Source:
        Solà et al. (2018), appendix D, logarithm of SE(3).
    """
    out = np.empty(6)
    log6_into(T, out)
    return out


def jlog6(T: Array) -> Array:
    """Compute the inverse of the right Jacobian of SE(3): log6(T exp6(δ)) ≈ log6(T) + jlog6(T) δ.

    Args:
        T: (4, 4) pose, translation in [m].

    Returns:
        (6, 6) matrix, which maps a body twist δ (linear [m], angular [rad]) to the change of the logarithm.

    Source:
        Solà et al. (2018), appendix D, inverse of the right Jacobian.
    """
    out = np.empty((6, 6))
    jlog6_into(T, out)
    return out


def exp6(twist: Array) -> Array:
    """Compute the pose that a constant body twist reaches from the identity in unit time.

    Args:
        twist: ξ (6,), linear [m] then angular [rad], in the body frame.

    Returns:
        (4, 4) pose, translation in [m]. For rotations below π, log6 leads back to the twist.

    Source:
        Solà et al. (2018), appendix D, exponential of SE(3).
    """
    out = np.empty((4, 4))
    exp6_into(twist, out)
    return out


def inverse(T: Array) -> Array:
    """Invert a pose: T⁻¹ = [Rᵀ, −Rᵀp; 0, 1].

    Args:
        T: (4, 4) pose, translation p in [m].

    Returns:
        (4, 4) pose.
    """
    out = np.empty((4, 4))
    relative_into(T, np.eye(4), out)
    return out


def adjoint(T: Array) -> Array:
    """Compute the adjoint of a pose: Ad = [[R, [p]× R], [0, R]].

    Args:
        T: (4, 4) pose of a body frame in an outer frame, translation p in [m].

    Returns:
        (6, 6) matrix, which maps a twist in the body frame to the same twist in the outer frame.

    Source:
        Solà et al. (2018), appendix D, adjoint matrix of SE(3).
    """
    R, p = T[:3, :3], T[:3, 3]
    out = np.zeros((6, 6))
    out[:3, :3] = out[3:, 3:] = R
    out[:3, 3:] = np.cross(p, R, axisb=0, axisc=0)
    return out


def homogeneous(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """Put a rotation and a translation together into a pose.

    Args:
        rotation: R (3, 3).
        translation: p (3,) [m].

    Returns:
        (4, 4) pose [R, p; 0, 1].

    Raises:
        InvalidValue: The shapes do not fit, a number is not finite, or R is not a rotation.
    """
    out = np.eye(4)
    out[:3, :3] = finite("rotation", rotation, (3, 3))
    out[:3, 3] = finite("translation", translation, (3,))
    return checked_pose("rotation", out)


def checked_pose(name: str, value: ArrayLike) -> Array:
    """Check a pose that a user gave, and return a copy.

    Args:
        name: Name of the pose in the error message.
        value: (4, 4) pose, translation in [m].

    Returns:
        A new array (4, 4).

    Raises:
        InvalidValue: The shape is not (4, 4), a number is not finite, the upper left part is not a rotation,
            or the last row is not 0 0 0 1.
    """
    T = finite(name, value, (4, 4))
    R = T[:3, :3]
    if np.abs(R.T @ R - np.eye(3)).max() > ROTATION or np.linalg.det(R) < 0.0:
        raise InvalidValue(f"{name} is not a rotation: RᵀR must be the identity and det R = 1, got R =\n{R}")
    if np.abs(T[3] - [0.0, 0.0, 0.0, 1.0]).max() > LAST_ROW:
        raise InvalidValue(f"the last row of {name} must be 0 0 0 1, got {T[3]}")
    return T


@kernel
def is_pose(T):
    """Return True if `checked_pose` accepts T; allocates nothing, so that every tick can call it.

    Args:
        T: (4, 4) array, translation in [m].
    """
    for i in range(3):
        for j in range(i + 1):
            dot = T[0, i] * T[0, j] + T[1, i] * T[1, j] + T[2, i] * T[2, j] - (1.0 if i == j else 0.0)
            if not abs(dot) <= ROTATION:
                return False
        if not (abs(T[i, 3]) < np.inf and abs(T[3, i]) <= LAST_ROW):
            return False
    det = T[0, 0] * (T[1, 1] * T[2, 2] - T[1, 2] * T[2, 1])
    det += T[0, 1] * (T[1, 2] * T[2, 0] - T[1, 0] * T[2, 2])
    det += T[0, 2] * (T[1, 0] * T[2, 1] - T[1, 1] * T[2, 0])
    return det > 0.0 and abs(T[3, 3] - 1.0) <= LAST_ROW
