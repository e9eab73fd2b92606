"""Hierarchies of equalities, solved by orthogonal factorisation, and their lexicographic multipliers.

The rows of the working set W, level by level, are brought to lower trapezoidal form A = L Qᵀ by row-pivoted
Householder reflections from the right. Each level then decides its own part of z = Qᵀ x in least squares. The
part that no level decides is set to zero, which gives the least norm. An unknown that is held at a bound is
taken out as a column instead of being added as a row. This is the l-QR of Dimitrov, Sherikov and Wieber
(2015), Sect. 3; with another factorisation, the primal of Escande, Mansard and Wieber (2014) is their
Algorithm 1 and the multipliers are their Algorithm 2.

All quantities are scaled (see `workspace.ScaledRows`).
"""

import numpy as np

from taskopt.arrays import Array, IntArray, StateArray
from taskopt.hierarchy.tolerances import LOST
from taskopt.jit import kernel, kernel_apart
from taskopt.resolver.active_set.linalg import copy_into
from taskopt.resolver.active_set.workspace import Count, Factor, Held, LevelMultipliers, LevelSolution


@kernel
def new_factor(rows: int, levels: int, state: StateArray, n: int) -> Factor:
    """Allocate a factorisation for the free unknowns of a working set.

    Args:
        rows: Number M of rows.
        levels: Number of levels, the hard rows among them.
        state: (n + M,) `Held` of each unknown and row.
        n: Number of unknowns.

    Returns:
        The `Factor`, with `free` filled.
    """
    free, f = np.empty(n, np.int64), 0
    for j in range(n):
        if state[j] == Held.FREE:
            free[f] = j
            f += 1
    return Factor(
        free[:f],
        np.empty(rows, np.int64),
        np.empty(levels + 1, np.int64),
        np.empty(levels + 1, np.int64),
        np.empty((rows, f)),
        np.empty((f, f)),
        np.empty(f),
        np.empty((f, f)),
    )


@kernel_apart
def factorise(
    A: Array, scale: Array, offsets: IntArray, state: StateArray, rounding: float, factor: Factor
) -> None:  # fmt: skip
    """Factorise the rows of W on the free unknowns, A = L Qᵀ, level by level.

    Inside a level the row with the largest remainder is the next pivot. The remainder of a row is its part
    orthogonal to the pivots before. A row with a remainder of at most LOST times its own size depends on the
    rows before it, and decides nothing. Source: Dimitrov, Sherikov and Wieber (2015), Sect. 3, by rows
    instead of columns.

    Args:
        A: (M, n) scaled rows.
        scale: (M,) size of each row for the decision of rank.
        offsets: (levels + 1,) first row of each level, the hard rows first.
        state: (n + M,) `Held` of each unknown and row; those that are not FREE are in W.
        rounding: If it is not 0, what is left of a row that depends on the levels before its own is taken
            for rounding, and set to zero.
        factor: The factorisation, filled here.
    """
    n, f, levels = A.shape[1], factor.free.size, offsets.size - 1
    L, order, starts = factor.L, factor.order, factor.starts
    count, rank = np.int64(0), np.int64(0)  # for literals, callees would be compiled once more
    for k in range(levels):
        starts[k] = count
        for i in range(offsets[k], offsets[k + 1]):
            if state[n + i] != Held.FREE:
                order[count] = i
                for c in range(f):
                    L[count, c] = A[i, factor.free[c]]
                count += 1
    starts[levels] = count
    for k in range(levels):
        factor.ranks[k] = rank
        if rounding > 0.0:
            _clear_dependent(L, scale, order, starts[k], starts[k + 1], rank)
        top = starts[k]
        for _ in range(starts[k + 1] - starts[k]):
            if rank == f:
                break
            pivot = _largest_remainder(L, scale, order, top, starts[k + 1], rank)
            if pivot < 0:
                break
            if pivot != top:
                order[pivot], order[top] = order[top], order[pivot]
                for c in range(f):
                    L[pivot, c], L[top, c] = L[top, c], L[pivot, c]
            _reflect(L, factor.reflectors, factor.beta, top, count, rank)
            top += 1
            rank += 1
    factor.ranks[levels] = rank


