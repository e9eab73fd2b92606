"""Kernels for directions: singular values of a matrix, and the directions that some rows leave free.

Source: Golub and Van Loan (2013), "Matrix Computations", Sect. 5.4, for orthogonal factorisation with pivots.
"""

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.tolerances import DEPENDENT_DIRECTION
from taskopt.jit import kernel, kernel_apart

_ROUNDING = float(np.finfo(np.float64).eps)
_FEW = 16  # rows or columns
_SWEEPS = 30  # of rotations; six are enough, as a rule


@kernel_apart
def singular_values(M: Array) -> tuple[Array, Array, Array]:
    """Decompose M = U Σ Vᵀ with all right singular vectors.

    A matrix of a few rows or columns, for which LAPACK takes two or three times as long, is rotated in pairs
    of columns until all are at right angles. Where it has more columns than rows, reflections make the last
    ones zero first.

    Args:
        M: (m, p) matrix.

    Returns:
        U (m, min(m, p)) or (m, m), the singular values, falling, and Vᵀ (p, p).

    Source:
        Golub and Van Loan (2013), Sect. 8.6.3 (one-sided Jacobi), and Drmač and Veselić (2008), SIAM Journal
        on Matrix Analysis and Applications 29(4), for the factorisation before it.
    """
    m, p = M.shape
    count = min(m, p)
    if count > _FEW:
        return np.linalg.svd(M, m < p)
    Vt, T = np.eye(p), M.copy()
    if m < p:
        beta = np.zeros(m)
        for a in range(m):
            beta[a] = _reflect_rows_after(T, a)
        for j in range(p):
            _turn_by_reflections(T, beta, m, Vt[j])
        for a in range(m):  # what is left of the rows are their parts along the reflected columns
            for i in range(p):
                T[a, i] = 0.0
                for j in range(p):
                    T[a, i] += M[a, j] * Vt[i, j]
    G = T.T.copy()  # its rows are columns of the matrix
    squares = 0.0
    for i in range(count):
        squares += _dot(G[i], G[i])
    for _ in range(_SWEEPS):
        if not _rotate_all(G, Vt, count, _ROUNDING**2 * squares):
            break
    size = np.zeros(count)
    for i in range(count):
        size[i] = np.sqrt(_dot(G[i], G[i]))
    order, U, sigma = np.argsort(-size), np.zeros((m, count)), np.empty(count)
    turned = Vt[:count].copy()
    for a in range(count):
        i = order[a]
        sigma[a] = size[i]
        for j in range(p):
            Vt[a, j] = turned[i, j]
        for j in range(m):
            U[j, a] = G[i, j] / size[i] if size[i] > 0.0 else 0.0
    return U, sigma, Vt


@kernel
def _dot(u: Array, v: Array) -> float:
    """Return uᵀ v."""
    total = 0.0
    for j in range(u.size):
        total += u[j] * v[j]
    return total


@kernel
def _rotate_all(G: Array, Vt: Array, count: int, least: float) -> bool:
    """Rotate each two of the first rows of G, and of Vᵀ, to right angles; False if all of them are."""
    rotated = False
    for i in range(count - 1):
        for j in range(i + 1, count):
            alpha, beta, gamma = _dot(G[i], G[i]), _dot(G[j], G[j]), _dot(G[i], G[j])
            if alpha <= least or beta <= least or abs(gamma) <= _ROUNDING * np.sqrt(alpha * beta):
                continue
            rotated = True
            zeta = 0.5 * (beta - alpha) / gamma
            tangent = (1.0 if zeta >= 0.0 else -1.0) / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
            cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
            _rotate(G[i], G[j], cosine, cosine * tangent)
            _rotate(Vt[i], Vt[j], cosine, cosine * tangent)
    return rotated


@kernel
def _rotate(u: Array, v: Array, cosine: float, sine: float) -> None:
    """Rotate two rows."""
    for k in range(u.size):
        u[k], v[k] = cosine * u[k] - sine * v[k], sine * u[k] + cosine * v[k]


@kernel
def _turn_by_reflections(T: Array, beta: Array, rank: int, direction: Array) -> None:
    """Turn a direction by the reflections whose vectors stand in the first rows of T, the last one first."""
    for a in range(rank - 1, -1, -1):
        total = 0.0
        for j in range(a, direction.size):
            total += T[a, j] * direction[j]
        total *= beta[a]
        for j in range(a, direction.size):
            direction[j] -= total * T[a, j]


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
        _turn_by_reflections(T, beta, rank, direction)
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
    """Reflect the rows after row a by I − β v vᵀ, which leaves of that row one column; v takes its place.

    Returns β, which is 0 for a row of zeros.
    """
    squares = 0.0
    for j in range(a, T.shape[1]):
        squares += T[a, j] * T[a, j]
    size = np.sqrt(squares)
    if size == 0.0:
        return 0.0
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
