"""Kernels of the cascade of `hqp`: rows on ξ = L x, and the program of a level that can be met exactly.

An orthonormal basis of the directions that the levels before left free stands in the rows of `basis`, of
which the first p count, so that ξ + Nᵀ z is substituted for ξ. The equality rows M z = d of a level are
factorised by reflections, M = L Q₁ᵀ or M = Q₁ Lᵀ, if their rank is certainly full; see
`taskopt.resolver.descent_kernels`.
"""

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.tolerances import REDUNDANT_ROW
from taskopt.hierarchy.view import view_rows
from taskopt.jit import kernel_apart
from taskopt.jit.borrowed import borrowed
from taskopt.resolver.active_set.linalg import dot_row
from taskopt.resolver.descent_kernels import scale_row
from taskopt.resolver.orthogonal import (
    least_exceeds,
    reflect,
    reflect_rows,
    reflect_vector,
    solve_lower,
    solve_upper,
)
from taskopt.resolver.unit_kernels import Unit, scale_program

Given = tuple[Array, Array, IntArray]
Kept = tuple[Array, Array, IntArray]
IRREGULAR = -1  # the rank of the equality rows is not certain without singular values
IDLE = 0  # the level decides nothing and adds no rows
MET = 1  # the level is met without a solver
OPEN = 2  # a solver is needed


@kernel_apart
def limit_rows(given: Given, place: Array, kept: Kept) -> tuple[int, int, bool]:
    """Begin a cascade at ξ = 0 with all directions free, and with the limits.

    Box and hard rows are written as far as they are inequalities with a bound.

    Args:
        given: Flat buffer of the hierarchy (see `taskopt.hierarchy.view`), its scaling as of
            `taskopt.resolver.descent.scaling_of`, and first rows of the levels, (levels + 2,).
        place: (n + 1, n) filled with the basis, and with ξ in the last row.
        kept: Inequality rows: filled with the rows on ξ (≥ n + m, n), their lower and upper bounds
            (2, ≥ n + m), and the position of each row among unknowns and rows (≥ n + m,).

    Returns:
        Number of these rows, number of hard equalities, which are not written, and True if ξ keeps all rows.
    """
    buffer, scaling, offsets = borrowed(given[0]), borrowed(given[1]), borrowed(given[2])
    G, bounds, index = borrowed(kept[0]), borrowed(kept[1]), borrowed(kept[2])
    n, keeps = G.shape[1], True
    for i in range(n + 1):
        for j in range(n):
            place[i, j] = 1.0 if i == j else 0.0
    problem = view_rows(buffer, n, scaling, offsets, np.empty(offsets[-1], np.int64))
    unit, count, equalities = np.zeros((1, n)), 0, 0
    for i in range(n + offsets[1]):
        row = i - n
        lower = problem.box_lower[i] if row < 0 else problem.lower[row]
        upper = problem.box_upper[i] if row < 0 else problem.upper[row]
        if lower == upper:
            equalities += 1
        elif lower > -np.inf or upper < np.inf:
            if row < 0:
                unit[0, i] = 1.0
                scale_row(unit, 0, 1.0, scaling, G[count])
                unit[0, i] = 0.0
            else:
                scale_row(problem.A, row, 1.0, scaling, G[count])
            bounds[0, count], bounds[1, count], index[count] = lower, upper, i
            keeps &= lower <= 0.0 <= upper
            count += 1
    return count, equalities, bool(keeps)


@kernel_apart
def level_rows(
    given: Given, k: int, equal: Array, goal: Array, kept: Kept, first: int
) -> tuple[int, int, float]:  # fmt: skip
    """Write the rows of a level on ξ, multiplied by √w: equalities and inequalities apart.

    Args:
        given: As of `limit_rows`.
        k: Level, counted from 1.
        equal: (≥ m, n) filled with the equality rows.
        goal: (≥ m,) filled with their right-hand sides.
        kept: Inequality rows, as of `limit_rows`, to which those of the level are added.
        first: Number of those that are there.

    Returns:
        Number of equalities, number of inequalities, and the size of all rows, see
        `taskopt.hierarchy.rank.row_scale`.
    """
    (buffer, scaling, offsets), (G, bounds, index) = given, kept
    n = equal.shape[1]
    problem = view_rows(buffer, n, scaling, offsets, np.empty(offsets[-1], np.int64))
    row, equalities, count, scale = np.empty(n), 0, first, 0.0
    for i in range(offsets[k], offsets[k + 1]):
        root, squares = np.sqrt(problem.weight[i]), 0.0
        scale_row(problem.A, i, root, scaling, row)
        for c in range(n):
            squares += row[c] * row[c]
        scale = max(scale, root, np.sqrt(squares))
        target = equal[equalities] if problem.lower[i] == problem.upper[i] else G[count]
        for c in range(n):
            target[c] = row[c]
        if problem.lower[i] == problem.upper[i]:
            goal[equalities] = root * problem.upper[i]
            equalities += 1
        else:
            bounds[0, count], bounds[1, count] = root * problem.lower[i], root * problem.upper[i]
            index[count] = n + i
            count += 1
    return equalities, count - first, scale