@kernel
def _largest_remainder(L: Array, scale: Array, order: IntArray, first: int, stop: int, rank: Count) -> int:
    """Return the row of a level with the largest part from column `rank` on, or −1 if there is none."""
    best, pivot = 0.0, -1
    for a in range(first, stop):
        squared = 0.0
        for c in range(rank, L.shape[1]):
            squared += L[a, c] * L[a, c]
        remainder = np.sqrt(squared)
        if remainder > LOST * scale[order[a]] and remainder > best:
            best, pivot = remainder, a
    return pivot


@kernel
def _clear_dependent(L: Array, scale: Array, order: IntArray, first: int, stop: int, rank: Count) -> None:
    """Set to zero what is left, from column `rank` on, of the rows of a level that depend on levels before.

    Times a large residual of such a row, rounding would move the weak directions of the level.
    """
    for a in range(first, stop):
        squared = 0.0
        for c in range(rank, L.shape[1]):
            squared += L[a, c] * L[a, c]
        if np.sqrt(squared) <= LOST * scale[order[a]]:
            for c in range(rank, L.shape[1]):
                L[a, c] = 0.0


@kernel
def weakest_pivot(size: Array, factor: Factor) -> float:
    """Return the least part of a pivot that is orthogonal to the pivots before, relative to its size.

    Digits of x are lost in proportion to its inverse.

    Args:
        size: (M,) norm of each row.
        factor: The factorisation that `factorise` filled.

    Returns:
        The least share, at most 1.
    """
    least = 1.0
    for k in range(factor.ranks.size - 1):
        first, r0, r1 = factor.starts[k], factor.ranks[k], factor.ranks[k + 1]
        for p in range(r0, r1):
            least = min(least, abs(factor.L[first + p - r0, p]) / size[factor.order[first + p - r0]])
    return least


@kernel
def _reflect(L: Array, reflectors: Array, beta: Array, top: int, count: Count, rank: Count) -> None:
    """Reflect rows `top` to `count` so that row `top` is zero right of column `rank`."""
    f, norm = L.shape[1], 0.0
    for c in range(rank, f):
        norm += L[top, c] * L[top, c]
    norm = np.sqrt(norm)
    head = L[top, rank]
    alpha = -norm if head > 0.0 else norm
    reflectors[rank, rank] = head - alpha
    squared = reflectors[rank, rank] * reflectors[rank, rank]
    for c in range(rank + 1, f):
        reflectors[rank, c] = L[top, c]
        squared += reflectors[rank, c] * reflectors[rank, c]
    beta[rank] = 2.0 / squared
    for a in range(top, count):
        total = 0.0
        for c in range(rank, f):
            total += L[a, c] * reflectors[rank, c]
        total *= beta[rank]
        for c in range(rank, f):
            L[a, c] -= total * reflectors[rank, c]
    L[top, rank] = alpha
    for c in range(rank + 1, f):
        L[top, c] = 0.0


@kernel
def invert_pivots(factor: Factor) -> None:
    """Compute the inverse of the rows of L that are pivots, which is how rounding grows in multipliers.

    Args:
        factor: The factorisation that `factorise` filled; its `inverse` is filled here.
    """
    L, inverse, levels = factor.L, factor.inverse, factor.ranks.size - 1
    for k in range(levels):
        for q in range(factor.ranks[k], factor.ranks[k + 1]):
            a = factor.starts[k] + q - factor.ranks[k]
            for p in range(q):
                total = 0.0
                for c in range(p, q):
                    total += L[a, c] * inverse[p, c]
                inverse[p, q] = -total / L[a, q]
            inverse[q, q] = 1.0 / L[a, q]


