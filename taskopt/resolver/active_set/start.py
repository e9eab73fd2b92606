"""Where the walk of `working_set` starts: the guess of the last tick, or a point that keeps all hard rows."""

import numpy as np

from taskopt.jit import kernel

AGREE = 1e-9  # hard rows that contradict each other by less, relative to the row's norm, agree
FEASIBLE = 1e-12  # violation that counts, likewise
ROUNDING = 1e-12  # by how much x may pass a bound of the box before it counts; it is then put back
NUDGE = 5e-10  # by how much bounds are moved apart, relative to the row
_GOLDEN = 0.6180339887498949


@kernel
def crossed(low, high, box_low, box_high, offsets):
    """Whether a hard interval is empty."""
    hard = offsets[1]
    return (box_low > box_high).any() or (low[:hard] > high[:hard]).any()


@kernel
def only_possible(low, high, box_low, box_high, state, n):
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
def violated(low, high, box_low, box_high, size, state, x, value):
    """Number of inequalities outside W that x violates."""
    n, count = x.size, 0
    for j in range(n):
        slack = ROUNDING * max(1.0, abs(x[j]))
        if state[j] == 0 and (x[j] > box_high[j] + slack or x[j] < box_low[j] - slack):
            count += 1
    for i in range(low.size):
        if state[n + i] == 0:
            slack = FEASIBLE * size[i]
            if value[i] > high[i] + slack or value[i] < low[i] - slack:
                count += 1
    return count


@kernel
def take_in(S, low, high, box_low, box_high, size, state, goal, x, value):
    """Start of the walk: x is the guess's solution moved into the box; violated rows join W."""
    n = x.size
    for j in range(n):
        x[j] = min(max(goal[j], box_low[j]), box_high[j])
        slack = ROUNDING * max(1.0, abs(x[j]))
        if state[j] == 0 and goal[j] > box_high[j] + slack:
            state[j] = 1
        elif state[j] == 0 and goal[j] < box_low[j] - slack:
            state[j] = -1
    values_into(S, x, value)
    for i in range(low.size):
        if state[n + i] == 0:
            slack = FEASIBLE * size[i]
            if value[i] > high[i] + slack:
                state[n + i] = 1
            elif value[i] < low[i] - slack:
                state[n + i] = -1


@kernel
def can_rest(S, low, high, box_low, box_high, offsets, size):
    """Whether the point of the box nearest to zero keeps all hard rows."""
    for i in range(offsets[1]):
        value = 0.0
        for j in range(box_low.size):
            value += S[i, j] * min(max(0.0, box_low[j]), box_high[j])
        if value > high[i] + AGREE * size[i] or value < low[i] - AGREE * size[i]:
            return False
    return True


@kernel
def rest_into(S, low, high, box_low, box_high, size, state, x, value):
    """Start of the walk at the point of the box nearest to zero; what it violates or touches is W."""
    n = x.size
    for j in range(n):
        x[j] = min(max(0.0, box_low[j]), box_high[j])
        state[j] = 0 if box_low[j] < x[j] < box_high[j] else (1 if x[j] == box_high[j] else -1)
    values_into(S, x, value)
    for i in range(low.size):
        slack = FEASIBLE * size[i]
        state[n + i] = 1 if value[i] > high[i] + slack else (-1 if value[i] < low[i] - slack else 0)


@kernel
def values_into(S, x, value):
    """S x, row by row."""
    for i in range(value.size):
        total = 0.0
        for j in range(x.size):
            total += S[i, j] * x[j]
        value[i] = total


@kernel
def nudge(low, high, from_low, from_high, size, turn):
    """Open each interval by a share of its own, so that no two bounds are met at the same point.

    Another `turn`, other shares.
    """
    for i in range(low.size):
        apart = (
            size[i] * NUDGE * (1.0 + ((i + 1) * (turn + 1) * _GOLDEN) % 1.0)
            if from_low[i] < from_high[i]
            else 0.0
        )
        low[i], high[i] = from_low[i] - apart, from_high[i] + apart
