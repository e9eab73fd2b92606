"""The exact lexicographic optimum by a primal active set with lexicographic multipliers.

From last tick's working set W: solve the hierarchy with the rows of W as equalities; if a row left
out is violated or a multiplier has the wrong sign, walk. One step goes from x towards the solution
for W up to the first row that blocks, which joins W; at a full step the row with the most negative
multiplier at the *first* wrong level leaves. An active inequality may stay if its own violation,
then its multiplier at each later level, is lexicographically positive. Escande, Mansard and Wieber
(2014), Sect. 5; changing several rows at once, or dropping at a later level, cycles.
"""

import numpy as np

from taskopt.jit import kernel
from taskopt.resolver.cholesky import copy_into
from taskopt.resolver.lexicographic import factorise, level_multipliers, rotate, solve_levels

SOLVED, NOT_DONE, INFEASIBLE = 0, 1, 2
FEASIBLE = 1e-9  # violation that counts, relative to max(1, row norm)
ROUNDING = 1e-12  # by how much x may pass a bound of the box before it counts; it is then put back
SIGN = 1e-9  # multiplier that counts, relative to the largest of its level


@kernel
def walk(S, scale, low, high, box_low, box_high, offsets, state, limit, x, y):
    """Fill x (n,) and y (levels + 1, n + M), all scaled; `state` is the guess and then the answer.

    Returns (status, factorisations). `offsets` starts with the hard rows, which are level 0.
    """
    n, rows = x.size, low.size
    target, goal = np.empty(rows), np.empty(n)
    value, ahead = np.empty(rows), np.empty(rows)
    if _crossed(low, high, box_low, box_high, offsets):
        x[:] = np.nan
        return INFEASIBLE, 0
    _guess(low, high, box_low, box_high, state, n)
    zero_steps, stalls, fresh = 0, 0, True
    for iteration in range(1, limit + 1):
        leaving = _solve(S, scale, low, high, box_low, box_high, offsets, state, target, goal, y, stalls > 60)
        _values(S, goal, ahead)
        if fresh:  # all of last tick's guess at once
            wrong = _violated(low, high, box_low, box_high, scale, state, goal, ahead)
            if wrong == 0 and leaving < 0:
                copy_into(x, goal)
                return _verdict(low, high, offsets, scale, ahead), iteration
            if wrong > 0:
                _take_in(S, low, high, box_low, box_high, scale, state, goal, x, value)
                fresh = False
                continue
            copy_into(x, goal)
            copy_into(value, ahead)
            fresh = False
        alpha, entering, side = _block(
            low, high, box_low, box_high, scale, state, x, goal, value, ahead, stalls > 20
        )
        if entering >= 0:
            for j in range(n):
                x[j] += alpha * (goal[j] - x[j])
            if entering < n:
                x[entering] = box_high[entering] if side > 0 else box_low[entering]
            _values(S, x, value)
            state[entering] = side
            zero_steps = zero_steps + 1 if alpha <= 0.0 else 0
        else:
            copy_into(x, goal)
            copy_into(value, ahead)
            if leaving < 0:
                return _verdict(low, high, offsets, scale, ahead), iteration
            state[leaving] = _beyond(low, high, scale, state[leaving], leaving - n, ahead)
        stalls = stalls + 1 if zero_steps > 20 or iteration > 60 else 0
    return NOT_DONE, limit


@kernel
def _crossed(low, high, box_low, box_high, offsets):
    """Whether a hard interval is empty."""
    for j in range(box_low.size):
        if box_low[j] > box_high[j]:
            return True
    for i in range(offsets[1]):
        if low[i] > high[i]:
            return True
    return False


@kernel
def _guess(low, high, box_low, box_high, state, n):
    """Equalities always belong to W; a side without a bound never does."""
    for j in range(n):
        if box_low[j] == box_high[j]:
            state[j] = 1
        elif (state[j] > 0 and box_high[j] == np.inf) or (state[j] < 0 and box_low[j] == -np.inf):
            state[j] = 0
    for i in range(low.size):
        if low[i] == high[i]:
            state[n + i] = 1
        elif (state[n + i] > 0 and high[i] == np.inf) or (state[n + i] < 0 and low[i] == -np.inf):
            state[n + i] = 0


@kernel
def _solve(S, scale, low, high, box_low, box_high, offsets, state, target, x, y, bland):
    """Solution x for W with multipliers y; returns the row that must leave, or -1."""
    n, rows, levels = x.size, low.size, offsets.size - 1
    free, nf = np.empty(n, np.int64), 0
    for j in range(n):
        if state[j] != 0:
            x[j] = box_high[j] if state[j] > 0 else box_low[j]
        else:
            free[nf] = j
            nf += 1
    for i in range(rows):
        if state[n + i] != 0:
            target[i] = high[i] if state[n + i] > 0 else low[i]
            for j in range(n):
                if state[j] != 0:
                    target[i] -= S[i, j] * x[j]
    order = np.empty(rows, np.int64)
    starts, ranks = np.empty(levels + 1, np.int64), np.empty(levels + 1, np.int64)
    T, V, beta = np.empty((rows, nf)), np.empty((nf, nf)), np.empty(nf)
    factorise(S, scale, offsets, state, free[:nf], order, starts, ranks, T, V, beta)
    solution, rotated, residual = np.empty(nf), np.empty(nf), np.empty(rows)
    solve_levels(T, order, starts, ranks, target, levels, solution, residual)
    copy_into(rotated, solution)
    rotate(V, beta, ranks[levels], rotated)
    for c in range(nf):
        x[free[c]] = rotated[c]
    return _signs(
        S, T, order, starts, ranks, offsets, scale, low, high, box_low, box_high,
        residual, solution, x, state, y, bland,
    )  # fmt: skip


