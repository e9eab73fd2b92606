"""Cholesky factorisation of the small dense matrices of one tick, with a test of its pivots.

For a handful of rows these loops are faster than a call into LAPACK, by columns and four rows at a
time; Golub and Van Loan (2013), "Matrix Computations", Sect. 4.2.
"""

import numpy as np

from taskopt.jit import kernel

PIVOT = 1e-7  # least relative pivot; with one refinement a solution is then right to about 1e-11


@kernel
def gram(S, m, n, K):
    """K = S Sᵀ (lower triangle) of the first m rows and n columns, two by two: each load serves twice."""
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
def cholesky(K, m, rows):
    """K = L Lᵀ in place (lower triangle, diagonal inverted); False where a relative pivot is below PIVOT.

    The rows after the first m, up to `rows`, hold a matrix B; they become B L⁻ᵀ.
    """
    for b in range(m):
        pivot = K[b, b] - dot_rows(K, b, K, b, b)
        if not pivot > PIVOT * K[b, b]:
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
def forward(K, b, m):
    """b ← L⁻¹ b, K as `cholesky` left it."""
    for a in range(m):
        b[a] = (b[a] - dot_row(K, a, b, a)) * K[a, a]


@kernel
def backward(K, b, m):
    """b ← L⁻ᵀ b, K as `cholesky` left it."""
    for a in range(m - 1, -1, -1):
        b[a] *= K[a, a]
        add_row(b, -b[a], K, a, a)


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
def add_row(x, factor, A, a, n):
    """x_j += factor · A_aj over the first n columns."""
    for j in range(n):
        x[j] += factor * A[a, j]


@kernel
def add_rows(x, factors, A, m, n):
    """x_j += Σ_a factors_a A_aj over the first m rows and n columns, four rows at a time."""
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
def copy_into(target, source):
    """target ← source; as an assignment to a slice, its check of sizes takes a second to compile."""
    for i in range(target.size):
        target[i] = source[i]
