"""Kernels of task priority, x_k = x_{k−1} + N_{k−1} (J_k N_{k−1})† (v_k − J_k x_{k−1}).

They work on z = L x with W = Lᵀ L and on rows multiplied by √w, in which weights and norm are the identity.
An orthonormal basis of the null space stands in the rows of `basis`, of which the first p count.

A level M = J N is first factorised by Householder reflections, M = L Qᵀ or M = Q R. Its rank is certainly
full if 1/‖L⁻¹‖_F, which no singular value falls below, exceeds the threshold above which directions are
regained. Otherwise singular values decide, which come from LAPACK.

Source: Siciliano and Slotine (1991), ICAR; two levels are (3.54). Golub and Van Loan (2013), "Matrix
Computations", Sect. 5.2.
"""

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.directions import singular_values
from taskopt.hierarchy.view import Rows, view_rows
from taskopt.jit import kernel, kernel_apart
from taskopt.resolver.active_set.linalg import dot_row
from taskopt.resolver.orthogonal import (
    least_exceeds,
    reflect,
    reflect_rows,
    reflect_vector,
    solve_damped,
    solve_lower,
    solve_upper,
)

Settings = tuple[float, float, float]  # lost and regained of the rank rule, and k²
_UNKNOWN = -1  # the rank of the last tick, if there was none


@kernel_apart
def descend_kernel(
    buffer: Array, scaling: Array, offsets: IntArray, settings: Settings, before: IntArray, x: Array,
    ranks: IntArray,
) -> None:  # fmt: skip
    """Resolve the equalities of a hierarchy by task priority with a constant damping.

    Args:
        buffer: Flat buffer of the hierarchy (see `taskopt.hierarchy.view`).
        scaling: As of `taskopt.resolver.descent.scaling_of`.
        offsets: First rows of the levels, (levels + 2,).
        settings: `lost` and `regained` of the rank rule, and k².
        before: Ranks of the levels in the last tick, the hard rows first; as many as are known.
        x: (n,) filled with the answer.
        ranks: (levels + 1,) filled with the rank of each level.
    """
    lost, regained, squared = settings
    n, count = x.size, offsets[-1]
    problem = view_rows(buffer, n, scaling, offsets, np.empty(count, np.int64))
    A, b, weight = np.empty((n + count, n)), np.empty(n + count), np.empty(n + count)
    z, basis, free = np.zeros(n), np.eye(n), n
    for k in range(ranks.size):
        m = equalities_of_level(problem, k, A, b, weight)
        ranks[k] = 0
        if m > 0:
            M, _, missing, scale = projected(A[:m], b[:m], weight[:m], scaling, z, basis, free)
            if regular_step(M, missing, regained * scale, squared, z, basis, free):
                ranks[k] = min(m, free)
                free -= ranks[k]
            else:
                last = before[k] if k < before.size else _UNKNOWN
                M, _, missing, _ = projected(A[:m], b[:m], weight[:m], scaling, z, basis, free)
                U, sigma, Vt = singular_values(M)
                ranks[k] = rank_of(sigma, lost * scale, regained * scale, last)
                free = advance(U, sigma, Vt, missing, np.full(ranks[k], squared), z, basis, free)
    scale_back(z, scaling, x)


@kernel
def equalities_of_level(problem: Rows, k: int, A: Array, b: Array, weight: Array) -> int:
    """Collect the equality rows of one level; the hard ones begin with the fixed unknowns.

    Args:
        problem: The views of a hierarchy.
        k: 0 for the hard rows, 1 for the first priority, and so on.
        A: (≥ m, n) filled with the rows.
        b: (≥ m,) filled with the right-hand sides.
        weight: (≥ m,) filled with the weights, 1 for hard rows.

    Returns:
        Their number m.
    """
    m = 0
    if k == 0:
        for j in range(A.shape[1]):
            if problem.box_lower[j] == problem.box_upper[j]:
                for c in range(A.shape[1]):
                    A[m, c] = 1.0 if c == j else 0.0
                b[m], weight[m] = problem.box_upper[j], 1.0
                m += 1
    for i in range(problem.offsets[k], problem.offsets[k + 1]):
        if problem.lower[i] == problem.upper[i]:
            for c in range(A.shape[1]):
                A[m, c] = problem.A[i, c]
            b[m], weight[m] = problem.upper[i], problem.weight[i] if k > 0 else 1.0
            m += 1
    return m


