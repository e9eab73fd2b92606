"""Geometric Jacobians of any point in any frame, analytical Jacobians, and their derivatives along a motion.

The geometric Jacobian J maps v (nv,) to the velocity (ṗ, ω) of a point, the analytical one J_A to (ṗ, φ̇)
with Euler angles φ. Use J where the error is a rotation, as in the tasks of a frame, and J_A where Euler
angles are given and integrated.
"""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.orientation.euler import EulerAngles
from taskopt.kinematics.orientation.skew import skew

ORIGIN = (0.0, 0.0, 0.0)


def geometric_jacobian(
    configuration: Configuration, frame: str, point: ArrayLike = ORIGIN, expressed_in: str | None = None
) -> Array:
    """Compute the geometric Jacobian of a point of the structure: (ṗ, ω) = J v.

    With z the axis of a joint in the world, the column of a revolute joint is (z × (p − p_joint), z), and
    that of a prismatic joint is (z, 0).

    Args:
        configuration: The robot at q.
        frame: Name of the frame that carries the point.
        point: Position of the point in that frame, (3,) [m]. Default: the origin of the frame.
        expressed_in: Name of the frame u whose axes are those of the rows, J^u = diag(Rᵘ, Rᵘ) J. The velocity
            remains that relative to the world. Default: the axes of the world.

    Returns:
        J (6, nv): velocity of the point [m/s per unit of v], then angular velocity [rad/s per unit of v].

    Raises:
        UnknownName: The robot lacks one of the frames.
        InvalidValue: The point is not three finite numbers.

    Source:
        Equations (3.4), (3.5), (3.30) and (3.34).
    """
    J = configuration.jacobian(frame)
    J[:3] -= skew(_arm(configuration, frame, point)) @ J[3:]
    if expressed_in is not None:
        R = configuration.pose(expressed_in)[:3, :3]
        J[:3], J[3:] = R.T @ J[:3], R.T @ J[3:]
    return J


def geometric_jacobian_rate(
    configuration: Configuration, frame: str, v: ArrayLike, point: ArrayLike = ORIGIN
) -> Array:
    """Compute the derivative of the geometric Jacobian along a motion, J̇ = Σ_k ∂J/∂q_k v_k.

    The acceleration of the point (linear) and of its frame (angular) is J v̇ + J̇ v.

    Args:
        configuration: The robot at q.
        frame: Name of the frame that carries the point.
        v: Velocity of the robot (nv,) [rad/s, m/s].
        point: Position of the point in that frame, (3,) [m]. Default: the origin of the frame.

    Returns:
        J̇ (6, nv), along the axes of the world.

    Raises:
        UnknownName: The robot lacks the frame.
        InvalidValue: `v` or the point has the wrong shape or a number that is not finite.

    Source:
        J̇ of Sect. 3.7.4.
    """
    velocity = finite("v", v, (configuration.robot.nv,))
    J, rate = configuration.jacobian(frame), configuration.hessian(frame) @ velocity
    arm = _arm(configuration, frame, point)
    rate[:3] -= skew(arm) @ rate[3:] + skew(np.cross(J[3:] @ velocity, arm)) @ J[3:]
    return rate


def pose_rate_map(angles: EulerAngles, phi: ArrayLike) -> Array:
    """Compute T_A(φ) = diag(I, T(φ)), which maps (ṗ, φ̇) to (ṗ, ω).

    Args:
        angles: The set of Euler angles.
        phi: φ (3,) [rad].

    Returns:
        T_A (6, 6).

    Raises:
        InvalidValue: φ is not three finite numbers.

    Source:
        Equation (3.65).
    """
    out = np.eye(6)
    out[3:, 3:] = angles.rate_map(phi)
    return out


def analytical_jacobian(configuration: Configuration, frame: str, angles: EulerAngles) -> Array:
    """Compute the analytical Jacobian of a frame: (ṗ, φ̇) = J_A v, with J_φ = T(φ)⁻¹ J_O and J = T_A(φ) J_A.

    Args:
        configuration: The robot at q.
        frame: Name of the frame.
        angles: The set of Euler angles φ that describes the orientation of the frame in the world.

    Returns:
        J_A (6, nv): velocity of the origin [m/s per unit of v], then rates of φ [rad/s per unit of v].

    Raises:
        UnknownName: The robot lacks the frame.
        InvalidValue: The frame is at a representation singularity of the angles.

    Source:
        Equations (3.60)–(3.63) and (3.66).
    """
    J = configuration.jacobian(frame)
    J[3:] = angles.rates(angles.angles(configuration.pose(frame)[:3, :3]), J[3:])
    return J


def analytical_jacobian_rate(
    configuration: Configuration, frame: str, angles: EulerAngles, v: ArrayLike
) -> Array:
    """Compute the derivative of the analytical Jacobian along a motion, J̇_φ = T⁻¹ (J̇_O − Ṫ J_φ).

    Args:
        configuration: The robot at q.
        frame: Name of the frame.
        angles: The set of Euler angles.
        v: Velocity of the robot (nv,) [rad/s, m/s].

    Returns:
        J̇_A (6, nv), so that (p̈, φ̈) = J_A v̇ + J̇_A v.

    Raises:
        UnknownName: The robot lacks the frame.
        InvalidValue: The frame is at a representation singularity, or `v` has the wrong shape or a number
            that is not finite.

    Source:
        J̇_A of (3.98).
    """
    phi = angles.angles(configuration.pose(frame)[:3, :3])
    J_phi = analytical_jacobian(configuration, frame, angles)[3:]
    rate = geometric_jacobian_rate(configuration, frame, v)
    T_rate = angles.rate_map_rate(phi, J_phi @ np.asarray(v))
    rate[3:] = angles.rates(phi, rate[3:] - T_rate @ J_phi)
    return rate


def _arm(configuration: Configuration, frame: str, point: ArrayLike) -> Array:
    """Return the vector (3,) [m] from the origin of a frame to a point of it, along the axes of the world."""
    return configuration.pose(frame)[:3, :3] @ finite("point", point, (3,))
