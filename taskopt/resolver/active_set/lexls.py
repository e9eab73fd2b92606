"""Equality-constrained hierarchy by orthogonal factorisation, and its lexicographic multipliers.

Rows of the working set W, level by level, are brought to lower trapezoidal form T = M Q by
row-pivoted Householder reflections from the right; each level then fixes its own part of y = Qᵀ z
in least squares, and what is left at the end is zero (minimum norm). Bounds that hold an unknown
are columns taken out, not rows. Dimitrov, Sherikov and Wieber (2015), "Efficient resolution of
potentially conflicting linear constraints in robotics", Sect. 3; Escande, Mansard and Wieber
(2014), Int. J. Robotics Research 33(7), Sect. 4.

Everything here is in scaled units: rows times √w, unknowns z = √W x with W diagonal.
"""

import numpy as np

from taskopt.hierarchy.tolerances import LOST  # a row with less left, relative to the row, is dependent
from taskopt.jit import kernel, kernel_apart


@kernel_apart
def factorise(S, scale, offsets, state, free, order, starts, ranks, T, V, beta):
    """l-QR of the rows in the working set; returns nothing, fills the arrays.

    S (M, n): scaled rows; `state` (n + M): ≠ 0 for rows in W; `free`: the free columns (nf,).
    Fills `order` (M,): rows in W, level by level, pivots first; `starts` (levels + 2,): where each
    level begins in it; `ranks` (levels + 2,): rank before each level; T (M, nf), V (nf, nf), beta.
    """
    n, nf = S.shape[1], free.size
    levels = offsets.size - 1
    count, rank = np.int64(0), np.int64(0)  # for literals, callees would be compiled once more
    for k in range(levels):
        starts[k] = count
        for i in range(offsets[k], offsets[k + 1]):
            if state[n + i] != 0:
                order[count] = i
                for c in range(nf):
                    T[count, c] = S[i, free[c]]
                count += 1
    starts[levels] = count
    left = np.empty(count)
    for k in range(levels):
        ranks[k] = rank
        top = starts[k]
        for _ in range(starts[k + 1] - starts[k]):
            if rank == nf:
                break
            best, pivot = 0.0, -1
            for a in range(top, starts[k + 1]):
                left[a] = 0.0
                for c in range(rank, nf):
                    left[a] += T[a, c] * T[a, c]
                remainder = np.sqrt(left[a])
                if remainder > LOST * scale[order[a]] and remainder > best:
                    best, pivot = remainder, a
            if pivot < 0:
                break
            if pivot != top:
                order[pivot], order[top] = order[top], order[pivot]
                for c in range(nf):
                    T[pivot, c], T[top, c] = T[top, c], T[pivot, c]
            _reflect(T, V, beta, top, count, rank, nf)
            top += 1
            rank += 1
    ranks[levels] = rank


@kernel
def _reflect(T, V, beta, top, count, rank, nf):
    """Householder reflection that leaves row `top` nothing right of column `rank`."""
    norm = 0.0
    for c in range(rank, nf):
        norm += T[top, c] * T[top, c]
    norm = np.sqrt(norm)
    head = T[top, rank]
    alpha = -norm if head > 0.0 else norm
    V[rank, rank] = head - alpha
    squared = V[rank, rank] * V[rank, rank]
    for c in range(rank + 1, nf):
        V[rank, c] = T[top, c]
        squared += V[rank, c] * V[rank, c]
    beta[rank] = 2.0 / squared if squared > 0.0 else 0.0
    for a in range(top, count):
        total = 0.0
        for c in range(rank, nf):
            total += T[a, c] * V[rank, c]
        total *= beta[rank]
        for c in range(rank, nf):
            T[a, c] -= total * V[rank, c]
    T[top, rank] = alpha
    for c in range(rank + 1, nf):
        T[top, c] = 0.0


