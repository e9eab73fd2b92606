"""Signed distances at a configuration, with their gradients."""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.tolerances import NO_SLOPE
from taskopt.jit import kernel
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.configuration import Configuration


class Measured(NamedTuple):
    """Distances of one tick, as copies that may be kept.

    Attributes:
        distance: (P,) signed distance of each pair [m].
        witness: (P, 2, 3) nearest points on the first and on the second solid, in the world [m].
    """

    distance: Array
    witness: Array


class Distances:
    """Signed distances of pairs of solids, their nearest points, and their gradients.

    ∂d/∂q = nᵀ(J₂ − J₁), with n the unit normal from the first solid to the second in the world, and J₁, J₂
    the Jacobians (3, nv) of the nearest points. Where several points are nearest, as between parallel faces,
    d has a kink, and the gradient is that of one side.

    Attributes:
        collision: The P pairs.
        distance: (P,) [m] as of the last `update`; where solids overlap, minus the depth.
        gradient: (P, nv) ∂d/∂q [m/rad, 1] as of the last `update`.

    Source:
        Faverjon and Tournassoud (1987), ICRA.
    """

    def __init__(self, collision: Collision) -> None:
        """Allocate the memory for the distances of some pairs.

        Args:
            collision: The pairs.
        """
        self.collision = collision
        self.distance: Array = np.zeros(len(collision.pairs))
        self.gradient: Array = np.zeros(collision.turn.shape)

    def update(self, configuration: Configuration) -> None:
        """Measure all pairs, in place.

        Args:
            configuration: The robot at q.
        """
        pairs, J = self.collision, configuration.joint_jacobians
        pairs.update(configuration.data)
        known = pairs.contact, pairs.crossed, pairs.turn, J, self.distance, self.gradient
        if distances_into(*known):
            pairs.remeasure()
            distances_into(*known)

    @property
    def witness(self) -> Array:
        """Copy (P, 2, 3) of the nearest points on the first and on the second solid, in the world [m]."""
        return self.collision.contact[:, 3:].reshape(-1, 2, 3).copy()

    def measured(self) -> Measured:
        """Copy the distances and nearest points of the last `update`."""
        return Measured(self.distance.copy(), self.witness)


@kernel
def distances_into(contact, crossed, turn, J, distance, gradient):
    """Compute d = nᵀ(p₂ − p₁) and ∂d/∂q_k = ±(nᵀv_k + (p₁ × n)ᵀω_k) of all pairs.

    Where n is zero, d is `crossed` and the gradient zero.

    Args:
        contact: (P, 9) unit normal n, nearest points p₁ and p₂ [m], in the world.
        crossed: (P,) distance of pairs without a normal [m].
        turn: (P, nv) the sign: +1, −1, or 0 for velocities that do not change d.
        J: (6, nv) joint Jacobians at the origin of the world; column k is (v_k, ω_k).
        distance: (P,) receives d [m].
        gradient: (P, nv) receives ∂d/∂q.

    Returns:
        True if nearest points of a pair coincide or are NaN, so that it must be measured again.
    """
    doubtful = False
    for i in range(distance.size):
        nx, ny, nz = contact[i, 0], contact[i, 1], contact[i, 2]
        px, py, pz = contact[i, 3], contact[i, 4], contact[i, 5]
        distance[i] = nx * (contact[i, 6] - px) + ny * (contact[i, 7] - py) + nz * (contact[i, 8] - pz)
        reach = abs(contact[i, 6] - px) + abs(contact[i, 7] - py) + abs(contact[i, 8] - pz)
        doubtful |= not reach > 0.0
        if nx == 0.0 and ny == 0.0 and nz == 0.0:
            distance[i] = crossed[i]
        mx, my, mz = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
        for k in range(turn.shape[1]):
            gradient[i, k] = 0.0
            if turn[i, k] != 0.0:
                slope = (
                    nx * J[0, k] + ny * J[1, k] + nz * J[2, k] + mx * J[3, k] + my * J[4, k] + mz * J[5, k]
                )
                if not abs(slope) < NO_SLOPE:  # written so that NaN is handed on, and found
                    gradient[i, k] = turn[i, k] * slope
    return doubtful
