"""Damping at rest of a level that asks for accelerations: as much as its tasks bend, and no more.

At rest, where what is left of the error r cannot be met, the cost ½ ‖e‖² of a level has along a direction v
of length 1 the second derivative σ² + c, with σ = ‖J v‖, c = −rᵀ f″(v, v), and the second derivative f″ of
the value of the tasks. Rows of (3.102) know σ only: a small motion x along v follows

    σ² (ẍ + K_D ẋ) = −K_P (σ² + c) x,

which oscillates faster and faster as σ → 0, up to the limits. Rows of damping √|c| (q̈ + K_D v) = 0 in the
direction v add |c| on the left. Where c > 0, that is at a minimum, this is (3.103) itself, with both poles
at −K; where c < 0 nothing grows faster than with K. Unlike at first order, where rows k q̇ = 0 stop what
moves, rows q̈ = 0 would let a motion live on; and unlike there, the bound of f″ by a lever arm would be too
much: the arm would creep.

The directions that are damped are those of `taskopt.hierarchy.rest`, with 1/K_P in place of Δt, and with the
part of b that the damped level cannot meet, r(ε) = b − Σ_i min(1, σ_i²/ε²) u_i u_iᵀ b, since c needs r: ε²
bounds |c| from above. √|c| fades as √(1 − σ²/ε²), so that nothing jumps where a direction comes or goes.

Directions n that the rows leave free belong to the same minimum where c > 0: a stretched arm has one weak
direction and others with σ = 0, and each of them bends the tip away from the target. They are decided by
the level, too, since a lower level would throw it out of its minimum. Along a self-motion c = 0, and it
stays with the lower levels.

Source: the damping is the second derivative of the cost, as in Pfeiffer, Escande, Gergondet and Kheddar
(2023), "The Hierarchical Newton's Method for Numerically Stable Prioritized Dynamic Control", on the
directions of low σ only.
"""

from collections.abc import Callable, Sequence

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.tolerances import (
    BENDS,
    DEPENDENT_DIRECTION,
    OF_WEAK_DIRECTION,
    REST_LEAST,
    THRESHOLD_FOUND,
)

_ROUNDS = 60  # of the fixed point of ε²; its first value is an upper bound, and each round lowers it

Bend = Callable[[Array], Array]


def bent_directions(
    A: Array, b: Array, groups: Sequence[IntArray], free: Array, periods: Array, bend: Bend, taken: int = 0
) -> tuple[float, Array]:
    """Return the damping of one level of second order.

    Args:
        A: Rows of the level, each times √w, (m, n).
        b: Right-hand sides, each times √w, less what the held directions contribute, (m,).
        groups: Indices of the curved rows, by task and unit.
        free: Orthonormal basis of the directions that are free, (n, f).
        periods: 1/K_P of each row [s²]; 0 for a row that has no error, (m,).
        bend: Function that returns f″(v, v) of the rows, each times √w, (m,), for a velocity v (n,).
        taken: Number of directions that the level lacks because levels before it have them.

    Returns:
        ε², 0 if nothing is damped, and the rows of damping, (r, n).
    """
    nothing = 0.0, np.zeros((0, A.shape[1]))
    if not free.shape[1] or not groups:
        return nothing
    U, sigma, Vt = np.linalg.svd(A @ free)
    count = len(sigma)
    levers = [float(np.linalg.norm(A[rows], axis=0).max()) for rows in groups]
    limit, left = np.inf, b
    for _ in range(_ROUNDS):
        pairs = zip(levers, groups, strict=True)
        lower = sum(lever * float(np.linalg.norm((periods * left)[rows])) for lever, rows in pairs)
        if lower < REST_LEAST:
            return nothing
        found, limit = lower > (1.0 - THRESHOLD_FOUND) * limit, lower
        if found:
            break
        left = b - U[:, :count] @ (np.minimum(1.0, sigma**2 / limit) * (U.T @ b)[:count])
    weak = sigma[: count - taken] ** 2 < limit
    if not weak.any():
        return nothing
    v = np.vstack([Vt[: count - taken][weak], Vt[count:]]) @ free.T
    fade = np.append(np.sqrt(1.0 - sigma[: count - taken][weak] ** 2 / limit), np.ones(len(Vt) - count))
    c, turned = np.linalg.eigh(_second_derivatives(v, -periods * left, bend))
    own = (turned[: weak.sum()] ** 2).sum(axis=0) > OF_WEAK_DIRECTION
    kept = own | (c > BENDS * limit)
    return limit, np.sqrt(np.abs(c[kept]))[:, None] * (turned.T[kept] @ (fade[:, None] * v))


def null_space(rows: Array) -> Array:
    """Return an orthonormal basis of the directions that some rows leave free.

    Args:
        rows: Rows of any length, (m, n); each is scaled to length 1 to decide on the rank.

    Returns:
        The basis, (n, f).
    """
    length = np.linalg.norm(rows, axis=1)
    unit = rows[length > 0.0] / length[length > 0.0, None]
    if not len(unit):
        return np.eye(rows.shape[1])
    _, sigma, Vt = np.linalg.svd(unit)
    return Vt[int((sigma > DEPENDENT_DIRECTION).sum()) :].T


def rank(rows: Array, size: float) -> int:
    """Return the number of singular values that are more than rounding errors of rows of some size.

    Args:
        rows: Rows, (m, n).
        size: Frobenius norm of the rows from which they were turned.

    Returns:
        The rank.
    """
    return int((np.linalg.svd(rows, compute_uv=False) > DEPENDENT_DIRECTION * size).sum())


def _second_derivatives(v: Array, left: Array, bend: Bend) -> Array:
    """Return rᵀ f″(v_i, v_j), (r, r), by f″(u, v) = ¼ (f″(u + v, u + v) − f″(u − v, u − v))."""
    out = np.diag([float(left @ bend(direction)) for direction in v])
    for i in range(len(v)):
        for j in range(i):
            out[i, j] = out[j, i] = 0.25 * float(left @ (bend(v[i] + v[j]) - bend(v[i] - v[j])))
    return out
