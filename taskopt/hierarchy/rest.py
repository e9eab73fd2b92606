"""Damping without parameters, with which a robot comes to rest where its tasks cannot be met.

Where a still target is out of reach, or blocked by limits, the error e that remains is orthogonal to what the
free joints can do: their Jacobian has lost rank. Without damping, a level that follows A v = b is stable
there only where σ² is larger than about Δt times the second derivative of the task along v times what remains
of b. Else each tick, although it is optimal, throws the arm back and forth for ever. Damping of

    k_i² = max(0, ε² − σ_i²),    ε² = Δt Σ_g R_g ‖r_g(ε)‖,    r(ε) = b − Σ_i min(1, σ_i²/ε²) u_i u_iᵀ b

in the direction v_i makes the step stable, whatever gain and Δt are. σ_i, u_i and v_i are the singular values
and vectors of the rows √w A, restricted to what is free: joints that a limit on positions holds are not, and
neither are directions that hard rows or levels before decide. r(ε) is the part of b that the damped level
cannot meet, so that nothing is damped where a level can be met. The largest ε is taken. The groups g are the
rows of one task and unit; R_g, the largest norm of a column of the group, is the lever arm of a joint on the
group and bounds its second derivative.

The damped level decides more directions the nearer it is to the loss of rank, and its null space turns
quickly there. What its free directions n do is therefore damped, too, in the level below, by rows √μ n that
vanish as the smallest σ reaches ε. Nothing is taken from lower levels before, and joints that do not move the
tasks of the level stay free.

Source: the threshold is that of the step of Gauss and Newton, as in Pfeiffer, Escande, Gergondet and Kheddar
(2023), "The Hierarchical Newton's Method for Numerically Stable Prioritized Dynamic Control".
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.tolerances import (
    DEPENDENT_DIRECTION,
    FREE_DIRECTION_WEIGHT,
    REST_LEAST,
    THRESHOLD_FOUND,
)

_ROUNDS = 60  # of the fixed point of ε²; its first value is an upper bound, and each round lowers it


class Directions(NamedTuple):
    """Directions of one level that are damped.

    Attributes:
        threshold: ε², in the unit of σ²; 0 if nothing is damped.
        damped: k_i v_iᵀ for each damped direction, (r, n).
        gate: 1 − σ_min²/ε², 0 if nothing is damped.
    """

    threshold: float
    damped: Array
    gate: float


def damped_directions(
    A: Array, b: Array, groups: Sequence[IntArray], free: Array, dt: float, before: Array | None = None
) -> Directions:
    """Return the damping of one level.

    Args:
        A: Rows of the level, each times √w, (m, n).
        b: Right-hand sides, each times √w, less what the held directions contribute, (m,).
        groups: Indices of the curved rows, by task and unit.
        free: Orthonormal basis of the directions that are free, (n, f).
        dt: Δt [s].
        before: Basis of the directions that are free of limits, (n, e), levels before left out of account.
            What the level cannot do because a level before does it is no loss of rank to be damped. None for
            the same as `free`.

    Returns:
        The directions.
    """
    nothing = Directions(0.0, np.zeros((0, A.shape[1])), 0.0)
    if not free.shape[1] or not groups:
        return nothing
    U, sigma, Vt = np.linalg.svd(A @ free, full_matrices=False)
    inside = U.T @ b
    levers = [float(np.linalg.norm(A[rows], axis=0).max()) for rows in groups]

    def threshold(left: Array) -> float:
        """Return Δt Σ R ‖r‖ for what is left of b."""
        pairs = zip(levers, groups, strict=True)
        return dt * sum(lever * float(np.linalg.norm(left[rows])) for lever, rows in pairs)

    limit = threshold(b)
    for _ in range(_ROUNDS):
        if limit < REST_LEAST:
            return nothing
        lower = threshold(b - U @ (np.minimum(1.0, sigma**2 / limit) * inside))
        found, limit = lower > (1.0 - THRESHOLD_FOUND) * limit, lower
        if found:
            break
    weak = sigma**2 < limit
    if before is not None:
        size = float(np.linalg.norm(A))
        taken = max(0, _rank(A @ before, size) - _rank(A @ free, size))
        weak[len(sigma) - taken :] = False
    if limit < REST_LEAST or not weak.any():
        return nothing
    rows = np.sqrt(limit - sigma[weak] ** 2)[:, None] * (Vt[weak] @ free.T)
    return Directions(limit, rows, 1.0 - float(sigma[weak][-1]) ** 2 / limit)


def _rank(rows: Array, size: float) -> int:
    """Return the number of singular values that are more than rounding errors of rows of some size."""
    return int((np.linalg.svd(rows, compute_uv=False) > DEPENDENT_DIRECTION * size).sum())


def free_rows(held: Array, moved: Mask, gate: float, size: float) -> Array:
    """Return the rows √μ n that damp the free directions of a level in the level below.

    Args:
        held: All rows that are decided, those of the level and its damping included, (m, n).
        moved: True for each unknown that moves the level, (n,).
        gate: `Directions.gate`.
        size: The largest w ‖a‖² of a row of the level below.

    Returns:
        Rows, (f, n).
    """
    others = np.eye(held.shape[1])[~moved]
    return np.sqrt(FREE_DIRECTION_WEIGHT * gate * size) * null_space(np.vstack([held, others])).T


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
