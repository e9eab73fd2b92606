"""Cholesky factorisation of the small dense matrices of one tick, with a test of its pivots.

For a handful of rows these loops are faster than a call into LAPACK; Golub and Van Loan (2013),
"Matrix Computations", Alg. 4.2.1.
"""

import numpy as np

from taskopt.jit import kernel

PIVOT = 1e-7  # least relative pivot; with one refinement a solution is then right to about 1e-11


@kernel
def cholesky(K, m):
    """K = L Lᵀ in place (lower triangle, diagonal inverted); False where a relative pivot is below PIVOT."""
    for a in range(m):
        diagonal = K[a, a]
        for b in range(a):
            K[a, b] = (K[a, b] - dot_rows(K, a, K, b, b)) * K[b, b]
        pivot = diagonal - dot_rows(K, a, K, a, a)
        if not pivot > PIVOT * diagonal:
            return False
        K[a, a] = 1.0 / np.sqrt(pivot)
    return True


@kernel
def cholesky_solve(K, b, m):
    """Solve L Lᵀ z = b in place, K as `cholesky` left it."""
    for a in range(m):
        b[a] = (b[a] - dot_row(K, a, b, a)) * K[a, a]
    for a in range(m - 1, -1, -1):
        value = b[a] * K[a, a]
        b[a] = value
        for c in range(a):
            b[c] -= K[a, c] * value


@kernel
def dot_rows(A, a, B, b, n):
    """Σ_j A_aj B_bj over the first n columns; a slice of an array would cost more than the sum."""
    total = 0.0
    for j in range(n):
        total += A[a, j] * B[b, j]
    return total


@kernel
def dot_row(A, a, x, n):
    """Σ_j A_aj x_j over the first n columns."""
    total = 0.0
    for j in range(n):
        total += A[a, j] * x[j]
    return total


@kernel
def copy_into(target, source):
    """target ← source; as an assignment to a slice, its check of sizes takes a second to compile."""
    for i in range(target.size):
        target[i] = source[i]
