"""Closed chains, modelled as a tree of joints in which two frames must meet to close the loop."""

from collections.abc import Sequence

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import JACOBIAN_RANK
from taskopt.kinematics.configuration import Configuration


def loop_jacobian(configuration: Configuration, frame_a: str, frame_b: str, rows: Sequence[int]) -> Array:
    """Compute the matrix K = J_a − J_b of a loop; motions that keep the loop closed satisfy K v = 0.

    Args:
        configuration: The robot at q, with the loop closed.
        frame_a: Name of the frame at one side of the cut joint.
        frame_b: Name of the frame at the other side.
        rows: Indices of the rows, along the axes of the world, that the cut joint holds together: (0, 1) for
            a revolute joint of a chain in the x-y plane, (0, 1, 2) for a ball joint.

    Returns:
        K (k, nv).

    Raises:
        UnknownName: The robot lacks one of the frames.

    Source:
        Sect. 3.8.3.
    """
    return (configuration.jacobian(frame_a) - configuration.jacobian(frame_b))[list(rows)]


def transmission(closure: ArrayLike, actuated: Sequence[int]) -> Array:
    """Compute Υ, which maps velocities of the actuated joints to those of all joints, q̇_o = Υ q̇_a.

    With the columns K_a of the actuated joints and K_u of the others, K_a q̇_a + K_u q̇_u = 0 gives
    ∂q_u/∂q_a = −K_u⁻¹ K_a.

    Args:
        closure: K (k, n), see `loop_jacobian`.
        actuated: Indices of the velocities that are actuated; there are n − rank K of them.

    Returns:
        Υ (n, len(actuated)), its rows in the order of the robot's velocities; the rows of the actuated joints
        form the identity.

    Raises:
        InvalidValue: The actuated joints do not determine the others, as at a dead centre; or there are too
            many of them, so that the loop would couple them.

    Source:
        Equations (3.117), (3.118) and (3.119).
    """
    K = finite("closure", closure, (None, None))
    n, driven = K.shape[1], list(actuated)
    passive = [i for i in range(n) if i not in driven]
    sigma = np.linalg.svd(K[:, passive], compute_uv=False)
    largest = float(np.linalg.svd(K, compute_uv=False).max(initial=0.0))
    if len(sigma) < len(passive) or (sigma <= JACOBIAN_RANK * largest).any():
        raise InvalidValue(
            "the actuated joints do not determine the others: actuate more joints, or leave the dead centre"
        )
    follow = -np.linalg.pinv(K[:, passive]) @ K[:, driven]
    gap = K[:, driven] + K[:, passive] @ follow
    if float(np.abs(gap).max(initial=0.0)) > JACOBIAN_RANK * largest:
        raise InvalidValue(
            f"{len(driven)} actuated joints cannot move independently in this loop; actuate "
            f"{n - np.linalg.matrix_rank(K)} joints"
        )
    out = np.zeros((n, len(driven)))
    out[driven, range(len(driven))] = 1.0
    out[passive] = follow
    return out


def actuated_torques(transmission: ArrayLike, torques: ArrayLike) -> Array:
    """Compute the torques of the actuated joints that replace torques at all joints, τ_a = Υᵀ τ_o.

    Args:
        transmission: Υ (n, a), see `transmission`.
        torques: Torques τ_o (n,) at the joints of the open tree, such as Jᵀ γ [N m].

    Returns:
        τ_a (a,) [N m].

    Raises:
        InvalidValue: Υ is not a matrix of finite numbers, or τ_o does not fit it.

    Source:
        Equations (3.120) and (3.121).
    """
    matrix = finite("transmission", transmission, (None, None))
    return matrix.T @ finite("torques", torques, (matrix.shape[0],))
