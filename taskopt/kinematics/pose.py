"""Rigid-body poses as (4, 4) homogeneous arrays: logarithm, exponential, and their rates.

Twists and logarithms have the linear part [m] first, then the angular part [rad], and are expressed
in the moving frame: T exp6(ξ) moves T along its own axes, and jlog6(T) is the right Jacobian inverse,
log6(T exp6(δ)) ≈ log6(T) + jlog6(T) δ. Solà, Deray and Atchuthan (2018), arXiv:1812.01537.
The kernels behind them, for loops that must not allocate, are in `taskopt.kinematics.lie`.
"""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
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
    """Rotation vector (3,) [rad] of a rotation matrix, angle in [0, π]."""
    out = np.empty(3)
    log3_into(R, out)
    return out


def jlog3(R: Array) -> Array:
    """Right Jacobian inverse (3, 3) of `log3`."""
    out = np.empty((3, 3))
    jlog3_into(R, out)
    return out


def exp3(omega: Array) -> Array:
    """Rotation matrix (3, 3) of a rotation vector [rad]."""
    out = np.empty((3, 3))
    exp3_into(omega, out)
    return out


def log6(T: Array) -> Array:
    """Body twist (6,), linear [m] then angular [rad], that leads from the identity to T in unit time."""
    out = np.empty(6)
    log6_into(T, out)
    return out


def jlog6(T: Array) -> Array:
    """Right Jacobian inverse (6, 6) of `log6`."""
    out = np.empty((6, 6))
    jlog6_into(T, out)
    return out


def exp6(twist: Array) -> Array:
    """Pose (4, 4) of a body twist (6,): the inverse of `log6`."""
    out = np.empty((4, 4))
    exp6_into(twist, out)
    return out


def inverse(T: Array) -> Array:
    """T⁻¹ (4, 4)."""
    out = np.empty((4, 4))
    relative_into(T, np.eye(4), out)
    return out


def adjoint(T: Array) -> Array:
    """(6, 6) matrix that maps a twist in the frame T to the outer frame: [[R, [p]× R], [0, R]]."""
    R, p = T[:3, :3], T[:3, 3]
    out = np.zeros((6, 6))
    out[:3, :3] = out[3:, 3:] = R
    out[:3, 3:] = np.cross(p, R, axisb=0, axisc=0)
    return out


def homogeneous(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """Pose (4, 4) from a rotation matrix (3, 3) and a translation (3,) [m]; checked like `checked_pose`."""
    out = np.eye(4)
    out[:3, :3] = finite("rotation", rotation, (3, 3))
    out[:3, 3] = finite("translation", translation, (3,))
    return checked_pose("rotation", out)


def checked_pose(name: str, value: ArrayLike) -> Array:
    """A copy of `value` if it is a (4, 4) pose; raise `InvalidValue` otherwise."""
    T = finite(name, value, (4, 4))
    R = T[:3, :3]
    if np.abs(R.T @ R - np.eye(3)).max() > 1e-6 or np.linalg.det(R) < 0.0:
        raise InvalidValue(f"{name} is not a rotation: RᵀR must be the identity and det R = 1, got R =\n{R}")
    if np.abs(T[3] - [0.0, 0.0, 0.0, 1.0]).max() > 1e-9:
        raise InvalidValue(f"the last row of {name} must be 0 0 0 1, got {T[3]}")
    return T


@kernel
def is_pose(T):
    """Whether `checked_pose` would accept T; that function finds the words, this one is for every tick."""
    for i in range(3):
        for j in range(i + 1):
            dot = T[0, i] * T[0, j] + T[1, i] * T[1, j] + T[2, i] * T[2, j] - (1.0 if i == j else 0.0)
            if not abs(dot) <= 1e-6:
                return False
        if not (abs(T[i, 3]) < np.inf and abs(T[3, i]) <= 1e-9):
            return False
    det = T[0, 0] * (T[1, 1] * T[2, 2] - T[1, 2] * T[2, 1])
    det += T[0, 1] * (T[1, 2] * T[2, 0] - T[1, 0] * T[2, 2])
    det += T[0, 2] * (T[1, 0] * T[2, 1] - T[1, 1] * T[2, 0])
    return det > 0.0 and abs(T[3, 3] - 1.0) <= 1e-9
