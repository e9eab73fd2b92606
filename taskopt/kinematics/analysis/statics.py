"""Statics: torques that balance forces, and transforms of velocities and forces between frames.

A wrench γ = (f, μ) has the force f [N] first and the moment μ [N m] second, in the order of a twist, whose
linear velocity is first. The moment is taken about the origin of the frame on which the wrench acts.
"""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.kinematics.orientation.skew import skew
from taskopt.kinematics.pose import checked_pose


def joint_torques(J: ArrayLike, wrench: ArrayLike) -> Array:
    """Compute the joint torques that hold a robot in equilibrium against a wrench, τ = Jᵀ γ.

    Torques and wrench do the same virtual work, τᵀ δq = γᵀ J δq for every δq. Wrenches of the null space of
    Jᵀ need no torque (`Subspaces.null_of_transpose`): the structure bears them.

    Args:
        J: Geometric Jacobian (m, n) of the frame at which the robot exerts the wrench, along the axes of γ.
        wrench: γ (m,) that the frame exerts on its environment [N, N m].

    Returns:
        τ (n,) [N m], or [N] for prismatic joints.

    Raises:
        InvalidValue: J is not a matrix of finite numbers, or γ does not fit its rows.

    Source:
        Equations (3.105)–(3.111).
    """
    matrix = finite("J", J, (None, None))
    return matrix.T @ finite("wrench", wrench, (matrix.shape[0],))


def velocity_transform(pose: ArrayLike) -> Array:
    """Compute the matrix J₁² that maps the velocity of frame 1 to that of frame 2 on the same body.

    With r the origin of frame 2 in frame 1, v₂² = [[R₁², −R₁² S(r)], [0, R₁²]] v₁¹, each velocity along the
    axes of its own frame.

    Args:
        pose: (4, 4) pose of frame 2 in frame 1 [m].

    Returns:
        J₁² (6, 6).

    Raises:
        InvalidValue: The pose is not a rigid-body pose.

    Source:
        Equations (3.112), (3.113) and (3.114).
    """
    T = checked_pose("pose", pose)
    R = T[:3, :3].T
    out = np.zeros((6, 6))
    out[:3, :3] = out[3:, 3:] = R
    out[:3, 3:] = -R @ skew(T[:3, 3])
    return out


def force_transform(pose: ArrayLike) -> Array:
    """Compute the matrix (J₁²)ᵀ that maps a wrench at frame 2 to the same wrench at frame 1.

    γ₁¹ = (J₁²)ᵀ γ₂² with (J₁²)ᵀ = [[R₂¹, 0], [S(r) R₂¹, R₂¹]], since the power is the same in both frames. r
    is the origin of frame 2 in frame 1.

    Args:
        pose: (4, 4) pose of frame 2 in frame 1 [m].

    Returns:
        (J₁²)ᵀ (6, 6).

    Raises:
        InvalidValue: The pose is not a rigid-body pose.

    Source:
        Equations (3.115) and (3.116).
    """
    return velocity_transform(pose).T
