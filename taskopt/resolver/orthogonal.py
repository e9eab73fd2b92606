"""Orthogonal factorisation of small matrices by Householder reflections, and triangular systems.

For a few rows these loops are faster than a call of LAPACK. Source: Golub and Van Loan (2013), "Matrix
Computations", Sect. 5.2.
"""

import numpy as np

from taskopt.arrays import Array
from taskopt.jit import kernel
from taskopt.resolver.active_set.linalg import dot_row


@kernel
def reflect(B: Array, beta: Array, diagonal: Array) -> None:
    """Factorise B = L Qᵀ (r, s), r ≤ s, by reflections I − β v vᵀ.

    Args:
        B: (r, s) rows; overwritten by L below the diagonal, and by each v from the diagonal on.
        beta: (r,) filled with β.
        diagonal: (r,) filled with the diagonal of L.
    """
    r, s = B.shape
    for a in range(r):
        squares = 0.0
        for c in range(a, s):
            squares += B[a, c] * B[a, c]
        size = np.sqrt(squares)
        diagonal[a] = -size if B[a, a] > 0.0 else size
        B[a, a] -= diagonal[a]
        beta[a] = -1.0 / (diagonal[a] * B[a, a]) if size > 0.0 else 0.0
        for i in range(a + 1, r):
            total = 0.0
            for c in range(a, s):
                total += B[i, c] * B[a, c]
            total *= beta[a]
            for c in range(a, s):
                B[i, c] -= total * B[a, c]


@kernel
def least_exceeds(B: Array, diagonal: Array, threshold: float) -> bool:
    """Return True if 1/‖L⁻¹‖_F exceeds a threshold; all singular values of L do so then, too.

    Args:
        B: As `reflect` left it.
        diagonal: As `reflect` left it.
        threshold: The threshold, ≥ 0.

    Returns:
        False if it may be that a singular value does not exceed the threshold.
    """
    r = diagonal.size
    column, squares = np.empty(r), 0.0
    for b in range(r):
        column[b] = 1.0 / diagonal[b]
        squares += column[b] * column[b]
        for a in range(b + 1, r):
            total = 0.0
            for c in range(b, a):
                total += B[a, c] * column[c]
            column[a] = -total / diagonal[a]
            squares += column[a] * column[a]
    return bool(squares * (threshold * threshold) < 1.0)


@kernel
def reflect_rows(B: Array, a: int, beta: float, basis: Array) -> None:
    """Apply reflection a to the rows of a basis; all of them in order replace it by Qᵀ times it.

    Args:
        B: As `reflect` left it.
        a: Number of the reflection.
        beta: Its β.
        basis: (≥ s, n) rows, of which the first s are changed.
    """
    n, s = basis.shape[1], B.shape[1]
    sums = np.zeros(n)
    for i in range(a, s):
        for c in range(n):
            sums[c] += B[a, i] * basis[i, c]
    for i in range(a, s):
        factor = beta * B[a, i]
        for c in range(n):
            basis[i, c] -= factor * sums[c]


@kernel
def reflect_vector(B: Array, beta: Array, y: Array) -> None:
    """Replace y by Qᵀ y.

    Args:
        B: As `reflect` left it.
        beta: As `reflect` left it.
        y: (s,) vector.
    """
    for a in range(beta.size):
        total = 0.0
        for c in range(a, y.size):
            total += B[a, c] * y[c]
        total *= beta[a]
        for c in range(a, y.size):
            y[c] -= total * B[a, c]


@kernel
def solve_lower(B: Array, diagonal: Array, y: Array) -> None:
    """Replace the first r entries of y by L⁻¹ y.

    Args:
        B: As `reflect` left it.
        diagonal: As `reflect` left it.
        y: (≥ r,) vector.
    """
    for a in range(diagonal.size):
        y[a] = (y[a] - dot_row(B, a, y, a)) / diagonal[a]


@kernel
def solve_upper(B: Array, diagonal: Array, y: Array) -> None:
    """Replace the first r entries of y by L⁻ᵀ y.

    Args:
        B: As `reflect` left it.
        diagonal: As `reflect` left it.
        y: (≥ r,) vector.
    """
    for a in range(diagonal.size - 1, -1, -1):
        y[a] /= diagonal[a]
        for c in range(a):
            y[c] -= y[a] * B[a, c]


@kernel
def solve_damped(B: Array, diagonal: Array, squared: float, lower: bool, y: Array) -> None:
    """Replace the first r entries of y by the y' with the least ‖T y' − y‖² + k² ‖y'‖².

    Args:
        B: As `reflect` left it.
        diagonal: As `reflect` left it.
        squared: k².
        lower: True for T = L, False for T = Lᵀ.
        y: (≥ r,) vector.
    """
    r = diagonal.size
    stacked, beta, own, side = np.zeros((r, 2 * r)), np.empty(r), np.empty(r), np.zeros(2 * r)
    for a in range(r):
        side[a] = y[a]
        stacked[a, r + a] = np.sqrt(squared)
        for c in range(a + 1):
            entry = diagonal[a] if c == a else B[a, c]
            if lower:
                stacked[c, a] = entry
            else:
                stacked[a, c] = entry
    reflect(stacked, beta, own)
    reflect_vector(stacked, beta, side)
    solve_upper(stacked, own, side)
    for a in range(r):
        y[a] = side[a]
