"""The rows of damping of `taskopt.hierarchy.rest` by NumPy's singular values, to compare kernels with."""

from collections.abc import Sequence

import numpy as np

from taskopt import Hierarchy
from taskopt.arrays import Array, Mask, StateArray

RANK, ROUNDS, FOUND, LEAST, BELOW = 1e-9, 60, 1e-3, 1e-12, 1e4


def null_space(rows: Array) -> Array:
    """Return an orthonormal basis of what rows leave free, a direction in each column."""
    length = np.linalg.norm(rows, axis=1)
    unit = rows[length > 0.0] / length[length > 0.0, None]
    if not len(unit):
        return np.eye(rows.shape[1])
    _, sigma, Vt = np.linalg.svd(unit)
    return Vt[int((sigma > RANK).sum()) :].T


def rank(rows: Array, size: float) -> int:
    """Return the number of singular values beyond rounding of rows of a size."""
    return int((np.linalg.svd(rows, compute_uv=False) > RANK * size).sum())


def directions(
    A: Array, b: Array, groups: Sequence[Array], free: Array, before: Array, dt: float
) -> tuple[Array, float]:
    """Return the rows k v of a level, and the gate."""
    none = np.zeros((0, A.shape[1])), 0.0
    if not free.shape[1] or not groups:
        return none
    U, sigma, Vt = np.linalg.svd(A @ free, full_matrices=False)
    levers = [np.linalg.norm(A[rows], axis=0).max() for rows in groups]

    def threshold(left: Array) -> float:
        return dt * sum(R * np.linalg.norm(left[rows]) for R, rows in zip(levers, groups, strict=True))

    limit = threshold(b)
    for _ in range(ROUNDS):
        if limit < LEAST:
            return none
        last, limit = limit, threshold(b - U @ (sigma**2 / (sigma**2 + limit) * (U.T @ b)))
        if limit > (1.0 - FOUND) * last:
            break
    size = float(np.linalg.norm(A))
    taken = max(0, rank(A @ before, size) - rank(A @ free, size))
    weak = (sigma**2 < limit) & (np.arange(len(sigma)) < len(sigma) - taken)
    if limit < LEAST or not weak.any():
        return none
    rows = np.sqrt(limit - sigma[weak] ** 2)[:, None] * (Vt[weak] @ free.T)
    return rows, 1.0 - float(sigma[weak][-1]) ** 2 / limit


def damping_of(
    h: Hierarchy, groups: Array, x: Array, state: StateArray, joints: Mask, hard: Mask, dt: float
) -> dict[int, tuple[Array, Array]]:
    """Return, for each damped level of a declared hierarchy, its rows of damping, and those below.

    `joints` (n,) and `hard` (M₀,) say what holds, `groups` (M,) which rows are curved.
    """
    n, found, below = h.n, {}, np.zeros((0, h.n))
    decided = [np.eye(n)[joints], h.A[h.layout.rows_of_level(0)][hard]]
    unlimited = list(decided)
    for k in range(1, h.layout.level_count + 1):
        rows = np.arange(*h.layout.offsets[k : k + 2])
        side = state[n:][rows]
        kept = (h.lower[rows] == h.upper[rows]) | (side != 0)
        rows, side = rows[kept], side[kept]
        root = np.sqrt(h.weight[rows])
        A = np.vstack([root[:, None] * h.A[rows], below])
        b = np.r_[root * np.where(side < 0, h.lower[rows], h.upper[rows]), np.zeros(len(below))]
        own, below = groups[h.layout.rows_of_level(k)], np.zeros((0, n))
        if own.any():
            curved = h.A[h.layout.rows_of_level(k)][own > 0]
            still = np.eye(n)[np.linalg.norm(curved, axis=0) <= LEAST]
            free, before = (
                null_space(np.vstack([*decided, still])),
                null_space(np.vstack([*unlimited, still])),
            )
            left = b - A @ (x - free @ (free.T @ x))
            places = [np.flatnonzero(groups[rows] == g) for g in range(1, int(own.max()) + 1)]
            damped, gate = directions(A, left, [place for place in places if place.size], free, before, dt)
            decided.append(damped)
            if len(damped) and k < h.layout.level_count:
                after = h.layout.rows_of_level(k + 1)
                size = float((h.weight[after] * (h.A[after] ** 2).sum(axis=1)).max(initial=0.0))
                below = np.sqrt(BELOW * gate * size) * null_space(np.vstack([*decided, A, still])).T
            if len(damped):
                found[k] = damped, below
        decided.append(A)
    return found