@kernel_apart
def solve_levels(T, scale, order, starts, ranks, target, levels, size, y, residual, terms):
    """Least squares level by level: y (nf,), the residual T y − target of each row in W, and the sum of
    the magnitudes that it is the difference of, which tells how much of it is rounding.
    """
    y[:] = 0.0
    for k in range(levels):
        first, count = starts[k], starts[k + 1] - starts[k]
        r0, rank = ranks[k], ranks[k + 1] - ranks[k]
        for a in range(first, first + count):
            value = -target[order[a]]
            for c in range(r0):
                value += T[a, c] * y[c]
            residual[a] = value
        if count == rank:
            for p in range(rank):
                value = -residual[first + p]
                for c in range(p):
                    value -= T[first + p, r0 + c] * y[r0 + c]
                y[r0 + p] = value / T[first + p, r0 + p]
        elif rank > 0:
            _least_squares(T, residual, first, count, r0, rank, y)
        for a in range(first, first + count):
            for c in range(r0, r0 + rank):
                residual[a] += T[a, c] * y[c]
            terms[a] = abs(target[order[a]]) + scale[order[a]] * size
            for c in range(r0 + rank):
                terms[a] += scale[order[a]] * abs(y[c])
            if count == rank:
                residual[a] = terms[a] = 0.0


@kernel
def _least_squares(T, residual, first, count, r0, rank, y):
    """min ‖B u + residual‖ with B = T[first:, r0:r0 + rank], by Householder from the left; u into y."""
    B, c = np.empty((count, rank)), np.empty(count)
    for a in range(count):
        c[a] = -residual[first + a]
        for p in range(rank):
            B[a, p] = T[first + a, r0 + p]
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
        if squared > 0.0:
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
            value -= B[p, b] * y[r0 + b]
        y[r0 + p] = value / B[p, p]


@kernel
def rotate(V, beta, rank, y):
    """z = Q y in place: the reflections applied in reverse."""
    nf = y.size
    for p in range(rank - 1, -1, -1):
        total = 0.0
        for c in range(p, nf):
            total += V[p, c] * y[c]
        total *= beta[p]
        for c in range(p, nf):
            y[c] -= total * V[p, c]


@kernel_apart
def level_multipliers(
    S, T, scale, order, starts, ranks, levels, k, residual, terms, y, z, state, out, unsure
):  # fmt: skip
    """Multipliers of box and rows at level k (k = levels: the norm), (n + M,), scaled; 0 where none.

    Σ own gradient + Σ λ_i S_i + λ_box = 0, rows that depend on others (no pivot) getting 0. `unsure`:
    the sum of the magnitudes that each is the difference of.
    """
    n, nf = S.shape[1], y.size
    out[:] = 0.0
    unsure[:] = 0.0
    g, size = np.zeros(nf), np.zeros(nf)
    if k == levels:
        for c in range(nf):
            g[c] = y[c]
            size[c] = abs(y[c])
    else:
        for a in range(starts[k], starts[k + 1]):
            out[n + order[a]] = residual[a]
            unsure[n + order[a]] = terms[a]
            for c in range(ranks[k]):
                g[c] += residual[a] * T[a, c]
                size[c] += terms[a] * abs(T[a, c]) + abs(residual[a]) * scale[order[a]]
    for j in range(min(k, levels) - 1, -1, -1):
        r0, rank, first = ranks[j], ranks[j + 1] - ranks[j], starts[j]
        for p in range(rank - 1, -1, -1):
            value, sum_of = -g[r0 + p], size[r0 + p]
            for b in range(p + 1, rank):
                value -= T[first + b, r0 + p] * out[n + order[first + b]]
                sum_of += scale[order[first + b]] * abs(out[n + order[first + b]])
            out[n + order[first + p]] = value / T[first + p, r0 + p]
            unsure[n + order[first + p]] = sum_of / abs(T[first + p, r0 + p])
        for p in range(rank):
            price = out[n + order[first + p]]
            for c in range(r0):
                g[c] += price * T[first + p, c]
                size[c] += abs(price) * scale[order[first + p]]
    for j in range(n):
        if state[j] != 0:
            value, sum_of = (-z[j], abs(z[j])) if k == levels else (0.0, 0.0)
            for a in range(starts[min(k + 1, levels)]):
                value -= out[n + order[a]] * S[order[a], j]
                sum_of += (
                    unsure[n + order[a]] * abs(S[order[a], j]) + abs(out[n + order[a]]) * scale[order[a]]
                )
            out[j] = value
            unsure[j] = sum_of
