"""Enclosures of inverses and of solutions of linear equations.

For any approximate inverse X of M with E = I − X M, ‖E‖∞ ≤ α < 1, both are regular, and for any V

    |M⁻¹ − V| = |(I − E)⁻¹ X (I − M V)| ≤ (I + |E| (I − |E|)⁻¹) |X| |I − M V|.

`docs/certificate.md` proves it.
"""

from collections.abc import Callable

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.proof.enclosure import Enclosure
from taskopt.hierarchy.tolerances import LARGEST_DEFECT, ROUNDED_UP

_CORRECTIONS = 8  # each gains the digits that the approximate inverse has right; more gain nothing


def inverse(M: Array) -> Enclosure | None:
    """Enclose the inverse of a matrix.

    Args:
        M: The matrix, (n, n).

    Returns:
        The inverse, (n, n); None if it is too near a singular one.
    """
    exact = Enclosure.exact(M)
    identity = np.eye(len(M))
    return solve(exact, lambda V: exact @ V - identity, np.zeros(M.shape))


def solve(M: Enclosure, defect: Callable[[Enclosure], Enclosure], start: Array) -> Enclosure | None:
    """Enclose the V at which `defect(V)` = M (V − V*) vanishes.

    Args:
        M: The matrix, (n, n).
        defect: Function that encloses the residual M V − F at exact numbers V.
        start: A first guess of V, (n, p).

    Returns:
        V*, (n, p); None if M is too near a singular matrix.
    """
    X = _approximate_inverse(M.middle)
    if X is None:
        return None
    E = (X @ M - np.eye(len(X))).size
    sums = ROUNDED_UP * E.sum(axis=1, initial=0.0)
    worst = sums.max(initial=0.0)
    if not worst < LARGEST_DEFECT:
        return None
    V, left = Enclosure.exact(start), defect(Enclosure.exact(start))
    for _ in range(_CORRECTIONS):
        corrected = (V - X @ left.middle).widened(np.zeros(start.shape))
        new = defect(corrected)
        if not new.size.max(initial=0.0) < 0.5 * left.size.max(initial=0.0):
            break
        V, left = corrected, new
    error = ROUNDED_UP * (np.abs(X) @ left.size)
    largest = error.max(axis=0, initial=0.0) / (1.0 - worst)
    return V.widened(ROUNDED_UP * (error + np.outer(sums, largest)))


def _approximate_inverse(M: Array) -> Array | None:
    """Return an inverse in doubles, or None if there is none."""
    try:
        X = np.asarray(np.linalg.inv(M), dtype=np.float64)
    except np.linalg.LinAlgError:
        return None
    return X if np.isfinite(X).all() else None