@kernel
def _signs(
    S, T, order, starts, ranks, offsets, scale, low, high, box_low, box_high,
    residual, solution, x, state, y, bland,
):  # fmt: skip
    """All multipliers; returns the inequality with the worst sign at the first wrong level, or -1."""
    n, levels = x.size, starts.size - 1
    decided = np.zeros(n + low.size, np.bool_)
    out = np.empty(n + low.size)
    leaving = -1
    for a in range(starts[levels]):
        i = order[a]
        decided[n + i] = low[i] == high[i]
    for j in range(n):
        decided[j] = box_low[j] == box_high[j]
    for k in range(levels + 1):
        level_multipliers(S, T, order, starts, ranks, levels, k, residual, solution, x, state, out)
        if k > 0:
            copy_into(y[k - 1], out)
        if leaving >= 0:
            continue
        largest = 1.0
        for a in range(starts[min(k + 1, levels)]):
            largest = max(largest, abs(out[n + order[a]]) * min(1.0, scale[order[a]]))
        worst = 0.0
        for j in range(n + low.size):
            if state[j] == 0 or decided[j]:
                continue
            if j >= n and j - n >= offsets[min(k + 1, levels)]:
                continue
            own = j >= n and k < levels and j - n >= offsets[k]
            tolerance = FEASIBLE * scale[j - n] if own else SIGN * largest
            price = state[j] * out[j]
            if price > tolerance:
                decided[j] = True
            elif price < -tolerance and (leaving < 0 or (price < worst and not bland)):
                worst, leaving = price, j
    return leaving


@kernel
def _values(S, x, value):
    for i in range(value.size):
        total = 0.0
        for j in range(x.size):
            total += S[i, j] * x[j]
        value[i] = total


@kernel
def _violated(low, high, box_low, box_high, scale, state, x, value):
    """Number of inequalities outside W that x violates."""
    n, count = x.size, 0
    for j in range(n):
        slack = ROUNDING * max(1.0, abs(x[j]))
        if state[j] == 0 and (x[j] > box_high[j] + slack or x[j] < box_low[j] - slack):
            count += 1
    for i in range(low.size):
        if state[n + i] == 0:
            slack = FEASIBLE * scale[i]
            if value[i] > high[i] + slack or value[i] < low[i] - slack:
                count += 1
    return count


@kernel
def _take_in(S, low, high, box_low, box_high, scale, state, goal, x, value):
    """Start of the walk: x is the guess's solution moved into the box; violated rows join W."""
    n = x.size
    for j in range(n):
        x[j] = min(max(goal[j], box_low[j]), box_high[j])
        slack = ROUNDING * max(1.0, abs(x[j]))
        if state[j] == 0 and goal[j] > box_high[j] + slack:
            state[j] = 1
        elif state[j] == 0 and goal[j] < box_low[j] - slack:
            state[j] = -1
    _values(S, x, value)
    for i in range(low.size):
        if state[n + i] == 0:
            slack = FEASIBLE * scale[i]
            if value[i] > high[i] + slack:
                state[n + i] = 1
            elif value[i] < low[i] - slack:
                state[n + i] = -1


@kernel
def _beyond(low, high, scale, side, i, value):
    """State of a row that leaves W: free, or held at its other bound if it lies beyond that one."""
    if i >= 0 and side > 0 and value[i] < low[i] - FEASIBLE * scale[i]:
        return -1
    if i >= 0 and side < 0 and value[i] > high[i] + FEASIBLE * scale[i]:
        return 1
    return 0


@kernel
def _block(low, high, box_low, box_high, scale, state, x, goal, value, ahead, bland):
    """Largest step in [0, 1] towards the goal; the row that stops it (or -1) and its side."""
    n = x.size
    alpha, entering, side, steepest = 1.0, -1, 0, 0.0
    for j in range(n + low.size):
        if state[j] != 0:
            continue
        if j < n:
            here, there, bottom, top = x[j], goal[j], box_low[j], box_high[j]
            slack = ROUNDING * max(1.0, abs(there))
        else:
            i = j - n
            here, there, bottom, top = value[i], ahead[i], low[i], high[i]
            slack = FEASIBLE * scale[i]
        if there > top + slack and there > here:
            step, toward = max(0.0, (top - here) / (there - here)), 1
        elif there < bottom - slack and there < here:
            step, toward = max(0.0, (bottom - here) / (there - here)), -1
        else:
            continue
        slope = abs(there - here)
        if step < alpha or (step == alpha and slope > steepest and not bland) or entering < 0:
            alpha, entering, side, steepest = step, j, toward, slope
    return alpha, entering, side


@kernel
def _verdict(low, high, offsets, scale, value):
    """Solved, or infeasible if a hard row keeps a residual."""
    for i in range(offsets[1]):
        slack = FEASIBLE * scale[i]
        if value[i] > high[i] + slack or value[i] < low[i] - slack:
            return INFEASIBLE
    return SOLVED