@kernel_apart
def level_svd(
    A: Array, b: Array, weight: Array, scaling: Array, z: Array, basis: Array, free: int
) -> tuple[Array, Array, Array, Array, Array, float]:  # fmt: skip
    """Decompose one level of equalities into singular values, in the null space of the levels before.

    Args:
        A: (m, n) rows, m > 0.
        b: (m,) right-hand sides.
        weight: (m,) weights.
        scaling: As of `taskopt.resolver.descent.scaling_of`.
        z: (n,) answer of the levels before, L x.
        basis: (n, n) basis of their null space in its first rows.
        free: Number p of these rows.

    Returns:
        U, singular values and Vᵀ as of `singular_values`; √w b, what of it is missing at z, and the size of
        the rows (see `taskopt.hierarchy.rank.row_scale`).
    """
    M, v, missing, scale = projected(A, b, weight, scaling, z, basis, free)
    U, sigma, Vt = singular_values(M)
    return U, sigma, Vt, v, missing, scale


@kernel
def projected(
    A: Array, b: Array, weight: Array, scaling: Array, z: Array, basis: Array, free: int
) -> tuple[Array, Array, Array, float]:  # fmt: skip
    """Return a level in the null space of the levels before.

    Args:
        A: As of `level_svd`.
        b: As of `level_svd`.
        weight: As of `level_svd`.
        scaling: As of `level_svd`.
        z: As of `level_svd`.
        basis: As of `level_svd`.
        free: As of `level_svd`.

    Returns:
        M = J N (m, p); √w b, what of it is missing at z, and the size of the rows.
    """
    m, n = A.shape
    J, M, v, missing = np.empty(n), np.empty((m, free)), np.empty(m), np.empty(m)
    scale = 0.0
    for i in range(m):
        root = np.sqrt(weight[i])
        v[i] = root * b[i]
        scale_row(A, i, root, scaling, J)
        squares, value = 0.0, 0.0
        for c in range(n):
            squares += J[c] * J[c]
            value += J[c] * z[c]
        missing[i] = v[i] - value
        scale = max(scale, root, np.sqrt(squares))
        for a in range(free):
            M[i, a] = dot_row(basis, a, J, n)
    return M, v, missing, scale


@kernel
def regular_step(
    M: Array, missing: Array, threshold: float, squared: float, z: Array, basis: Array, free: int
) -> bool:  # fmt: skip
    """Do what `advance` does by orthogonal reflections, if the rank of a level is certainly full.

    With fewer rows than directions M = L Q₁ᵀ, and the directions Q₁ move by y with L y = d. Otherwise
    M = Q₁ Lᵀ, and y is the solution of Lᵀ y = Q₁ᵀ d. Damping minimises ‖L y − d‖² + k² ‖y‖², or the same with
    Lᵀ and Q₁ᵀ d.

    Args:
        M: (m, p) rows in the null space; overwritten if m ≤ p.
        missing: (m,) the right-hand side d, which they miss at z.
        threshold: Value that all singular values must exceed.
        squared: k² of the damping.
        z: (n,) moved.
        basis: (n, n) basis in its first p rows; its first p − min(m, p) rows are those of the new basis.
        free: Number p of these rows.

    Returns:
        False if a singular value may not exceed the threshold; z and the basis are unchanged then.
    """
    m, n = missing.size, z.size
    r, wide = min(m, free), m <= free
    B = M if wide else np.ascontiguousarray(M.T)
    beta, diagonal, y = np.empty(r), np.empty(r), missing.copy()
    reflect(B, beta, diagonal)
    if not least_exceeds(B, diagonal, threshold):
        return False
    if wide:
        for a in range(r):
            reflect_rows(B, a, beta[a], basis)
    else:
        reflect_vector(B, beta, y)
    if squared > 0.0:
        solve_damped(B, diagonal, squared, wide, y)
    elif wide:
        solve_lower(B, diagonal, y)
    else:
        solve_upper(B, diagonal, y)
    for a in range(r):
        for c in range(n):
            z[c] += y[a] * basis[a, c]
    for a in range(r, free):
        for c in range(n):
            basis[a - r, c] = basis[a, c]
    return True