@kernel_apart
def decide_directions(
    equal: Array, goal: Array, threshold: float, xi: Array, basis: Array, M: Array, Q: Array, z: Array
) -> int:  # fmt: skip
    """Decide the directions of a level's equality rows, if their rank is certainly full.

    Args:
        equal: (m, n) equality rows on ξ.
        goal: (m,) their right-hand sides.
        threshold: Value that all singular values of M must exceed.
        xi: (n,) answer of the levels before.
        basis: (n, n) free directions in its first p rows.
        M: (m, p) filled with the rows on z.
        Q: (p, p) filled with orthonormal rows, of which the first r are decided and the others stay free.
        z: (p,) filled with what these rows decide in its first r entries.

    Returns:
        The rank r = min(m, p), or IRREGULAR.
    """
    m, free = goal.size, z.size
    r, wide, missing = min(m, free), m <= free, np.empty(m)
    for i in range(m):
        missing[i] = goal[i] - dot_row(equal, i, xi, xi.size)
        for a in range(free):
            total = 0.0
            for c in range(xi.size):
                total += equal[i, c] * basis[a, c]
            M[i, a] = total
    for a in range(free):
        for c in range(free):
            Q[a, c] = 1.0 if a == c else 0.0
    if r > 0:
        B = M.copy() if wide else np.ascontiguousarray(M.T)
        beta, diagonal = np.empty(r), np.empty(r)
        reflect(B, beta, diagonal)
        if not least_exceeds(B, diagonal, threshold):
            return IRREGULAR
        if wide:
            solve_lower(B, diagonal, missing)
        else:
            reflect_vector(B, beta, missing)
            solve_upper(B, diagonal, missing)
        for a in range(r):
            z[a] = missing[a]
            if wide:
                reflect_rows(B, a, beta[a], Q)
    return r


@kernel_apart
def exact_program(
    rows: tuple[Array, Array, Array], counts: tuple[int, int], place: tuple[Array, Array], Q: Array,
    decided: Array, C: Array, sides: Array, offset: Array,
) -> tuple[int, int]:  # fmt: skip
    """Write the program that meets a level exactly: decided directions first, then the inequality rows.

    Args:
        rows: Inequality rows on ξ that must hold, (m, n), with their lower and upper bounds, (m,) each.
        counts: Number of rows, from the first on, that ξ is known to keep, and number of rows, likewise, that
            belong to levels before. Bounds that ξ keeps, but violates by rounding errors, are moved so that
            z = 0 keeps them, and the program has a feasible point.
        place: The answer ξ of the levels before, (n,), and the free directions in the first p rows of (n, n).
        Q: (p, p) as of `decide_directions`.
        decided: (r,) what the first r rows of Q decide.
        C: (≥ r + m, p) filled with the rows of the program.
        sides: (2, ≥ r + m) filled with their bounds.
        offset: (p,) filled with the linear term Nᵀ ξ.

    Returns:
        Number of rows, without those that vanish in the null space, and how many of them are not from levels
        before.
    """
    (G, lower, upper), (clipped, earlier), (xi, basis) = rows, counts, place
    n, p, r = xi.size, offset.size, decided.size
    for a in range(p):
        offset[a] = dot_row(basis, a, xi, n)
    for a in range(r):
        for c in range(p):
            C[a, c] = Q[a, c]
        sides[0, a] = sides[1, a] = decided[a]
    count, own = r, 0
    for i in range(G.shape[0]):
        squares, projected, value = 0.0, 0.0, 0.0
        for c in range(n):
            squares += G[i, c] * G[i, c]
            value += G[i, c] * xi[c]
        for a in range(p):
            total = 0.0
            for c in range(n):
                total += G[i, c] * basis[a, c]
            C[count, a] = total
            projected += total * total
        if np.sqrt(projected) > REDUNDANT_ROW * np.sqrt(squares):
            below, above = lower[i] - value, upper[i] - value
            sides[0, count] = min(below, 0.0) if i < clipped else below
            sides[1, count] = max(above, 0.0) if i < clipped else above
            count += 1
            own += i >= earlier
    return count, own


