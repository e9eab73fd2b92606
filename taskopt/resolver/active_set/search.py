"""The exact lexicographic optimum by a primal active set with lexicographic multipliers.

From last tick's working set W: solve the hierarchy with the rows of W as equalities; if a row left
out is violated or a multiplier has the wrong sign, walk. One step goes from x towards the solution
for W up to the first row that blocks, which joins W; at a full step the row with the most negative
multiplier at the *first* wrong level leaves. An active inequality may stay if its own violation,
then its multiplier at each later level, is lexicographically positive. Escande, Mansard and Wieber
(2014), Sect. 5; changing several rows at once, or dropping at a later level, cycles.

Near a singularity a multiplier of 1e-10 decides where x stands, so what counts as zero is no more than the
rounding in the terms that it is the sum of. A sign that is lost in rounding all the same shows when its row
has left: where the next step is blocked by that row at once, it stays until x moves.
"""

import numpy as np

from taskopt.hierarchy.tolerances import LOST
from taskopt.jit import kernel, kernel_apart
from taskopt.resolver.active_set.lexls import factorise, level_multipliers, rotate, solve_levels
from taskopt.resolver.active_set.linalg import copy_into
from taskopt.resolver.active_set.start import (
    AGREE,
    FEASIBLE,
    ROUNDING,
    can_rest,
    crossed,
    nudge,
    only_possible,
    rest_into,
    take_in,
    values_into,
    violated,
)

SOLVED, NOT_DONE, INFEASIBLE, UNSURE = 0, 1, 2, 3
PARDONS = 5  # times that all rows that are held may be let go again, in the second walk
OFTEN = 20  # times that a row may leave before it is held for good
MOVED, NUDGED = 1e-9, 1e-11  # a step that moves no unknown by more, relative, is none
SIGN = 1e-13  # multiplier that counts, relative to the terms that it is the sum of


@kernel_apart
def walk(S, scale, low, high, box_low, box_high, offsets, state, first, limit, x, y):
    """Fill x (n,) and y (levels + 1, n + M), all scaled; `state` is the guess and then the answer.

    Returns (status, factorisations). `offsets` starts with the hard rows, which are level 0. Where the walk
    from the guess leads nowhere in `first` factorisations, it is done again from a point that keeps the hard
    rows, with bounds that tie moved apart by less than what counts as kept (Charnes 1952).
    """
    n, rows = x.size, low.size
    value, size, ones = np.empty(rows), np.empty(rows), np.ones(n)
    for i in range(rows):
        size[i] = max(np.sqrt(S[i] @ S[i]), LOST * scale[i])
    if crossed(low, high, box_low, box_high, offsets):
        x[:] = np.nan
        return INFEASIBLE, 0
    only_possible(low, high, box_low, box_high, state, n)
    first = min(first, limit)
    status, rounds = _walk(
        S, scale, size, low, high, box_low, box_high, offsets, state, True, first, MOVED, 0, x, value, y
    )
    rest = can_rest(S, low, high, box_low, box_high, offsets, size)
    if status == SOLVED or rounds >= limit:
        return (NOT_DONE if status == UNSURE else status), rounds
    apart = np.empty((4, max(n, rows)))
    near_low, near_high, box_near, box_far = apart[0, :rows], apart[1, :rows], apart[2, :n], apart[3, :n]
    nudge(near_low, near_high, low, high, size, rounds)
    nudge(box_near, box_far, box_low, box_high, ones, rounds)
    state[:] = 0
    if rest:
        rest_into(S, near_low, near_high, box_near, box_far, size, state, x, value)
    only_possible(low, high, box_low, box_high, state, n)
    status, more = _walk(
        S,
        scale,
        size,
        near_low,
        near_high,
        box_near,
        box_far,
        offsets,
        state,
        not rest,
        limit - rounds,
        NUDGED,
        PARDONS,
        x,
        value,
        y,
    )
    if status in (SOLVED, UNSURE):
        _settle(S, scale, size, low, high, box_low, box_high, offsets, state, x, y)
        status = SOLVED
    return status, rounds + more


@kernel
def _settle(S, scale, size, low, high, box_low, box_high, offsets, state, x, y):
    """Put x and y to what W has with the true bounds, unless others are then violated."""
    n, rows = x.size, low.size
    target, ahead, goal, prices = np.empty(rows), np.empty(rows), np.empty(n), np.empty(y.shape)
    held = np.zeros(n + rows, np.bool_)
    _solve(S, scale, low, high, box_low, box_high, offsets, state, held, target, goal, prices)
    values_into(S, goal, ahead)
    for j in range(n):
        if not box_low[j] - AGREE <= goal[j] <= box_high[j] + AGREE:
            return
    for i in range(rows):
        slack = AGREE * size[i]
        if (state[n + i] == 0 or i < offsets[1]) and not low[i] - slack <= ahead[i] <= high[i] + slack:
            return
    copy_into(x, goal)
    for k in range(y.shape[0]):
        copy_into(y[k], prices[k])


