"""Multipliers for an x that comes without any, so that every velocity has KKT residuals.

Level by level, the multipliers y with the smallest stationarity residual are fitted. Those of sign-free rows
may have either sign, those of other rows at a bound have the sign of their side, and those of rows away from
their bounds are zero (non-negative least squares, Lawson and Hanson 1974, "Solving Least Squares Problems",
Chapter 23). If x is the lexicographic optimum, y with residual zero exist (Dimitrov, Sherikov and Wieber
2015, Sect. 2), so that a bad fit means that x is not the optimum.
"""

import numpy as np
from scipy.optimize import nnls

from taskopt.arrays import Array, ArrayLike, IntArray, Mask, finite
from taskopt.hierarchy.certificate import Certificate, certify
from taskopt.hierarchy.intervals import excess, nearer_side
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.tolerances import AT_BOUND, FIT_DONE, FIT_RANK, FIT_VIOLATED, NO_GRADIENT

_ITERATIONS_PER_COLUMN = 30  # of the non-negative fit; SciPy's own 3 is too few for columns that nearly agree


def certify_velocity(hierarchy: Hierarchy, x: ArrayLike) -> Certificate:
    """Compute the certificate of any x, with the multipliers that fit it best.

    Args:
        hierarchy: The problem.
        x: The unknowns, (n,); for a robot joint velocities [rad/s, m/s].

    Returns:
        The certificate.

    Raises:
        InvalidValue: x has the wrong size, or an entry is not finite.
    """
    value = finite("x", x, (hierarchy.n,))
    return certify(hierarchy, value, find_multipliers(hierarchy, value))


def find_multipliers(hierarchy: Hierarchy, x: Array, near: float = AT_BOUND) -> Array:
    """Fit multipliers to x, level by level.

    Args:
        hierarchy: The problem.
        x: The unknowns, (n,), finite.
        near: Distance to a bound, relative to max(1, largest term of the row), up to which x counts as at the
            bound.

    Returns:
        Multipliers (levels + 1, n + M): one line for each level, that of the norm last; in each line those of
        the box first, then those of the rows.
    """
    n, offsets = hierarchy.n, hierarchy.layout.offsets
    levels = hierarchy.layout.level_count
    G = np.vstack([np.eye(n), hierarchy.A])
    sign_free, side = _roles(hierarchy, x, G, near)
    y = np.zeros((levels + 1, len(G)))
    for k in range(levels + 1):
        before = n + int(offsets[k + 1])
        if k < levels:
            level = hierarchy.level(k + 1)
            gradient = level.A.T @ (level.weight * level.distance(x))
        else:
            gradient = hierarchy.norm_matrix() @ x
        if np.abs(gradient).max() <= NO_GRADIENT:
            continue
        free = np.flatnonzero(sign_free[:before])
        signed = np.flatnonzero(~sign_free[:before] & (side[:before] != 0))
        y[k, free], y[k, signed] = _fit(gradient, G[free], G[signed], side[signed])
    return y


def _roles(hierarchy: Hierarchy, x: Array, G: Array, near: float) -> tuple[Mask, IntArray]:
    """Return (n + M,) True for sign-free rows of G, and (n + M,) the bound of each (−1 lower, 0, 1 upper)."""
    lower, upper = hierarchy.bounds()
    value = G @ x
    scale = np.maximum(1.0, np.abs(G * x).max(axis=1))
    soft = np.arange(len(G)) >= hierarchy.n + hierarchy.layout.offsets[1]
    violated = soft & (excess(value, lower, upper) > FIT_VIOLATED * scale)
    side = nearer_side(value, lower, upper)
    side[np.minimum(np.abs(value - lower), np.abs(upper - value)) > near * scale] = 0
    return (lower >= upper) | violated, side


def _fit(gradient: Array, free: Array, signed: Array, side: IntArray) -> tuple[Array, Array]:
    """Return y of free and y' of signed rows with least ‖gradient + freeᵀ y + signedᵀ y'‖, y' on its side."""
    y_signed = np.zeros(len(signed))
    if len(signed):
        rest, columns = gradient, (signed * side[:, None]).T
        if len(free):
            _, sigma, Vt = np.linalg.svd(free, full_matrices=False)
            basis = Vt[sigma > FIT_RANK * sigma[0]]
            rest = rest - basis.T @ (basis @ rest)
            columns = columns - basis.T @ (basis @ columns)
        if np.abs(rest).max() > FIT_DONE * np.abs(gradient).max():
            y_signed = side * _non_negative(columns, -rest)
    if not len(free):
        return np.empty(0), y_signed
    left = gradient + signed.T @ y_signed
    return np.asarray(np.linalg.lstsq(free.T, -left, rcond=FIT_RANK)[0], dtype=np.float64), y_signed


def _non_negative(columns: Array, target: Array) -> Array:
    """Return u ≥ 0 with the least ‖columns u − target‖, or zeros if the fit does not converge.

    With zeros the KKT residuals stay large, so that a fit that does not converge claims nothing.
    """
    try:
        return nnls(columns, target, maxiter=_ITERATIONS_PER_COLUMN * columns.shape[1])[0]
    except RuntimeError:
        return np.zeros(columns.shape[1])