@kernel_apart
def exact_level(
    given: Given, level: tuple[int, float, int, bool], place: Array, kept: Kept, M: Array, Q: Array,
    unit: Unit, program: tuple[Array, Array],
) -> tuple[int, tuple[int, int, int, int], tuple[float, float, float]]:  # fmt: skip
    """Write the program that meets a level exactly at unit size, or meet it where no bound is in the way.

    Args:
        given: As of `limit_rows`.
        level: Number of the level, counted from 1; singular value, relative to the size of the rows, that all
            must exceed; number of inequality rows so far; True if ξ is known to keep them.
        place: (n + 1, n) as `limit_rows` began it; moved if the level is met.
        kept: Inequality rows, to which those of the level are added.
        M: (≥ m, p) filled with the equality rows on z.
        Q: (p, p) filled as by `decide_directions`.
        unit: As of `scale_program`, with room for min(m, p) more rows than `kept`.
        program: Filled with H (p, p), and with the bounds within reach as of `scale_program`.

    Returns:
        IRREGULAR, IDLE, MET or OPEN; numbers of equality rows, of inequality rows, of decided directions, and
        of rows of the program; size of the level's rows, and the two numbers of `scale_program`.
    """
    k, regained, before, feasible = level
    given = borrowed(given[0]), borrowed(given[1]), borrowed(given[2])
    G, bounds, index = borrowed(kept[0]), borrowed(kept[1]), borrowed(kept[2])
    place, M, Q, H, near = (
        borrowed(place),
        borrowed(M),
        borrowed(Q),
        borrowed(program[0]),
        borrowed(program[1]),
    )
    unit = borrowed(unit[0]), borrowed(unit[1]), borrowed(unit[2]), borrowed(unit[3])
    n, p, m = place.shape[1], Q.shape[0], M.shape[0]
    xi, basis = place[n], place[:n]
    equal, goal, decided, offset = np.empty((m, n)), np.empty(m), np.empty(p), np.empty(p)
    e, own, scale = level_rows(given, k, equal, goal, (G, bounds, index), before)
    r = decide_directions(equal[:e], goal[:e], regained * scale, xi, basis, M[:e], Q, decided)
    if r == IRREGULAR:
        return IRREGULAR, (e, own, 0, 0), (scale, 0.0, 1.0)
    rows = before + own
    C, sides = np.empty((r + rows, p)), np.empty((2, r + rows))
    inequalities = G[:rows], bounds[0, :rows], bounds[1, :rows]
    counts = (before if feasible else 0), before
    count, alive = exact_program(inequalities, counts, (xi, basis), Q, decided[:r], C, sides, offset)
    if r == 0 and alive == 0:
        return IDLE, (e, own, r, count), (scale, 0.0, 1.0)
    none = np.full(p, np.inf)
    for a in range(p):
        for c in range(p):
            H[a, c] = 1.0 if a == c else 0.0
    linear = offset, C[:count], sides[0, :count], sides[1, :count], -none, none
    size, least = scale_program(H, linear, unit, near)
    if size == 0.0:
        move_on(unit[0], Q, r, place)
    return (OPEN if size > 0.0 else MET), (e, own, r, count), (scale, size, least)


@kernel_apart
def move_on(z: Array, Q: Array, rank: int, place: Array) -> None:
    """Move ξ by Nᵀ z, and keep the directions that a level leaves free.

    Args:
        z: (p,) answer of the level.
        Q: (p, p) as of `decide_directions`.
        rank: Number r of its rows that are decided.
        place: (n + 1, n) as `limit_rows` began it: ξ is moved, and the p rows of the basis become p − r.
    """
    p, n = z.size, place.shape[1]
    xi, basis = place[n], place[:n]
    kept = np.zeros((p - rank, n))
    for a in range(p):
        for c in range(n):
            xi[c] += z[a] * basis[a, c]
    for a in range(rank, p):
        for d in range(p):
            for c in range(n):
                kept[a - rank, c] += Q[a, d] * basis[d, c]
    for a in range(p - rank):
        for c in range(n):
            basis[a, c] = kept[a, c]
