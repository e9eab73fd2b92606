"""The closed form of a normal tick: every strict level met, the same bounds active as before.

With D and x0 the diagonal and the target of what comes last (the joint rows of the last level, or
the norm), C the columns that it covers, U those that it does not (a floating base without a
posture, or with next to none), and all other rows M x + s = r, s = 0 for strict levels and ½ w s²
in the last one:

    min ½ Σ D_j (x_j − x0_j)² + ½ Σ s_i²/S_i,   S_i = 0 or 1/w_i
    [ K     M_U ] [ λ   ]   [ r − M_C x0_C − M_X x_X ]
    [ M_Uᵀ −D_U ] [ x_U ] = [ −D_U x0_U              ],   K = M_C D_C⁻¹ M_Cᵀ + S
    x_C = x0_C + D_C⁻¹ M_Cᵀ λ,

X being the columns that last tick's active set holds at a bound. For one level it is (3.50), and
(3.54) where x0 ≠ 0. It is accepted only if K and its Schur complement are well conditioned, no row
that is left out is violated, and every active bound has the right sign; else the general algorithm
runs.
"""

import numpy as np

from taskopt.jit import kernel, kernel_apart
from taskopt.resolver.active_set.linalg import (
    add_row,
    add_rows,
    backward,
    cholesky,
    copy_into,
    dot_row,
    forward,
    gram,
)

COVERED = 1e-6  # a column with less of D than this, relative to the largest, counts as uncovered
FEASIBLE = 1e-12  # violation, relative to max(1, |bound|), that counts as none
ACCEPTED, AGAIN, REFUSED = 0, 1, 2
SIGN = 1e-10  # multiplier, relative to the largest, that counts as zero


@kernel_apart
def normal_tick(A, lower, upper, weight, box_lower, box_upper, norm, offsets, columns, state, x, y):
    """Try the closed form with the active set `state` (n + M); fill x (n,) and y (levels + 1, n + M).

    Returns ACCEPTED; or AGAIN, where one bound of the box in `state` was taken in or let go, so that
    another try may succeed; or REFUSED. Unless accepted, x and y hold nothing of value. The optimum
    is unique, so the order of tries cannot change an answer that is accepted.
    """
    n, rows, levels = x.size, lower.size, offsets.size - 2
    places, diagonal = np.empty(2 * n + rows, np.int64), np.empty(4 * n)
    last, uncovered, chosen = places[:n], places[n : 2 * n], places[2 * n :]
    D, x0, root, pull = diagonal[:n], diagonal[n : 2 * n], diagonal[2 * n : 3 * n], diagonal[3 * n :]
    joint_rows = _terminal(lower, upper, weight, norm, offsets, columns, D, x0, last)
    soft = offsets[levels] if joint_rows else rows  # first row that may keep a residual
    m = _chosen_rows(lower, upper, columns, state, offsets, joint_rows, n, chosen)
    if m < 0:
        return REFUSED
    thin = 0.0
    for j in range(n):
        thin = max(thin, COVERED * D[j])
    u = np.int64(0)  # for a literal 0, callees would be compiled once more
    for j in range(n):
        root[j] = 1.0 / np.sqrt(D[j]) if state[j] == 0 and D[j] > thin else 0.0
        x[j] = x0[j] if state[j] == 0 else (box_upper[j] if state[j] > 0 else box_lower[j])
        if state[j] == 0 and D[j] <= thin:
            uncovered[u] = j
            u += 1
    if u > m:
        return REFUSED
    work = np.empty((2 * m + 3 * u + 3, max(n, m)))  # one allocation costs as much as a dozen sums
    S, K, MU, G = work[:m], work[m : 2 * m + u], work[2 * m + u : 2 * (m + u)], work[2 * (m + u) :]
    multiplier, step, move = work[2 * m + 3 * u], work[2 * m + 3 * u + 1], work[2 * m + 3 * u + 2]
    if not _factorise(A, weight, D, root, chosen, m, soft, uncovered, u, S, K, MU, G):
        return REFUSED
    multiplier[:] = 0.0
    for _ in range(2):  # the second pass is the refinement
        for a in range(m):
            i = chosen[a]
            step[a] = lower[i] - dot_row(A, i, x, n)
            if i >= soft:
                step[a] -= multiplier[a] / weight[i]
        for b in range(u):
            j = uncovered[b]
            move[b] = D[j] * (x0[j] - x[j]) + dot_row(MU, b, multiplier, m)
        _solve(K, G, m, u, step, move)
        pull[:] = 0.0
        add_rows(pull, step, S, m, n)
        for a in range(m):
            multiplier[a] += step[a]
        for j in range(n):
            x[j] += root[j] * pull[j]
        for b in range(u):
            x[uncovered[b]] += move[b]
    y[:, :] = 0.0
    terminal = levels - 1 if joint_rows else levels
    largest = _prices(A, D, x0, state, chosen, m, soft, multiplier, x, y[terminal])
    if joint_rows:
        _norm_prices(A, norm, chosen, m, uncovered, u, K, G, step, move, pull, last, state, x, y[levels])
    return _judged(A, lower, upper, box_lower, box_upper, state, x, y[terminal], SIGN * largest)


