"""The closed form of a normal tick: every strict level met, the same bounds active as before.

With D and x0 the diagonal and the target of what comes last (the joint rows of the last level, or
the norm), all other rows M x + s = r, s = 0 for strict levels and ½ w s² in the last one:

    min ½ Σ D_j (x_j − x0_j)² + ½ Σ s_i²/S_i,   S_i = 0 or 1/w_i
    K = M_F D_F⁻¹ M_Fᵀ + S,   K λ = r − M_X x_X − M_F x0_F,   x_F = x0_F + D_F⁻¹ M_Fᵀ λ,

F being the free columns and X those that last tick's active set holds at a bound. For one level it
is (3.50), and (3.54) where x0 ≠ 0. It is accepted only if K is well conditioned, no row that is
left out is violated, and every active bound has the right sign; else the general algorithm runs.
"""

import numpy as np

from taskopt.jit import kernel

PIVOT = 1e-7  # least relative pivot of K; with one refinement x is then right to about 1e-11
FEASIBLE = 1e-12  # violation, relative to max(1, |bound|), that counts as none
SIGN = 1e-10  # multiplier, relative to the largest, that counts as zero


@kernel
def normal_tick(A, lower, upper, weight, box_lower, box_upper, norm, offsets, columns, state, x, y):
    """Try the closed form with the active set `state` (n + M); fill x (n,) and y (levels + 1, n + M).

    Returns whether the answer is accepted; if not, x and y hold nothing of value.
    """
    n, rows, levels = x.size, lower.size, offsets.size - 2
    D, x0, last = np.empty(n), np.empty(n), np.empty(n, np.int64)
    covered = _terminal(lower, upper, weight, norm, offsets, columns, D, x0, last)
    soft = offsets[levels] if covered else rows  # first row that may keep a residual
    chosen = np.empty(rows, np.int64)
    m = _strict_rows(lower, upper, columns, state, offsets, covered, n, chosen)
    if m < 0:
        return False
    for j in range(n):
        if state[j] != 0:
            x[j] = box_upper[j] if state[j] > 0 else box_lower[j]
        else:
            x[j] = x0[j]
    K, MD = np.empty((m, m)), np.empty((m, n))
    multiplier, step = np.zeros(m), np.empty(m)
    for a in range(m):
        i = chosen[a]
        for j in range(n):
            MD[a, j] = A[i, j] / D[j] if state[j] == 0 else 0.0
    for a in range(m):
        for b in range(a + 1):
            K[a, b] = _dot(A[chosen[b]], MD[a], n)
        if chosen[a] >= soft:
            K[a, a] += 1.0 / weight[chosen[a]]
    if not _cholesky(K, m):
        return False
    for _ in range(2):  # the second pass is the refinement
        for a in range(m):
            i = chosen[a]
            step[a] = lower[i] - _dot(A[i], x, n)
            if i >= soft:
                step[a] -= multiplier[a] / weight[i]
        _cholesky_solve(K, step, m)
        for a in range(m):
            multiplier[a] += step[a]
            for j in range(n):
                x[j] += MD[a, j] * step[a]
    y[:, :] = 0.0
    terminal = levels - 1 if covered else levels
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
        if covered:
            y[levels, n + last[j]] = -norm[j] * x[j]
    return _accepted(A, lower, upper, box_lower, box_upper, columns, state, x, y[terminal], SIGN * largest)


@kernel
def _terminal(lower, upper, weight, norm, offsets, columns, D, x0, last):
    """Diagonal and target of what comes last; True if the joint rows of the last level fix all of x."""
    n, levels = D.size, offsets.size - 2
    D[:] = 0.0
    x0[:] = 0.0
    first = offsets[levels] if levels > 0 else lower.size
    for i in range(first, lower.size):
        j = columns[i]
        if j >= 0 and lower[i] == upper[i]:
            D[j] += weight[i]
            x0[j] += weight[i] * lower[i]
            last[j] = i
    for j in range(n):
        if D[j] == 0.0:
            D[:] = norm
            x0[:] = 0.0
            return False
    for j in range(n):
        x0[j] /= D[j]
    return True


@kernel
def _strict_rows(lower, upper, columns, state, offsets, covered, n, chosen):
    """Indices of the rows that make up M; -1 if an inequality row is active (not this kernel's work)."""
    first_last = offsets[offsets.size - 2]
    m = 0
    for i in range(lower.size):
        if lower[i] == upper[i]:
            if not (covered and i >= first_last and columns[i] >= 0):
                chosen[m] = i
                m += 1
        elif state[n + i] != 0:
            return -1
    return m if m <= n or covered else -1


@kernel
def _accepted(A, lower, upper, box_lower, box_upper, columns, state, x, price, sign):
    """No bound is crossed, no active one has the wrong sign; x is finite."""
    n = x.size
    for j in range(n):
        if not np.isfinite(x[j]):
            return False
        if state[j] > 0:
            if price[j] < -sign and box_lower[j] < box_upper[j]:
                return False
        elif state[j] < 0:
            if price[j] > sign and box_lower[j] < box_upper[j]:
                return False
        else:
            allowed = FEASIBLE * max(1.0, abs(x[j]))
            if x[j] > box_upper[j] + allowed or x[j] < box_lower[j] - allowed:
                return False
            x[j] = min(max(x[j], box_lower[j]), box_upper[j])
    for i in range(lower.size):
        if lower[i] != upper[i]:
            value = _dot(A[i], x, n)
            allowed = FEASIBLE * max(1.0, abs(value))
            if value > upper[i] + allowed or value < lower[i] - allowed:
                return False
    return True


@kernel
def _dot(a, b, n):
    """Σ a_j b_j over n terms; shorter than a call into BLAS for the sizes of a robot."""
    total = 0.0
    for j in range(n):
        total += a[j] * b[j]
    return total


@kernel
def _cholesky(K, m):
    """K = L Lᵀ in place (lower triangle); False where a relative pivot is below PIVOT."""
    for a in range(m):
        diagonal = K[a, a]
        for b in range(a):
            value = K[a, b]
            for c in range(b):
                value -= K[a, c] * K[b, c]
            K[a, b] = value * K[b, b]
        pivot = diagonal
        for c in range(a):
            pivot -= K[a, c] * K[a, c]
        if not pivot > PIVOT * diagonal:
            return False
        K[a, a] = 1.0 / np.sqrt(pivot)  # the inverse, so that solving only multiplies
    return True


@kernel
def _cholesky_solve(K, b, m):
    """Solve L Lᵀ z = b in place, K as `_cholesky` left it."""
    for a in range(m):
        value = b[a]
        for c in range(a):
            value -= K[a, c] * b[c]
        b[a] = value * K[a, a]
    for a in range(m - 1, -1, -1):
        value = b[a]
        for c in range(a + 1, m):
            value -= K[c, a] * b[c]
        b[a] = value * K[a, a]
