"""Distances at a configuration, with their gradients: what obstacle objectives and limits stand on."""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array
from taskopt.jit import kernel
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.configuration import Configuration

_ROUNDING = 1e-13  # a slope [m/rad, 1] below it is none: a wheel beside its own axle


class Measured(NamedTuple):
    """Distances (P,) [m] and the nearest points (P, 2, 3) [m] of one tick, to keep."""

    distance: Array
    witness: Array


class Distances:
    """Signed distances of the pairs of a `Collision`, their witness points, and their gradients.

    `distance` (P,) [m] is negative where the solids overlap, then by the depth. `gradient` (P, nv) is
    ∂d/∂q = nᵀ(J₂ − J₁), with n the normal from the first solid to the second and J₁, J₂ the Jacobians
    of the witness points (Faverjon and Tournassoud (1987), ICRA). Both are those of the last `update`.
    Where two witness points serve equally well, as between parallel faces, d has a kink, and the
    gradient is that of one side.
    """

    def __init__(self, collision: Collision) -> None:
        self.collision = collision
        self.distance: Array = np.zeros(len(collision.pairs))
        self.gradient: Array = np.zeros(collision.turn.shape)

    def update(self, at: Configuration) -> None:
        """Measure at a configuration, in place."""
        of = self.collision
        of.update(at.data)
        known = of.contact, of.crossed, of.turn, at.joint_jacobians, self.distance, self.gradient
        if distances_into(*known):
            of.remeasure()
            distances_into(*known)

    @property
    def witness(self) -> Array:
        """(P, 2, 3) a copy of the nearest points, first and second solid, in the world [m]."""
        return self.collision.contact[:, 3:].reshape(-1, 2, 3).copy()

    def measured(self) -> Measured:
        """Copies of the distances and witness points."""
        return Measured(self.distance.copy(), self.witness)


@kernel
def distances_into(contact, crossed, turn, J, distance, gradient):
    """d = n·(p₂ − p₁) and ∂d/∂q_k = ±(n·v_k + (p₁ × n)·ω_k), v_k and ω_k being column k of J.

    d is `crossed` and ∂d/∂q zero where n is zero. Returns whether any witness points coincide or are NaN.
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
                if not abs(slope) < _ROUNDING:  # so that NaN is handed on, and found
                    gradient[i, k] = turn[i, k] * slope
    return doubtful
