"""Starts of the search: the working set of the last tick, or a point that keeps all hard rows.

Escande, Mansard and Wieber (2014), Sect. 5, start from any working set, as the first search here does. The
start at zero and the perturbed bounds of the second search are our own.
"""

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.tolerances import SEARCH_AGREE, SEARCH_BOX, SEARCH_FEASIBLE, SEARCH_PERTURBATION
from taskopt.jit import kernel
from taskopt.resolver.active_set.linalg import row_values
from taskopt.resolver.active_set.workspace import Count, Held, Point, ScaledRows

_GOLDEN_RATIO = 0.6180339887498949  # its multiples, modulo 1, are spread evenly and never repeat


@kernel
def has_empty_interval(rows: ScaledRows) -> bool:
    """Return True if the lower bound of an unknown or of a hard row exceeds its upper bound.

    Args:
        rows: The problem.

    Returns:
        True if there is one.
    """
    empty = False
    for j in range(rows.box_lower.size):
        empty |= rows.box_lower[j] > rows.box_upper[j]
    for i in range(rows.offsets[1]):
        empty |= rows.lower[i] > rows.upper[i]
    return empty


@kernel
def close_empty(lower: Array, upper: Array, size: Array) -> None:
    """Let bounds that cross by rounding only, so that phase one says that they agree, meet in the middle.

    Args:
        lower: (m,) lower bounds, changed in place.
        upper: (m,) upper bounds, changed in place.
        size: (m,) size of each row.
    """
    for i in range(lower.size):
        gap = lower[i] - upper[i]
        if 0.0 < gap <= SEARCH_AGREE * max(size[i], abs(lower[i])):
            lower[i] = upper[i] = upper[i] + 0.5 * gap


@kernel
def correct_working_set(rows: ScaledRows, state: StateArray) -> None:
    """Correct W so that it holds every equality, and no row or unknown at an infinite bound.

    Args:
        rows: The problem.
        state: (n + M,) `Held` of each unknown and row, corrected.
    """
    n = rows.box_lower.size
    _correct_sides(rows.box_lower, rows.box_upper, state[:n])
    _correct_sides(rows.lower, rows.upper, state[n:])


@kernel
def _correct_sides(lower: Array, upper: Array, state: StateArray) -> None:
    """Correct W for the unknowns, or for the rows."""
    for i in range(lower.size):
        if lower[i] == upper[i]:
            state[i] = Held.UPPER
        elif (state[i] == Held.UPPER and upper[i] == np.inf) or (
            state[i] == Held.LOWER and lower[i] == -np.inf
        ):
            state[i] = Held.FREE


@kernel
def box_side(value: float, lower: float, upper: float) -> int:
    """Return the side of the box that an unknown violates, as a `Held`; FREE if there is none.

    Args:
        value: The unknown.
        lower: Its lower bound.
        upper: Its upper bound.

    Returns:
        The side that is violated by more than rounding.
    """
    slack = SEARCH_BOX * max(1.0, abs(value))
    if value > upper + slack:
        return Held.UPPER
    if value < lower - slack:
        return Held.LOWER
    return Held.FREE


@kernel
def row_side(value: float, lower: float, upper: float, size: float) -> int:
    """Return the bound of a row that its value violates, as a `Held`; FREE if there is none.

    Args:
        value: Value of the row at some point.
        lower: Its lower bound.
        upper: Its upper bound.
        size: Its Euclidean norm ‖a‖.

    Returns:
        The side that is violated by more than rounding.
    """
    slack = SEARCH_FEASIBLE * size
    if value > upper + slack:
        return Held.UPPER
    if value < lower - slack:
        return Held.LOWER
    return Held.FREE


@kernel
def violates(rows: ScaledRows, state: StateArray, goal: Point) -> bool:
    """Return True if a point violates an unknown's bound or a row outside W.

    Args:
        rows: The problem.
        state: (n + M,) the working set.
        goal: The point, with the values of all rows.

    Returns:
        True if it violates one.
    """
    n = goal.x.size
    for j in range(n):
        beyond = box_side(goal.x[j], rows.box_lower[j], rows.box_upper[j])
        if state[j] == Held.FREE and beyond != Held.FREE:
            return True
    for i in range(goal.value.size):
        beyond = row_side(goal.value[i], rows.lower[i], rows.upper[i], rows.size[i])
        if state[n + i] == Held.FREE and beyond != Held.FREE:
            return True
    return False


