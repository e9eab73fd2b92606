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

from taskopt.jit import kernel
from taskopt.resolver.cholesky import cholesky, cholesky_solve, copy_into, dot_row, dot_rows

COVERED = 1e-6  # a column with less of D than this, relative to the largest, counts as uncovered
FEASIBLE = 1e-12  # violation, relative to max(1, |bound|), that counts as none
ACCEPTED, AGAIN, REFUSED = 0, 1, 2
SIGN = 1e-10  # multiplier, relative to the largest, that counts as zero


@kernel
def normal_tick(A, lower, upper, weight, box_lower, box_upper, norm, offsets, columns, state, x, y):
    """Try the closed form with the active set `state` (n + M); fill x (n,) and y (levels + 1, n + M).

    Returns ACCEPTED; or AGAIN, where one bound of the box in `state` was taken in or let go, so that
    another try may succeed; or REFUSED. Unless accepted, x and y hold nothing of value. The optimum
    is unique, so the order of tries cannot change an answer that is accepted.
    """
    n, rows, levels = x.size, lower.size, offsets.size - 2
    places, diagonal = np.empty(2 * n + rows, np.int64), np.empty(2 * n)
    last, uncovered, chosen = places[:n], places[n : 2 * n], places[2 * n :]
    D, x0 = diagonal[:n], diagonal[n:]
    joint_rows = _terminal(lower, upper, weight, norm, offsets, columns, D, x0, last)
    soft = offsets[levels] if joint_rows else rows  # first row that may keep a residual
    m = _chosen_rows(lower, upper, columns, state, offsets, joint_rows, n, chosen)
    if m < 0:
        return REFUSED
    u, thin = np.int64(0), 0.0  # for a literal 0, callees would be compiled once more
    for j in range(n):
        thin = max(thin, COVERED * D[j])
    for j in range(n):
        x[j] = x0[j] if state[j] == 0 else (box_upper[j] if state[j] > 0 else box_lower[j])
        if state[j] == 0 and D[j] <= thin:
            uncovered[u] = j
            u += 1
    if u > m:
        return REFUSED
    work = np.empty(m * (n + m + u + 2) + u * (u + 2))  # one allocation costs as much as a dozen sums
    MD, K = work[: m * n].reshape((m, n)), work[m * n : m * (n + m)].reshape((m, m))
    KN = work[m * (n + m) : m * (n + m + u)].reshape((u, m))
    multiplier = work[m * (n + m + u) : m * (n + m + u + 1)]
    step = work[m * (n + m + u + 1) : m * (n + m + u + 2)]
    G = work[m * (n + m + u + 2) : m * (n + m + u + 2) + u * u].reshape((u, u))
    move, share = work[work.size - 2 * u : work.size - u], work[work.size - u :]
    if not _factorise(A, weight, D, state, thin, chosen, m, soft, uncovered, u, MD, K, KN, G):
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
            move[b] = D[j] * (x0[j] - x[j])
            for a in range(m):
                move[b] += KN[b, a] * step[a] + A[chosen[a], j] * multiplier[a]
        cholesky_solve(K, step, m)
        cholesky_solve(G, move, u)
        for b in range(u):
            x[uncovered[b]] += move[b]
            for a in range(m):
                step[a] -= KN[b, a] * move[b]
        for a in range(m):
            multiplier[a] += step[a]
            for j in range(n):
                x[j] += MD[a, j] * step[a]
    terminal = levels - 1 if joint_rows else levels
    largest = _prices(A, D, x0, state, chosen, m, soft, multiplier, terminal, x, y)
    if joint_rows:
        _norm_prices(A, norm, chosen, m, uncovered, u, KN, G, share, last, state, x, y[levels])
    price = y[levels - 1] if joint_rows else y[levels]
    return _judged(A, lower, upper, box_lower, box_upper, state, x, price, SIGN * largest)


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
def _factorise(A, weight, D, state, thin, chosen, m, soft, uncovered, u, MD, K, KN, G):
    """Cholesky factors of K and of the Schur complement G = M_Uᵀ K⁻¹ M_U + D_U; KN holds (K⁻¹ M_U)ᵀ."""
    n = D.size
    for a in range(m):
        i = chosen[a]
        for j in range(n):
            MD[a, j] = A[i, j] / D[j] if state[j] == 0 and D[j] > thin else 0.0
    for a in range(m):
        for b in range(a + 1):
            K[a, b] = dot_rows(A, chosen[b], MD, a, n)
        if chosen[a] >= soft:
            K[a, a] += 1.0 / weight[chosen[a]]
    if not cholesky(K, m):
        return False
    for b in range(u):
        for a in range(m):
            KN[b, a] = A[chosen[a], uncovered[b]]
        cholesky_solve(K, KN[b], m)
    for b in range(u):
        for c in range(b + 1):
            G[b, c] = D[uncovered[b]] if c == b else 0.0
            for a in range(m):
                G[b, c] += KN[b, a] * A[chosen[a], uncovered[c]]
    return cholesky(G, u)


@kernel
def _prices(A, D, x0, state, chosen, m, soft, multiplier, terminal, x, y):
    """Multipliers of rows and held columns at the level that comes last; returns the largest term."""
    n = x.size
    y[:, :] = 0.0
    largest = 1.0
    for a in range(m):
        i = chosen[a]
        if i < soft:
            y[terminal, n + i] = -multiplier[a]
        for j in range(n):
            largest = max(largest, abs(multiplier[a] * A[i, j]))
    for j in range(n):
        if state[j] != 0:
            price = D[j] * (x0[j] - x[j])
            largest = max(largest, abs(price))
            for a in range(m):
                price += multiplier[a] * A[chosen[a], j]
            y[terminal, j] = price
    return largest


@kernel
def _norm_prices(A, norm, chosen, m, uncovered, u, KN, G, share, last, state, x, price):
    """The norm's gradient W x balanced by rows: M for the uncovered columns, joint rows for the others."""
    n = x.size
    for b in range(u):
        share[b] = -norm[uncovered[b]] * x[uncovered[b]]
    cholesky_solve(G, share, u)
    for a in range(m):
        total = 0.0
        for b in range(u):
            total += KN[b, a] * share[b]
        price[n + chosen[a]] = total
    for j in range(n):
        rest = -norm[j] * x[j]
        if u > 0:
            for a in range(m):
                rest -= price[n + chosen[a]] * A[chosen[a], j]
        if last[j] >= 0:
            price[n + last[j]] = rest
        elif state[j] != 0:
            price[j] = rest


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