@kernel
def rank_of(sigma: Array, lost: float, regained: float, before: int) -> int:
    """Return how many singular values count; see `taskopt.hierarchy.rank.RankRule.rank`.

    Args:
        sigma: Singular values, falling.
        lost: Value at or below which a direction is lost.
        regained: Value above which a lost direction is regained.
        before: The rank of the last tick, −1 if there was none.

    Returns:
        The rank.
    """
    kept, sure = 0, 0
    for value in sigma:
        kept += value > lost
        sure += value > regained
    return kept if before < 0 else min(max(before, sure), kept)


@kernel_apart
def advance(
    U: Array, sigma: Array, Vt: Array, missing: Array, squared: Array, z: Array, basis: Array, free: int
) -> int:  # fmt: skip
    """Move z by the damped scaling of one level, and keep the directions of the basis that are still free.

    Args:
        U: (m, ≥ r) left singular vectors.
        sigma: (≥ r,) singular values.
        Vt: (p, p) right singular vectors in its rows.
        missing: (m,) what the level misses at z.
        squared: (r,) k² of each singular value that counts.
        z: (n,) moved.
        basis: (n, n) basis in its first p rows, replaced.
        free: Number p of these rows.

    Returns:
        Number of rows of the new basis, p − r.
    """
    n, r = z.size, squared.size
    turned = np.zeros((free, n))
    for a in range(free):
        for d in range(free):
            for c in range(n):
                turned[a, c] += Vt[a, d] * basis[d, c]
    for a in range(r):
        goal = 0.0
        for i in range(missing.size):
            goal += U[i, a] * missing[i]
        step = goal * (sigma[a] / (sigma[a] * sigma[a] + squared[a]))
        for c in range(n):
            z[c] += step * turned[a, c]
    for a in range(r, free):
        for c in range(n):
            basis[a - r, c] = turned[a, c]
    return free - r


@kernel_apart
def unscaled(z: Array, scaling: Array) -> Array:
    """Return x = L⁻¹ z.

    Args:
        z: (n,) the unknowns in which the norm is the identity.
        scaling: As of `taskopt.resolver.descent.scaling_of`.

    Returns:
        x (n,).
    """
    x = np.empty(z.size)
    scale_back(z, scaling, x)
    return x


@kernel
def scale_back(z: Array, scaling: Array, x: Array) -> None:
    """Set x = L⁻¹ z.

    Args:
        z: (n,) the unknowns in which the norm is the identity.
        scaling: As of `taskopt.resolver.descent.scaling_of`.
        x: (n,) filled.
    """
    n = z.size
    for i in range(n):
        if scaling.size == n:
            x[i] = z[i] / np.sqrt(scaling[i])
        else:
            total = 0.0
            for c in range(n):
                total += scaling[i * n + c] * z[c]
            x[i] = total


@kernel
def scale_row(A: Array, i: int, root: float, scaling: Array, row: Array) -> None:
    """Set a row of J = √w A L⁻¹.

    Args:
        A: (m, n) rows.
        i: Index of the row.
        root: √w of the row.
        scaling: As of `taskopt.resolver.descent.scaling_of`.
        row: (n,) filled.
    """
    n = row.size
    if scaling.size == n:
        for c in range(n):
            row[c] = root * A[i, c] / np.sqrt(scaling[c])
    else:
        for c in range(n):
            row[c] = 0.0
        for d in range(n):
            for c in range(n):
                row[c] += root * A[i, d] * scaling[d * n + c]