@kernel_apart
def solve_levels(factor: Factor, size: Array, target: Array, held: float, solution: LevelSolution) -> None:
    """Solve the factorised hierarchy: min ‖L z − target‖² level by level.

    A level whose rows are all pivots is met exactly, by forward substitution; any other level is solved in
    least squares. Source: Dimitrov, Sherikov and Wieber (2015), Sect. 3; Escande, Mansard and Wieber (2014),
    Algorithm 1.

    Args:
        factor: The factorisation that `factorise` filled.
        size: (M,) norm of each row.
        target: (M,) right-hand side of each row in W, from which the terms of the held unknowns are
            subtracted.
        held: Σ |x_j| of the held unknowns, with which the rounding error of `target` grows.
        solution: The solution, filled here.
    """
    L, order, z = factor.L, factor.order, solution.z
    residual, terms = solution.residual, solution.terms
    for c in range(z.size):
        z[c] = 0.0
    for k in range(factor.ranks.size - 1):
        first, stop = factor.starts[k], factor.starts[k + 1]
        r0, r1 = factor.ranks[k], factor.ranks[k + 1]
        count, rank = stop - first, r1 - r0
        for a in range(first, stop):
            value = -target[order[a]]
            for c in range(r0):
                value += L[a, c] * z[c]
            residual[a] = value
        if count == rank:
            for p in range(rank):
                value = -residual[first + p]
                for c in range(p):
                    value -= L[first + p, r0 + c] * z[r0 + c]
                z[r0 + p] = value / L[first + p, r0 + p]
        elif rank > 0:
            _least_squares(L, residual, first, count, r0, rank, z)
        for a in range(first + rank, stop):
            for c in range(r0, r1):
                residual[a] += L[a, c] * z[c]
            terms[a] = abs(target[order[a]]) + size[order[a]] * held
            for c in range(r1):
                terms[a] += size[order[a]] * abs(z[c])


@kernel
def _least_squares(
    L: Array, residual: Array, first: int, count: int, r0: int, rank: int, z: Array
) -> None:  # fmt: skip
    """Solve min ‖B u + residual‖ by Householder, with B the level's own block of L; write u into z."""
    B, c = np.empty((count, rank)), np.empty(count)
    for a in range(count):
        c[a] = -residual[first + a]
        for p in range(rank):
            B[a, p] = L[first + a, r0 + p]
    v = np.empty(count)
    for p in range(rank):
        norm = 0.0
        for a in range(p, count):
            norm += B[a, p] * B[a, p]
        norm = np.sqrt(norm)
        alpha = -norm if B[p, p] > 0.0 else norm
        squared = 0.0
        for a in range(p, count):
            v[a] = B[a, p] - alpha if a == p else B[a, p]
            squared += v[a] * v[a]
        for b in range(p, rank):
            total = 0.0
            for a in range(p, count):
                total += v[a] * B[a, b]
            total *= 2.0 / squared
            for a in range(p, count):
                B[a, b] -= total * v[a]
        total = 0.0
        for a in range(p, count):
            total += v[a] * c[a]
        total *= 2.0 / squared
        for a in range(p, count):
            c[a] -= total * v[a]
    for p in range(rank - 1, -1, -1):
        value = c[p]
        for b in range(p + 1, rank):
            value -= B[p, b] * z[r0 + b]
        z[r0 + p] = value / B[p, p]


@kernel
def unknowns_into(factor: Factor, z: Array, x: Array) -> None:
    """Set the free unknowns of x to Q z, by the reflections in reverse order.

    Args:
        factor: The factorisation that `factorise` filled.
        z: (f,) coordinates of the free unknowns.
        x: (n,) whose free entries are overwritten.
    """
    f, free = z.size, np.empty(z.size)
    for c in range(f):
        free[c] = z[c]
    for p in range(factor.ranks[factor.ranks.size - 1] - 1, -1, -1):
        total = 0.0
        for c in range(p, f):
            total += factor.reflectors[p, c] * free[c]
        total *= factor.beta[p]
        for c in range(p, f):
            free[c] -= total * factor.reflectors[p, c]
    for c in range(f):
        x[factor.free[c]] = free[c]