@kernel_apart
def _walk(
    S, scale, size, low, high, box_low, box_high, offsets, state, fresh, limit, moved, pardons, x, value, y
):  # fmt: skip
    """From the solution of the guess (`fresh`) or from x, whose rows have `value`, as `walk`.

    Status UNSURE: rows that left and came straight back were kept in W, and the signs speak against it.
    """
    n, rows = x.size, low.size
    target, goal, ahead = np.empty(rows), np.empty(n), np.empty(rows)
    left, held = np.zeros(n + rows, np.bool_), np.zeros(n + rows, np.bool_)
    leaves = np.zeros(n + rows, np.int64)
    for iteration in range(1, limit + 1):
        leaving = _solve(S, scale, low, high, box_low, box_high, offsets, state, held, target, goal, y)
        values_into(S, goal, ahead)
        if fresh:  # all of last tick's guess at once
            fresh = False
            wrong = violated(low, high, box_low, box_high, size, state, goal, ahead)
            if wrong > 0:
                take_in(S, low, high, box_low, box_high, size, state, goal, x, value)
                continue
            copy_into(x, goal)
            copy_into(value, ahead)
        alpha, entering, side = _block(low, high, box_low, box_high, size, state, x, goal, value, ahead)
        if _moves(x, goal, alpha, moved):
            left[:] = False
            for j in range(held.size):
                held[j] = leaves[j] > OFTEN
        if entering >= 0:
            held[entering] = left[entering] or leaves[entering] > OFTEN
            for j in range(n):
                x[j] += alpha * (goal[j] - x[j])
            if entering < n:
                x[entering] = box_high[entering] if side > 0 else box_low[entering]
            values_into(S, x, value)
            state[entering] = side
            continue
        copy_into(x, goal)
        copy_into(value, ahead)
        if leaving < 0 and held.any():
            held[:] = False
            leaving = _solve(S, scale, low, high, box_low, box_high, offsets, state, held, target, goal, y)
            if leaving >= 0 and pardons == 0:
                return UNSURE, iteration
            pardons -= 1
            leaves[:] = 0
        if leaving < 0:
            return _verdict(low, high, offsets, size, ahead), iteration
        left[leaving] = True
        leaves[leaving] += 1
        state[leaving] = _beyond(low, high, size, state[leaving], leaving - n, ahead)
    return NOT_DONE, limit


@kernel
def _moves(x, goal, alpha, moved):
    """Whether a step is more than rounding."""
    for j in range(x.size):
        if alpha * abs(goal[j] - x[j]) > moved * max(1.0, abs(x[j])):
            return True
    return False


@kernel_apart
def _solve(S, scale, low, high, box_low, box_high, offsets, state, held, target, x, y):
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
    solution, rotated, residual, terms = np.empty(nf), np.empty(nf), np.empty(rows), np.empty(rows)
    size = 0.0
    for j in range(n):
        if state[j] != 0:
            size += abs(x[j])
    solve_levels(T, scale, order, starts, ranks, target, levels, size, solution, residual, terms)
    copy_into(rotated, solution)
    rotate(V, beta, ranks[levels], rotated)
    for c in range(nf):
        x[free[c]] = rotated[c]
    return _signs(
        S, T, order, starts, ranks, offsets, scale, low, high, box_low, box_high,
        residual, terms, solution, x, state, held, y,
    )  # fmt: skip


@kernel_apart
def _signs(
    S, T, order, starts, ranks, offsets, scale, low, high, box_low, box_high,
    residual, terms, solution, x, state, held, y,
):  # fmt: skip
    """All multipliers; returns the inequality with the worst sign at the first wrong level, or -1."""
    n, levels = x.size, starts.size - 1
    decided = held.copy()
    out, unsure = np.empty(n + low.size), np.empty(n + low.size)
    leaving = -1
    for a in range(starts[levels]):
        i = order[a]
        decided[n + i] |= low[i] == high[i]
    for j in range(n):
        decided[j] |= box_low[j] == box_high[j]
    for k in range(levels + 1):
        level_multipliers(
            S, T, scale, order, starts, ranks, levels, k, residual, terms, solution, x, state, out, unsure
        )
        if k > 0:
            copy_into(y[k - 1], out)
        if leaving >= 0:
            continue
        worst = 0.0
        for j in range(n + low.size):
            if state[j] == 0 or decided[j]:
                continue
            if j >= n and j - n >= offsets[min(k + 1, levels)]:
                continue
            tolerance = SIGN * unsure[j]
            price = state[j] * out[j]
            if price > tolerance:
                decided[j] = True
            elif price < -tolerance and (leaving < 0 or price < worst):
                worst, leaving = price, j
    return leaving


@kernel
def _beyond(low, high, size, side, i, value):
    """State of a row that leaves W: free, or held at its other bound if it lies beyond that one."""
    if i >= 0 and side > 0 and value[i] < low[i] - FEASIBLE * size[i]:
        return -1
    if i >= 0 and side < 0 and value[i] > high[i] + FEASIBLE * size[i]:
        return 1
    return 0


@kernel
def _block(low, high, box_low, box_high, size, state, x, goal, value, ahead):
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
            slack = FEASIBLE * size[i]
        if there > top + slack and there > here:
            step, toward = max(0.0, (top - here) / (there - here)), 1
        elif there < bottom - slack and there < here:
            step, toward = max(0.0, (bottom - here) / (there - here)), -1
        else:
            continue
        slope = abs(there - here)
        if step < alpha or (step == alpha and slope > steepest) or entering < 0:
            alpha, entering, side, steepest = step, j, toward, slope
    return alpha, entering, side


@kernel
def _verdict(low, high, offsets, size, value):
    """Solved, or infeasible if a hard row keeps a residual."""
    for i in range(offsets[1]):
        slack = AGREE * size[i]
        if value[i] > high[i] + slack or value[i] < low[i] - slack:
            return INFEASIBLE
    return SOLVED
