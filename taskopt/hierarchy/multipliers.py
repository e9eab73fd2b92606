"""Multipliers for a bare x, so that anybody's array can be certified.

Level by level, the y that comes nearest to stationarity: rows that are equalities or violated take
either sign, rows at a bound take the sign of their side, all others none (non-negative least
squares, Lawson and Hanson 1974, Chapter 23). If x is the lexicographic optimum such y exist
(Dimitrov, Sherikov and Wieber 2015, Sect. 2), so a bad fit means a bad x.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from taskopt.arrays import Array, finite
from taskopt.hierarchy.certificate import Certificate, certify
from taskopt.hierarchy.problem import Hierarchy

NEAR = 1e-8  # a row is at its bound if it is nearer than this, relative to max(1, largest term)
_NOTHING = 1e-13  # a gradient below it needs no multipliers: it is stationary as it is
_RANK = 1e-10  # rows that depend on each other but for less take no multipliers of that size
_DECIDES = 1e-9  # as in the certificate: a violation below it settles nothing


def certify_velocity(hierarchy: Hierarchy, x: ArrayLike) -> Certificate:
    """The certificate of somebody's x (n,), with the multipliers that speak best for it.

    Raises `InvalidValue` for a wrong size or NaN.
    """
    value = finite("x", x, (hierarchy.n,))
    return certify(hierarchy, value, find_multipliers(hierarchy, value))


def find_multipliers(hierarchy: Hierarchy, x: Array, near: float = NEAR) -> Array:
    """y (levels + 1, n + M), box first, then rows, the last line for the norm; x finite, (n,)."""
    n, offsets = hierarchy.n, hierarchy.layout.offsets
    levels = hierarchy.layout.level_count
    G = np.vstack([np.eye(n), hierarchy.A])
    settled, side = _standing(hierarchy, x, G, near)
    y = np.zeros((levels + 1, len(G)))
    for k in range(levels + 1):
        before = n + int(offsets[k + 1])
        if k < levels:
            level = hierarchy.level(k + 1)
            gradient = level.A.T @ (level.weight * level.distance(x))
        else:
            gradient = hierarchy.norm_matrix() @ x
        if np.abs(gradient).max() <= _NOTHING:
            continue
        free = np.flatnonzero(settled[:before])
        signed = np.flatnonzero(~settled[:before] & (side[:before] != 0))
        y[k, free], y[k, signed] = _fit(gradient, G[free], G[signed], side[signed])
    return y


def _standing(hierarchy: Hierarchy, x: Array, G: Array, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Which rows may take either sign, and at which bound (-1, 0, +1) each stands."""
    lower = np.concatenate([hierarchy.box_lower, hierarchy.lower])
    upper = np.concatenate([hierarchy.box_upper, hierarchy.upper])
    value = G @ x
    scale = np.maximum(1.0, np.abs(G * x).max(axis=1))
    gap = np.maximum(lower - value, value - upper)
    soft = np.arange(len(G)) >= hierarchy.n + hierarchy.layout.offsets[1]
    settled = (lower == upper) | (soft & (gap > _DECIDES * scale))
    to_lower, to_upper = np.abs(value - lower), np.abs(upper - value)
    side = np.where(to_upper <= to_lower, 1, -1)
    side[np.minimum(to_lower, to_upper) > near * scale] = 0
    return settled, side


def _fit(gradient: Array, free: Array, signed: Array, side: Array) -> tuple[Array, Array]:
    """y of free and of signed rows with least ‖gradient + freeᵀ y + signedᵀ y'‖, y' on its side."""
    price = np.zeros(len(signed))
    if len(signed):
        rest, columns = gradient, (signed * side[:, None]).T
        if len(free):
            _, sigma, Vt = np.linalg.svd(free, full_matrices=False)
            basis = Vt[sigma > _RANK * sigma[0]]
            rest = rest - basis.T @ (basis @ rest)
            columns = columns - basis.T @ (basis @ columns)
        if np.abs(rest).max() > 1e-14 * np.abs(gradient).max():
            price = side * _non_negative(columns, -rest)
    if not len(free):
        return np.empty(0), price
    left = gradient + signed.T @ price
    return np.asarray(np.linalg.lstsq(free.T, -left, rcond=_RANK)[0], dtype=np.float64), np.asarray(price)


def _non_negative(columns: Array, target: Array) -> Array:
    try:
        return nnls(columns, target, maxiter=30 * columns.shape[1])[0]
    except RuntimeError:  # it did not finish; no price at all is a fit that the certificate refuses
        return np.zeros(columns.shape[1])
