"""Cholesky factorisation of the small dense matrices of one tick, with a test of its pivots.

For a few rows these loops, which work by columns and on four rows at a time, are faster than a call of
LAPACK. Source: Golub and Van Loan (2013), "Matrix Computations", Sect. 4.2.
"""

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.tolerances import FAST_PATH_PIVOT
from taskopt.jit import kernel


@kernel
def gram(S: Array, m: int, n: int, K: Array) -> None:
    """Compute the lower triangle of K = S Sᵀ in 2 × 2 blocks, so that each loaded value is used twice.

    Args:
        S: (≥ m, ≥ n) matrix, of which the first m rows and n columns are read.
        m: Number of rows.
        n: Number of columns.
        K: (≥ m, ≥ m) receives the lower triangle, and the upper entries of the 2 × 2 blocks on the diagonal.
    """
    for a in range(0, m - 1, 2):
        for b in range(0, a + 1, 2):
            aa, ab, ba, bb = 0.0, 0.0, 0.0, 0.0
            for j in range(n):
                aa += S[a, j] * S[b, j]
                ab += S[a, j] * S[b + 1, j]
                ba += S[a + 1, j] * S[b, j]
                bb += S[a + 1, j] * S[b + 1, j]
            K[a, b], K[a, b + 1], K[a + 1, b], K[a + 1, b + 1] = aa, ab, ba, bb
    if m % 2 == 1:
        for b in range(m):
            K[m - 1, b] = dot_rows(S, m - 1, S, b, n)


@kernel
def cholesky(K: Array, m: int, rows: int) -> bool:
    """Factorise K = L Lᵀ in place, storing the inverse of L's diagonal; replace the rows B below K by B L⁻ᵀ.

    Args:
        K: (≥ rows, ≥ m) with the lower triangle of K in its first m rows, and B in those up to `rows`.
        m: Size of K.
        rows: m plus the number of rows of B.

    Returns:
        False if a pivot is at most FAST_PATH_PIVOT times its diagonal entry; K is then only partly
        factorised.
    """
    for b in range(m):
        pivot = K[b, b] - dot_rows(K, b, K, b, b)
        if not pivot > FAST_PATH_PIVOT * K[b, b]:
            return False
        inverse = 1.0 / np.sqrt(pivot)
        K[b, b] = inverse
        a = b + 1
        while a + 4 <= rows:
            first, second, third, fourth = 0.0, 0.0, 0.0, 0.0
            for c in range(b):
                first += K[a, c] * K[b, c]
                second += K[a + 1, c] * K[b, c]
                third += K[a + 2, c] * K[b, c]
                fourth += K[a + 3, c] * K[b, c]
            K[a, b] = (K[a, b] - first) * inverse
            K[a + 1, b] = (K[a + 1, b] - second) * inverse
            K[a + 2, b] = (K[a + 2, b] - third) * inverse
            K[a + 3, b] = (K[a + 3, b] - fourth) * inverse
            a += 4
        while a < rows:
            K[a, b] = (K[a, b] - dot_rows(K, a, K, b, b)) * inverse
            a += 1
    return True


@kernel
def forward(K: Array, b: Array, m: int) -> None:
    """Replace the first m entries of b by L⁻¹ b, with K as `cholesky` left it.

    Args:
        K: (m, m) factor as `cholesky` left it: lower triangle L with an inverted diagonal.
        b: (m,) right-hand side, overwritten by the solution.
        m: Size of the factor.
    """
    for a in range(m):
        b[a] = (b[a] - dot_row(K, a, b, a)) * K[a, a]


@kernel
def backward(K: Array, b: Array, m: int) -> None:
    """Replace the first m entries of b by L⁻ᵀ b, with K as `cholesky` left it.

    Args:
        K: (m, m) factor as `cholesky` left it: lower triangle L with an inverted diagonal.
        b: (m,) right-hand side, overwritten by the solution.
        m: Size of the factor.
    """
    for a in range(m - 1, -1, -1):
        b[a] *= K[a, a]
        add_row(b, -b[a], K, a, a)


@kernel
def dot_rows(A: Array, a: int, B: Array, b: int, n: int) -> float:
    """Return Σ_j A_aj B_bj over the first n columns; a slice of an array would cost more than the sum.

    Args:
        A: Matrix with the first row.
        a: Index of that row.
        B: Matrix with the second row.
        b: Index of that row.
        n: Number of columns.

    Returns:
        The sum.
    """
    total = 0.0
    for j in range(n):
        total += A[a, j] * B[b, j]
    return total


@kernel
def dot_row(A: Array, a: int, x: Array, n: int) -> float:
    """Return Σ_j A_aj x_j over the first n columns.

    Args:
        A: Matrix with the row.
        a: Index of the row.
        x: Vector.
        n: Number of columns.

    Returns:
        The sum.
    """
    total = 0.0
    for j in range(n):
        total += A[a, j] * x[j]
    return total


@kernel
def add_row(x: Array, factor: float, A: Array, a: int, n: int) -> None:
    """Add factor · A_aj to x_j for the first n columns j.

    Args:
        x: (n,) vector, changed.
        factor: Factor of the row.
        A: Matrix with the row.
        a: Index of the row.
        n: Number of columns.
    """
    for j in range(n):
        x[j] += factor * A[a, j]


@kernel
def add_rows(x: Array, factors: Array, A: Array, m: int, n: int) -> None:
    """Add Σ_a factors_a A_aj to x_j for the first m rows a and n columns j, four rows at a time.

    Args:
        x: (n,) vector, changed.
        factors: (m,) factor of each row.
        A: Matrix with the rows.
        m: Number of rows.
        n: Number of columns.
    """
    a = 0
    while a + 4 <= m:
        first, second, third, fourth = factors[a], factors[a + 1], factors[a + 2], factors[a + 3]
        for j in range(n):
            x[j] += first * A[a, j] + second * A[a + 1, j] + third * A[a + 2, j] + fourth * A[a + 3, j]
        a += 4
    while a < m:
        add_row(x, factors[a], A, a, n)
        a += 1


@kernel
def row_values(A: Array, x: Array, value: Array) -> None:
    """Set value = A x, row by row.

    Args:
        A: (M, n) rows.
        x: (n,) unknowns.
        value: (M,) filled.
    """
    for i in range(value.size):
        total = 0.0
        for j in range(x.size):
            total += A[i, j] * x[j]
        value[i] = total


@kernel
def copy_into(target: Array | StateArray, source: Array | StateArray) -> None:
    """Copy `source` into `target`, since the assignment to a slice would take a second to compile.

    Args:
        target: Array that is overwritten.
        source: Array of the same size.
    """
    for i in range(target.size):
        target[i] = source[i]
