"""Kernels for directions: singular values of a matrix, and the directions that some rows leave free.

Source: Golub and Van Loan (2013), "Matrix Computations", Sect. 5.4, for orthogonal factorisation with pivots.
"""

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.tolerances import DEPENDENT_DIRECTION
from taskopt.jit import kernel, kernel_apart


@kernel
def singular_values(M: Array) -> tuple[Array, Array, Array]:
    """Decompose M = U Σ Vᵀ with all right singular vectors, also of a matrix with one column or none.

    Args:
        M: (m, p) matrix, m > 0.

    Returns:
        U (m, min(m, p)) or (m, m), the singular values, falling, and Vᵀ (p, p).
    """
    m, p = M.shape
    if p > 1:
        U, sigma, Vt = np.linalg.svd(M, m < p)
    else:
        U, sigma, Vt = np.zeros((m, p)), np.zeros(p), np.ones((p, p))
        for a in range(p):
            largest = 0.0
            for i in range(m):
                largest = max(largest, abs(M[i, a]))
            squares = 0.0
            for i in range(m):
                U[i, a] = M[i, a] / largest if largest > 0.0 else 0.0
                squares += U[i, a] * U[i, a]
            size = np.sqrt(squares)
            sigma[a] = largest * size
            for i in range(m):
                U[i, a] /= size if size > 0.0 else 1.0
    return U, sigma, Vt


@kernel_apart
def null_space(rows: Array, count: int, columns: Mask) -> Array:
    """Return an orthonormal basis of the directions within some columns that rows leave free.

    The rows are reflected one after the other, that which is least dependent on those before it first, until
    what remains of each is a `DEPENDENT_DIRECTION` of its length at most.

    Args:
        rows: Rows of any length in its first `count` rows, (≥ count, n).
        count: Number m of rows.
        columns: True for each unknown that may move, (n,).

    Returns:
        The basis, a direction in each row, (f, n).
    """
    T, open_columns = _unit_rows(rows, count, columns)
    m, c = T.shape
    beta, rank = np.zeros(min(m, c)), 0
    while rank < beta.size and _bring_largest(T, rank):
        beta[rank] = _reflect_rows_after(T, rank)
        rank += 1
    basis = np.zeros((c - rank, columns.size))
    direction = np.empty(c)
    for f in range(c - rank):
        for j in range(c):
            direction[j] = 1.0 if j == rank + f else 0.0
        for a in range(rank - 1, -1, -1):
            total = 0.0
            for j in range(a, c):
                total += T[a, j] * direction[j]
            total *= beta[a]
            for j in range(a, c):
                direction[j] -= total * T[a, j]
        for j in range(c):
            basis[f, open_columns[j]] = direction[j]
    return basis


@kernel
def _unit_rows(rows: Array, count: int, columns: Mask) -> tuple[Array, IntArray]:
    """Return the rows, each divided by its length, within some columns; and the indices of these columns."""
    n, c, m = columns.size, 0, 0
    places = np.empty(n, np.int64)
    for j in range(n):
        if columns[j]:
            places[c] = j
            c += 1
    T = np.empty((count, c))
    for i in range(count):
        squares = 0.0
        for j in range(n):
            squares += rows[i, j] * rows[i, j]
        if squares > 0.0:
            for j in range(c):
                T[m, j] = rows[i, places[j]] / np.sqrt(squares)
            m += 1
    return T[:m], places


@kernel
def _bring_largest(T: Array, rank: int) -> bool:
    """Exchange row `rank` for the one with most left from that column on; False if nothing is left of any."""
    largest, place = DEPENDENT_DIRECTION**2, -1
    for i in range(rank, T.shape[0]):
        squares = 0.0
        for j in range(rank, T.shape[1]):
            squares += T[i, j] * T[i, j]
        if squares > largest:
            largest, place = squares, i
    if place < 0:
        return False
    for j in range(T.shape[1]):
        T[rank, j], T[place, j] = T[place, j], T[rank, j]
    return True


@kernel
def _reflect_rows_after(T: Array, a: int) -> float:
    """Reflect the rows after row a by I − β v vᵀ, which leaves of that row one column; v takes its place."""
    squares = 0.0
    for j in range(a, T.shape[1]):
        squares += T[a, j] * T[a, j]
    size = np.sqrt(squares)
    pivot = T[a, a]
    T[a, a] += size if pivot > 0.0 else -size
    beta = 1.0 / (size * (size + abs(pivot)))
    for i in range(a + 1, T.shape[0]):
        total = 0.0
        for j in range(a, T.shape[1]):
            total += T[i, j] * T[a, j]
        total *= beta
        for j in range(a, T.shape[1]):
            T[i, j] -= total * T[a, j]
    return beta
