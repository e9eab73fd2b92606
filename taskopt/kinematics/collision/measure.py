"""Signed distances at a configuration, with their gradients."""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.tolerances import NO_SLOPE
from taskopt.jit import kernel
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.configuration import Configuration


class Measured(NamedTuple):
    """Copies of the distances and nearest points of one tick.

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
    d has a kink, and the gradient is the slope on one side of it.

    Attributes:
        collision: The P pairs.
        distance: (P,) [m] as of the last `update`; negative where solids overlap, by the depth of the
            overlap.
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

    If n is zero, d is `crossed` and the gradient is zero.

    Args:
        contact: (P, 9) unit normal n, nearest points p₁ and p₂ [m], in the world.
        crossed: (P,) distance of a pair whose n is zero [m].
        turn: (P, nv) the sign ± of the formula: +1, −1, or 0 for velocities that do not change d.
        J: (6, nv) joint Jacobians at the origin of the world; column k is (v_k, ω_k).
        distance: (P,) receives d [m].
        gradient: (P, nv) receives ∂d/∂q.

    Returns:
        True if nearest points of a pair coincide or are NaN, so that it must be measured again.
    """
    doubtful = False
    for i in range(distance.size):
        line, apart = line_of(contact[i])
        doubtful |= not apart > 0.0
        distance[i] = crossed[i] if has_no_normal(line) else line[6]
        for k in range(turn.shape[1]):
            gradient[i, k] = 0.0
            if turn[i, k] != 0.0:
                gradient[i, k] = turn[i, k] * slope_of(line, J, k)
    return doubtful


@kernel
def line_of(contact):
    """Compute the line through the nearest points of a pair.

    Args:
        contact: (9,) unit normal n, nearest points p₁ and p₂ [m], in the world.

    Returns:
        n, p₁ × n and nᵀ(p₂ − p₁) as seven numbers; and the 1-norm of p₂ − p₁ [m].
    """
    nx, ny, nz = contact[0], contact[1], contact[2]
    px, py, pz = contact[3], contact[4], contact[5]
    x, y, z = contact[6] - px, contact[7] - py, contact[8] - pz
    moment = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
    return (nx, ny, nz, *moment, nx * x + ny * y + nz * z), abs(x) + abs(y) + abs(z)


@kernel
def has_no_normal(line):
    """Return True if Coal found no normal for a pair.

    Args:
        line: See `line_of`.

    Returns:
        True if n is zero.
    """
    return line[0] == 0.0 and line[1] == 0.0 and line[2] == 0.0


@kernel
def slope_of(line, J, k):
    """Compute nᵀv_k + (p₁ × n)ᵀω_k, where p₁ is moved by velocity k and the other solid is not.

    Args:
        line: See `line_of`.
        J: (6, nv) joint Jacobians at the origin of the world; column k is (v_k, ω_k).
        k: Index of the velocity.

    Returns:
        The slope; 0 where it is rounding.
    """
    slope = line[0] * J[0, k] + line[1] * J[1, k] + line[2] * J[2, k]
    slope += line[3] * J[3, k] + line[4] * J[4, k] + line[5] * J[5, k]
    return 0.0 if abs(slope) < NO_SLOPE else slope  # written so that NaN is handed on, and found