@kernel
def _terminal(lower, upper, weight, norm, offsets, columns, D, x0, last):
    """Diagonal and target of what comes last: joint rows of the last level (True), or the norm."""
    levels = offsets.size - 2
    D[:] = 0.0
    x0[:] = 0.0
    last[:] = -1
    found = False
    for i in range(offsets[levels] if levels > 0 else lower.size, lower.size):
        j = columns[i]
        if j >= 0 and lower[i] == upper[i]:
            D[j] += weight[i]
            x0[j] += weight[i] * lower[i]
            last[j] = i
            found = True
    if not found:
        copy_into(D, norm)
        return False
    for j in range(D.size):
        if D[j] > 0.0:
            x0[j] /= D[j]
    return True


@kernel
def _chosen_rows(lower, upper, columns, state, offsets, joint_rows, n, chosen):
    """Number and indices of the rows that make up M; -1 if an inequality row is active."""
    first_last = offsets[offsets.size - 2]
    m = 0
    for i in range(lower.size):
        if lower[i] == upper[i]:
            if not (joint_rows and i >= first_last and columns[i] >= 0):
                chosen[m] = i
                m += 1
        elif state[n + i] != 0:
            return -1
    return m


@kernel
def _factorise(A, weight, D, root, chosen, m, soft, uncovered, u, S, K, MU, G):
    """S = M_C D_C^-½, K = S Sᵀ + 1/w = L Lᵀ with (L⁻¹ M_U)ᵀ below it, and G = M_Uᵀ K⁻¹ M_U + D_U = L' L'ᵀ."""
    n = D.size
    for a in range(m):
        i = chosen[a]
        for j in range(n):
            S[a, j] = A[i, j] * root[j]
        for b in range(u):
            MU[b, a] = K[m + b, a] = A[i, uncovered[b]]
    gram(S, m, n, K)
    for a in range(m):
        if chosen[a] >= soft:
            K[a, a] += 1.0 / weight[chosen[a]]
    if not cholesky(K, m, m + u):
        return False
    gram(K[m:], u, m, G)
    for b in range(u):
        G[b, b] += D[uncovered[b]]
    return cholesky(G, u, u)


@kernel
def _solve(K, G, m, u, step, move):
    """The step (λ, x_U) for right-hand sides of the rows and of the uncovered columns, in place."""
    forward(K, step, m)
    for b in range(u):
        move[b] += dot_row(K, m + b, step, m)
    forward(G, move, u)
    backward(G, move, u)
    for b in range(u):
        add_row(step, -move[b], K, m + b, m)
    backward(K, step, m)


@kernel
def _prices(A, D, x0, state, chosen, m, soft, multiplier, x, price):
    """Multipliers of rows and held columns at the level that comes last; returns the largest term."""
    n = x.size
    for a in range(m):
        if chosen[a] < soft:
            price[n + chosen[a]] = -multiplier[a]
    largest = 1.0
    for j in range(n):
        if state[j] != 0:
            price[j] = D[j] * (x0[j] - x[j])
            largest = max(largest, abs(price[j]))
            for a in range(m):
                term = multiplier[a] * A[chosen[a], j]
                price[j] += term
                largest = max(largest, abs(term))
    return largest


@kernel
def _norm_prices(A, norm, chosen, m, uncovered, u, K, G, row, share, rest, last, state, x, price):
    """The norm's gradient W x balanced by rows: M for the uncovered columns, joint rows for the others."""
    n = x.size
    for j in range(n):
        rest[j] = -norm[j] * x[j]
    if u > 0:
        for b in range(u):
            share[b] = rest[uncovered[b]]
        forward(G, share, u)
        backward(G, share, u)
        row[:] = 0.0
        for b in range(u):
            add_row(row, -share[b], K, m + b, m)
        backward(K, row, m)
        for a in range(m):
            price[n + chosen[a]] = -row[a]
            add_row(rest, row[a], A, chosen[a], n)
    for j in range(n):
        if last[j] >= 0:
            price[n + last[j]] = rest[j]
        elif state[j] != 0:
            price[j] = rest[j]


@kernel
def _judged(A, lower, upper, box_lower, box_upper, state, x, price, sign):
    """ACCEPTED if no bound is crossed and none has the wrong sign; else the worst of the box changes side."""
    n = x.size
    worst, change, side = 0.0, -1, 0
    for j in range(n):
        if not np.isfinite(x[j]) or box_lower[j] > box_upper[j]:
            return REFUSED
        if state[j] != 0:
            wrong = -state[j] * price[j]
            if change < 0 and wrong > sign and box_lower[j] < box_upper[j]:
                change, side = j, 0
            continue
        over = max(x[j] - box_upper[j], box_lower[j] - x[j])
        if over > max(worst, FEASIBLE * max(1.0, abs(x[j]))):
            worst, change, side = over, j, 1 if x[j] > box_upper[j] else -1
    if change >= 0:
        state[change] = side
        return AGAIN
    for i in range(lower.size):
        if lower[i] != upper[i]:
            value = dot_row(A, i, x, n)
            allowed = FEASIBLE * max(1.0, abs(value))
            if value > upper[i] + allowed or value < lower[i] - allowed:
                return REFUSED
    for j in range(n):
        x[j] = min(max(x[j], box_lower[j]), box_upper[j])
    return ACCEPTED