@kernel_apart
def multipliers_of_level(
    A: Array, size: Array, factor: Factor, solution: LevelSolution, state: StateArray, x: Array, k: int,
    out: LevelMultipliers,
) -> None:  # fmt: skip
    """Compute the multipliers of box and rows at level k.

    The residuals of the rows of the level that are no pivots are balanced by its pivots, then by those of
    the levels before it, from level k − 1 back to level 0: the triangular system of each level is solved in
    z. The multiplier of a pivot of level k is its residual. Near a singularity, or where rows of a level
    differ in size, A_i x − b_i of a pivot is mostly rounding, while this sum is exact to its own size. Rows
    of levels before that are no pivots get the multiplier 0. The bounds of held unknowns balance the rest:

        Σ_own residual_i A_i + Σ_before λ_i A_i + λ_box = 0.

    Source:
        Escande, Mansard and Wieber (2014), Algorithm 2; Dimitrov, Sherikov and Wieber (2015), Sect. 3.

    Args:
        A: (M, n) scaled rows.
        size: (M,) norm of each row.
        factor: The factorisation that `factorise` filled.
        solution: The solution that `solve_levels` filled.
        state: (n + M,) `Held` of each unknown and row.
        x: (n,) the solution.
        k: The level, 0 for the hard rows; the number of levels denotes the norm, whose gradient is x.
        out: The multipliers, filled here.
    """
    n, f, levels = A.shape[1], factor.free.size, factor.starts.size - 1
    L, order, starts, ranks = factor.L, factor.order, factor.starts, factor.ranks
    value_of, terms_of = out.value, out.terms
    for j in range(value_of.size):
        value_of[j] = 0.0
        terms_of[j] = 0.0
    gradient, magnitude, rounding = np.zeros(f), np.zeros(f), np.empty(f)
    if k == levels:
        copy_into(gradient, solution.z)
        copy_into(magnitude, np.abs(solution.z))
    else:
        for a in range(starts[k] + ranks[k + 1] - ranks[k], starts[k + 1]):
            residual, terms = solution.residual[a], solution.terms[a]
            value_of[n + order[a]] = residual
            terms_of[n + order[a]] = terms
            for c in range(ranks[k + 1]):
                gradient[c] += residual * L[a, c]
                magnitude[c] += terms * abs(L[a, c]) + abs(residual) * size[order[a]]
    for j in range(min(k, levels - 1), -1, -1):
        r0, rank, first = ranks[j], ranks[j + 1] - ranks[j], starts[j]
        for p in range(rank - 1, -1, -1):
            value, sum_of = -gradient[r0 + p], magnitude[r0 + p]
            for b in range(p + 1, rank):
                value -= L[first + b, r0 + p] * value_of[n + order[first + b]]
                sum_of += size[order[first + b]] * abs(value_of[n + order[first + b]])
            multiplier, i = value / L[first + p, r0 + p], order[first + p]
            value_of[n + i] = multiplier
            rounding[r0 + p] = sum_of + size[i] * abs(multiplier)
        for p in range(rank):
            multiplier = value_of[n + order[first + p]]
            for c in range(r0):
                gradient[c] += multiplier * L[first + p, c]
                magnitude[c] += abs(multiplier) * size[order[first + p]]
    _terms_of_pivots(factor, min(k, levels - 1), rounding, n, terms_of)
    _box_multipliers(A, size, factor, state, x, k, out)


@kernel
def _terms_of_pivots(factor: Factor, k: int, rounding: Array, n: int, terms: Array) -> None:
    """Fill the terms of the pivots of levels 0 to k: the rounding of their equations times |L⁻ᵀ|."""
    end = factor.ranks[k + 1]
    for j in range(k + 1):
        for p in range(factor.ranks[j], factor.ranks[j + 1]):
            total = 0.0
            for q in range(p, end):
                total += abs(factor.inverse[p, q]) * rounding[q]
            terms[n + factor.order[factor.starts[j] + p - factor.ranks[j]]] = total


@kernel
def _box_multipliers(
    A: Array, size: Array, factor: Factor, state: StateArray, x: Array, k: int, out: LevelMultipliers
) -> None:  # fmt: skip
    """Compute the multipliers of held unknowns, which balance the rest of a level's gradient."""
    n, order, levels = x.size, factor.order, factor.starts.size - 1
    for j in range(n):
        if state[j] == Held.FREE:
            continue
        value, sum_of = (-x[j], abs(x[j])) if k == levels else (0.0, 0.0)
        for a in range(factor.starts[min(k + 1, levels)]):
            i = order[a]
            value -= out.value[n + i] * A[i, j]
            sum_of += out.terms[n + i] * abs(A[i, j]) + abs(out.value[n + i]) * size[i]
        out.value[j] = value
        out.terms[j] = sum_of
