"""Unit quaternions Q = (η, ε), scalar part first, and the orientation error Δε."""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.kinematics.orientation.skew import skew
from taskopt.kinematics.pose import log3


def quaternion(rotation: ArrayLike) -> Array:
    """Compute the unit quaternion of a rotation, η = cos(ϑ/2) and ε = r sin(ϑ/2).

    Q and −Q are the same rotation; the one with η ≥ 0 is returned.

    Args:
        rotation: R (3, 3).

    Returns:
        Q (4,), η first.

    Raises:
        InvalidValue: The rotation is not 3×3 finite numbers.

    Source:
        (2.34) of the textbook.
    """
    half = 0.5 * log3(finite("rotation", rotation, (3, 3)))
    angle = float(np.linalg.norm(half))
    return np.concatenate([[np.cos(angle)], np.sinc(angle / np.pi) * half])


def rotation_of(quaternion: ArrayLike) -> Array:
    """Compute the rotation matrix R = (2η² − 1) I + 2 ε εᵀ + 2 η S(ε).

    Args:
        quaternion: Q (4,), η first, of norm 1.

    Returns:
        R (3, 3).

    Raises:
        InvalidValue: The quaternion is not four finite numbers.

    Source:
        Hint of Problem 3.18.
    """
    eta, *epsilon = finite("quaternion", quaternion, (4,))
    return (2.0 * eta**2 - 1.0) * np.eye(3) + 2.0 * np.outer(epsilon, epsilon) + 2.0 * eta * skew(epsilon)


def quaternion_product(first: ArrayLike, second: ArrayLike) -> Array:
    """Compute Q₁ * Q₂ = (η₁η₂ − ε₁ᵀε₂, η₁ε₂ + η₂ε₁ + ε₁ × ε₂), the rotation R₁ R₂.

    Args:
        first: Q₁ (4,), η first.
        second: Q₂ (4,), η first.

    Returns:
        The product (4,), η first.

    Raises:
        InvalidValue: A quaternion is not four finite numbers.

    Source:
        (2.37) of the textbook.
    """
    a, b = finite("first", first, (4,)), finite("second", second, (4,))
    eta = a[0] * b[0] - a[1:] @ b[1:]
    return np.concatenate([[eta], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])])


def quaternion_error(rotation: ArrayLike, desired: ArrayLike) -> Array:
    """Compute the orientation error e_O = Δε = η_e ε_d − η_d ε_e − S(ε_d) ε_e of two orientations.

    ΔQ = Q_d * Q_e⁻¹ = (Δη, Δε) is the rotation R_d R_eᵀ from the actual to the desired orientation, with
    Δη ≥ 0, which is the short way. The error is r sin(ϑ/2) and grows with ϑ up to ϑ = π, where both r and −r
    are axes.

    Args:
        rotation: R_e (3, 3), the orientation that the frame has.
        desired: R_d (3, 3), the one that it should have.

    Returns:
        Δε (3,), along the axes of the world.

    Raises:
        InvalidValue: A rotation is not 3×3 finite numbers.

    Source:
        Equations (3.90) and (3.91).
    """
    Q_e, Q_d = quaternion(rotation), quaternion(desired)
    error = Q_e[0] * Q_d[1:] - Q_d[0] * Q_e[1:] - skew(Q_d[1:]) @ Q_e[1:]
    return error if Q_d @ Q_e >= 0.0 else -error


def quaternion_rate(quaternion: ArrayLike, angular_velocity: ArrayLike) -> Array:
    """Compute the rate of the quaternion of a rotating frame: η̇ = −½ εᵀω, ε̇ = ½ (η I − S(ε)) ω.

    Args:
        quaternion: Q (4,), η first.
        angular_velocity: ω (3,) [rad/s].

    Returns:
        Q̇ (4,) [1/s], η̇ first.

    Raises:
        InvalidValue: An argument has the wrong shape or a number that is not finite.

    Source:
        Equations (3.94) and (3.95), the quaternion propagation.
    """
    Q, omega = finite("quaternion", quaternion, (4,)), finite("angular_velocity", angular_velocity, (3,))
    eta, epsilon = Q[0], Q[1:]
    return 0.5 * np.concatenate([[-epsilon @ omega], (eta * np.eye(3) - skew(epsilon)) @ omega])


def angular_velocity_of(quaternion: ArrayLike, rate: ArrayLike) -> Array:
    """Compute the angular velocity of a changing quaternion, ω = 2 S(ε) ε̇ + 2 η ε̇ − 2 η̇ ε.

    Args:
        quaternion: Q (4,), η first.
        rate: Q̇ (4,) [1/s], η̇ first.

    Returns:
        ω (3,) [rad/s].

    Raises:
        InvalidValue: An argument is not four finite numbers.

    Source:
        Problem 3.18.
    """
    Q, dot = finite("quaternion", quaternion, (4,)), finite("rate", rate, (4,))
    return 2.0 * (skew(Q[1:]) @ dot[1:] + Q[0] * dot[1:] - dot[0] * Q[1:])


def quaternion_distance(rotation: ArrayLike, desired: ArrayLike) -> float:
    """Compute V = (η_d − η_e)² + ‖ε_d − ε_e‖², the distance of two orientations as quaternions.

    With the rows (3.92) V decreases as V̇ = −e_Oᵀ K_O e_O. Of Q_e and −Q_e, which are the same rotation, the
    one nearer to Q_d is taken.

    Args:
        rotation: R_e (3, 3), the orientation that the frame has.
        desired: R_d (3, 3), the one that it should have.

    Returns:
        V, between 0 and 2; it is 2 − 2 cos(ϑ/2).

    Raises:
        InvalidValue: A rotation is not 3×3 finite numbers.

    Source:
        Equations (3.96) and (3.97).
    """
    Q_e, Q_d = quaternion(rotation), quaternion(desired)
    return float(min(((Q_d - Q_e) ** 2).sum(), ((Q_d + Q_e) ** 2).sum()))