@kernel
def start_beside(rows: ScaledRows, state: StateArray, goal: Point, here: Point) -> None:
    """Start at the solution of the initial working set, moved into the box; add violated members to W.

    Args:
        rows: The problem.
        state: (n + M,) the initial working set; violated unknowns and rows are added.
        goal: The solution of that working set with the values of all rows.
        here: Filled.
    """
    n = here.x.size
    for j in range(n):
        here.x[j] = min(max(goal.x[j], rows.box_lower[j]), rows.box_upper[j])
        if state[j] == Held.FREE:
            state[j] = box_side(goal.x[j], rows.box_lower[j], rows.box_upper[j])
    row_values(rows.A, here.x, here.value)
    for i in range(here.value.size):
        if state[n + i] == Held.FREE:
            state[n + i] = row_side(here.value[i], rows.lower[i], rows.upper[i], rows.size[i])


@kernel
def zero_is_feasible(rows: ScaledRows) -> bool:
    """Return True if the point of the box nearest to zero keeps all hard rows.

    Args:
        rows: The problem.

    Returns:
        True if it keeps them within the tolerance up to which hard rows count as agreeing.
    """
    for i in range(rows.offsets[1]):
        value, slack = 0.0, SEARCH_AGREE * rows.size[i]
        for j in range(rows.box_lower.size):
            value += rows.A[i, j] * min(max(0.0, rows.box_lower[j]), rows.box_upper[j])
        if value > rows.upper[i] + slack or value < rows.lower[i] - slack:
            return False
    return True


@kernel
def start_at_zero(rows: ScaledRows, state: StateArray, here: Point) -> None:
    """Start at the point of the box nearest to zero; W gets the rows it violates and the bounds it touches.

    Args:
        rows: The problem.
        state: (n + M,) filled.
        here: Filled.
    """
    n = here.x.size
    for j in range(n):
        here.x[j] = min(max(0.0, rows.box_lower[j]), rows.box_upper[j])
        if rows.box_lower[j] < here.x[j] < rows.box_upper[j]:
            state[j] = Held.FREE
        else:
            state[j] = Held.UPPER if here.x[j] == rows.box_upper[j] else Held.LOWER
    row_values(rows.A, here.x, here.value)
    for i in range(here.value.size):
        state[n + i] = row_side(here.value[i], rows.lower[i], rows.upper[i], rows.size[i])


@kernel
def perturbed(rows: ScaledRows, turn: Count) -> ScaledRows:
    """Widen each interval by a different amount, so that no two bounds tie (Charnes 1952).

    Args:
        rows: The problem.
        turn: Number of the attempt; every attempt has other amounts.

    Returns:
        The same rows with new bounds; those of equalities are unchanged.
    """
    n, count = rows.box_lower.size, rows.lower.size
    lower, upper, box_lower, box_upper = np.empty(count), np.empty(count), np.empty(n), np.empty(n)
    for i in range(count):
        apart = rows.size[i] * _share(i, turn) if rows.lower[i] < rows.upper[i] else 0.0
        lower[i], upper[i] = rows.lower[i] - apart, rows.upper[i] + apart
    for j in range(n):
        apart = _share(j, turn) if rows.box_lower[j] < rows.box_upper[j] else 0.0
        box_lower[j], box_upper[j] = rows.box_lower[j] - apart, rows.box_upper[j] + apart
    return ScaledRows(
        rows.A, rows.scale, rows.size, lower, upper, box_lower, box_upper, rows.offsets, rows.rounding
    )


@kernel
def _share(i: int, turn: Count) -> float:
    """Return the part of the perturbation that bound i gets, between once and twice SEARCH_PERTURBATION."""
    return SEARCH_PERTURBATION * (1.0 + ((i + 1) * (turn + 1) * _GOLDEN_RATIO) % 1.0)
