"""Angle and axis, and the orientation error r sin ϑ."""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.kinematics.orientation.skew import skew
from taskopt.kinematics.pose import log3


def angle_axis(rotation: ArrayLike) -> tuple[float, Array]:
    """Compute the angle ϑ and the axis r of a rotation.

    Args:
        rotation: R (3, 3); to compare two frames give R_d R_eᵀ, the rotation from the actual to the desired
            orientation.

    Returns:
        ϑ [rad] in [0, π], and the unit vector r (3,). If R is the identity, r is (1, 0, 0).

    Raises:
        InvalidValue: The rotation is not 3×3 finite numbers.

    Source:
        Equation (3.84).
    """
    vector = log3(finite("rotation", rotation, (3, 3)))
    angle = float(np.linalg.norm(vector))
    return angle, vector / angle if angle > 0.0 else np.array([1.0, 0.0, 0.0])


def angle_axis_error(rotation: ArrayLike, desired: ArrayLike) -> Array:
    """Compute the orientation error e_O = r sin ϑ = ½ (n_e × n_d + s_e × s_d + a_e × a_d).

    The axis is right for every ϑ, but beyond π/2 the error becomes smaller as ϑ grows, and at ϑ = π it is
    zero although the frames point in opposite directions.

    Args:
        rotation: R_e (3, 3), the orientation that the frame has.
        desired: R_d (3, 3), the one that it should have.

    Returns:
        e_O (3,), the axis in the world times the sine of the angle.

    Raises:
        InvalidValue: A rotation is not 3×3 finite numbers.

    Source:
        Equations (3.83) and (3.85).
    """
    R_e, R_d = finite("rotation", rotation, (3, 3)), finite("desired", desired, (3, 3))
    return 0.5 * np.cross(R_e, R_d, axis=0).sum(axis=1)


def error_rate_matrix(rotation: ArrayLike, desired: ArrayLike) -> Array:
    """Compute L, with which the error r sin ϑ changes as ė_O = Lᵀ ω_d − L ω_e.

    L = −½ (S(n_d) S(n_e) + S(s_d) S(s_e) + S(a_d) S(a_e)). Where the frames agree it is the identity; its
    determinant is zero where ϑ = π/2, and where ϑ = π, so that L can be inverted for ϑ < π/2.

    Args:
        rotation: R_e (3, 3), the orientation that the frame has.
        desired: R_d (3, 3), the one that it should have.

    Returns:
        L (3, 3).

    Raises:
        InvalidValue: A rotation is not 3×3 finite numbers.

    Source:
        Equations (3.86) and (3.87).
    """
    R_e, R_d = finite("rotation", rotation, (3, 3)), finite("desired", desired, (3, 3))
    return -0.5 * sum((skew(R_d[:, k]) @ skew(R_e[:, k]) for k in range(3)), np.zeros((3, 3)))
