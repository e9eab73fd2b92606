"""Manipulability ellipsoids of velocity and of force, and the transformation ratios along a direction.

Metres and radians cannot be compared: give either the linear or the angular rows of a Jacobian, and compute
one ellipsoid for each.
"""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import JACOBIAN_RANK


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """An ellipsoid, the surface of all x with Σ (u_iᵀ x / s_i)² = 1.

    Attributes:
        axes: (m, m) unit vectors u_i in the columns.
        semi_axes: (m,) lengths s_i: 0 where the surface is flat, and inf where it is open.
    """

    axes: Array
    semi_axes: Array

    def points(self, directions: ArrayLike) -> Array:
        """Map unit vectors to points of the surface, x = Σ u_i s_i y_i.

        Args:
            directions: y (k, m), unit vectors in the coordinates of the axes.

        Returns:
            Points x (k, m), in the unit of the semi-axes.

        Raises:
            InvalidValue: The directions do not fit the ellipsoid.
        """
        y = finite("directions", directions, (None, self.semi_axes.size))
        return (y * self.semi_axes) @ self.axes.T


def velocity_ellipsoid(J: ArrayLike, limits: ArrayLike | None = None) -> Ellipsoid:
    """Compute the ellipsoid of velocities that joint velocities of norm 1 produce, vᵀ (J Jᵀ)⁻¹ v = 1.

    Its axes are the left singular vectors of J, its semi-axes the singular values; at a singularity it is
    flat.

    Args:
        J: Rows of a Jacobian (m, n) in one unit.
        limits: (n,) for each joint the velocity by which its velocity is divided before the norm is taken,
            such as its limit [rad/s, m/s]; default: 1 for all.

    Returns:
        The ellipsoid, semi-axes in falling order [m/s] or [rad/s].

    Raises:
        InvalidValue: J is not a matrix of finite numbers, or a limit is not finite and positive.

    Source:
        Equations (3.122) and (3.123).
    """
    matrix = finite("J", J, (None, None))
    return Ellipsoid(*_axes(matrix * _scale(limits, matrix.shape[1])))


def force_ellipsoid(J: ArrayLike, limits: ArrayLike | None = None) -> Ellipsoid:
    """Compute the ellipsoid of forces that joint torques of norm 1 balance, γᵀ (J Jᵀ) γ = 1.

    Without limits its axes are those of the velocity ellipsoid, and its semi-axes their inverses; at a
    singularity it is open, since the structure bears any force along the lost direction.

    Args:
        J: Rows of a Jacobian (m, n) in one unit.
        limits: (n,) for each joint the torque by which its torque is divided before the norm is taken, such
            as its limit [N m, N]; default: 1 for all.

    Returns:
        The ellipsoid, semi-axes in rising order [N] or [N m].

    Raises:
        InvalidValue: J is not a matrix of finite numbers, or a limit is not finite and positive.

    Source:
        Equations (3.125) and (3.126).
    """
    matrix = finite("J", J, (None, None))
    axes, sigma = _axes(matrix / _scale(limits, matrix.shape[1]))
    largest = float(sigma.max(initial=0.0))
    lost = sigma <= JACOBIAN_RANK * largest
    return Ellipsoid(axes, np.divide(1.0, sigma, out=np.full_like(sigma, np.inf), where=~lost))


def force_ratio(J: ArrayLike, direction: ArrayLike) -> float:
    """Compute the extent of the force ellipsoid along a direction u, α = (uᵀ J Jᵀ u)^(−1/2).

    Args:
        J: Rows of a Jacobian (m, n) in one unit.
        direction: u (m,), of any length but zero.

    Returns:
        α [N] or [N m] for torques of norm 1; inf if the structure bears any force along u.

    Raises:
        InvalidValue: J or u is not finite or does not fit, or u is zero.

    Source:
        Equation (3.127).
    """
    matrix = finite("J", J, (None, None))
    size = float(np.linalg.norm(matrix.T @ _unit(direction, matrix.shape[0])))
    return 1.0 / size if size > JACOBIAN_RANK * float(np.linalg.norm(matrix, 2)) else np.inf


def velocity_ratio(J: ArrayLike, direction: ArrayLike) -> float:
    """Compute the extent of the velocity ellipsoid along a direction u, β = (uᵀ (J Jᵀ)⁻¹ u)^(−1/2).

    Args:
        J: Rows of a Jacobian (m, n) in one unit.
        direction: u (m,), of any length but zero.

    Returns:
        β [m/s] or [rad/s] for joint velocities of norm 1; 0 if the frame cannot move along u.

    Raises:
        InvalidValue: J or u is not finite or does not fit, or u is zero.

    Source:
        Equation (3.128).
    """
    matrix = finite("J", J, (None, None))
    axes, sigma = _axes(matrix)
    shares = axes.T @ _unit(direction, matrix.shape[0])
    lost = sigma <= JACOBIAN_RANK * float(sigma.max(initial=0.0))
    if (np.abs(shares[lost]) > JACOBIAN_RANK).any():
        return 0.0
    return float(1.0 / np.linalg.norm(shares[~lost] / sigma[~lost]))


def _axes(J: Array) -> tuple[Array, Array]:
    """Return the left singular vectors (m, m) of a matrix (m, n), and m singular values, zero beyond n."""
    U, found, _ = np.linalg.svd(J)
    sigma = np.zeros(J.shape[0])
    sigma[: found.size] = found
    return U, sigma


def _scale(limits: ArrayLike | None, n: int) -> Array:
    """Return the joint velocities or torques (n,) by which those of the joints are divided."""
    if limits is None:
        return np.ones(n)
    scale = finite("limits", limits, (n,))
    if not (scale > 0.0).all():
        raise InvalidValue(f"limits must be > 0, got {scale.min():g}; leave joints without a limit out of J")
    return scale


def _unit(direction: ArrayLike, m: int) -> Array:
    """Return a direction (m,) as a unit vector."""
    u = finite("direction", direction, (m,))
    size = float(np.linalg.norm(u))
    if size == 0.0:
        raise InvalidValue("direction must not be zero")
    return u / size
