"""Kernels of the weighted problem: its rows, and its program in the unknowns u = R x."""

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.view import Rows, view_box, view_rows
from taskopt.jit import kernel, kernel_apart
from taskopt.resolver.orthogonal import reflect, reflect_vector, solve_lower, solve_upper


@kernel_apart
def weigh_rows(buffer: Array, norm: Array, offsets: IntArray, n: int, ratio: float, weighted: Array) -> None:
    """Write all levels of a hierarchy as one level, followed by n rows of the norm.

    Args:
        buffer: Flat buffer of the hierarchy (see `taskopt.hierarchy.view`).
        norm: Diagonal of W (n,), or its root L with W = Lᵀ L row by row (n · n,).
        offsets: First rows of the levels, (levels + 2,).
        n: Number of unknowns.
        ratio: Weight of a level over the weight of the level before it.
        weighted: Flat buffer of the weighted problem, filled.
    """
    count, levels = offsets[-1], offsets.size - 2
    diagonal = norm.size == n
    given = view_rows(buffer, n, norm, offsets, np.empty(count, np.int64))
    made = view_rows(weighted, n, norm, offsets, np.empty(count + n, np.int64))
    k = 0
    for i in range(count):
        while i >= offsets[k + 1]:
            k += 1
        for j in range(n):
            made.A[i, j] = given.A[i, j]
        made.lower[i], made.upper[i], made.label[i] = given.lower[i], given.upper[i], given.label[i]
        made.weight[i] = given.weight[i] * ratio ** float(max(k, 1) - 1 - levels)
    for i in range(n):
        for j in range(n):
            made.A[count + i, j] = (1.0 if i == j else 0.0) if diagonal else norm[i * n + j]
        made.lower[count + i], made.upper[count + i], made.label[count + i] = 0.0, 0.0, 0.0
        made.weight[count + i] = norm[i] if diagonal else 1.0
    given_box, made_box = view_box(buffer, n), view_box(weighted, n)
    for i in range(4):
        for j in range(n):
            made_box[i, j] = given_box[i, j]


@kernel_apart
def orthogonal_rows(
    buffer: Array, n: int, offsets: IntArray
) -> tuple[Array, Array, Array, Array, Array, Array]:  # fmt: skip
    """Write the program min ½ ‖u − Qᵀ c‖² + ½ ‖t‖² of a weighted problem, where √w A = Q R and c = √w b.

    Args:
        buffer: Flat buffer of a hierarchy of one level, whose equality rows have full column rank.
        n: Number of unknowns.
        offsets: First row of its hard rows, of its level, and the end, (3,).

    Returns:
        Rᵀ below the diagonal of a larger matrix, and its diagonal, as `reflect` leaves them; the linear term
        (n + m,); the rows (p, n + m) and their bounds (p,).
    """
    count, hard = offsets[2], offsets[1]
    problem = view_rows(buffer, n, buffer, offsets, np.empty(count, np.int64))
    B, diagonal, side = _equalities(problem, n, hard)
    soft = count - hard - B.shape[1]
    g, C = np.zeros(n + soft), np.zeros((n + hard + soft, n + soft))
    lower, upper = np.empty(n + hard + soft), np.empty(n + hard + soft)
    for j in range(n):
        g[j] = -side[j]
    p, slack = 0, n
    for i in range(n + count):
        row = i - n
        below = problem.box_lower[i] if row < 0 else problem.lower[row]
        above = problem.box_upper[i] if row < 0 else problem.upper[row]
        is_soft = row >= hard
        if is_soft and below == above:
            continue
        if below > -np.inf or above < np.inf:
            root = np.sqrt(problem.weight[row]) if is_soft else 1.0
            for j in range(n):
                C[p, j] = root * problem.A[row, j] if row >= 0 else (1.0 if i == j else 0.0)
            solve_lower(B, diagonal, C[p])
            lower[p], upper[p] = root * below, root * above
            if is_soft:
                C[p, slack] = -1.0
            p += 1
        slack += is_soft
    return B, diagonal, g, C[:p], lower[:p], upper[:p]


@kernel
def _equalities(problem: Rows, n: int, hard: int) -> tuple[Array, Array, Array]:
    """Factorise √w A = Q R of the equality rows of the level; return Rᵀ, its diagonal, and Qᵀ √w b."""
    m = 0
    for i in range(hard, problem.lower.size):
        m += problem.lower[i] == problem.upper[i]
    B, side, e = np.empty((n, m)), np.empty(m), 0
    for i in range(hard, problem.lower.size):
        if problem.lower[i] == problem.upper[i]:
            root = np.sqrt(problem.weight[i])
            side[e] = root * problem.upper[i]
            for j in range(n):
                B[j, e] = root * problem.A[i, j]
            e += 1
    beta, diagonal = np.empty(n), np.empty(n)
    reflect(B, beta, diagonal)
    reflect_vector(B, beta, side)
    return B, diagonal, side


@kernel_apart
def unknowns_of(B: Array, diagonal: Array, u: Array) -> Array:
    """Return x with R x = u.

    Args:
        B: As `orthogonal_rows` returned it.
        diagonal: As `orthogonal_rows` returned it.
        u: (≥ n,) solution of the program.

    Returns:
        x (n,).
    """
    x = u[: diagonal.size].copy()
    solve_upper(B, diagonal, x)
    return x


@kernel_apart
def inverse_of(B: Array, diagonal: Array) -> Array:
    """Return R⁻¹.

    Args:
        B: As `orthogonal_rows` returned it.
        diagonal: As `orthogonal_rows` returned it.

    Returns:
        R⁻¹ (n, n).
    """
    n = diagonal.size
    inverse, column = np.empty((n, n)), np.empty(n)
    for j in range(n):
        for i in range(n):
            column[i] = 1.0 if i == j else 0.0
        solve_upper(B, diagonal, column)
        for i in range(n):
            inverse[i, j] = column[i]
    return inverse
