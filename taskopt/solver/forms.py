"""Kernels that write the rows and the box of a program in the forms that packages take."""

import numpy as np
from numpy.typing import NDArray

from taskopt.arrays import Array, IntArray
from taskopt.jit import kernel

Bounds = tuple[Array, Array, Array, Array]  # of rows: lower and upper; of unknowns: lower and upper


@kernel
def joint_bounds(
    given: Bounds, infinity: float, mark: int, bounds: Array, equal: NDArray[np.intc]
) -> bool:  # fmt: skip
    """Write the bounds of the box, followed by those of the rows, clipped to what a package takes for none.

    Args:
        given: Lower and upper bounds of the rows, (m,) each, and of the unknowns, (n,) each.
        infinity: Bound that a package takes for none.
        mark: Mark of an equality.
        bounds: (2, n + m) filled with lower and upper bounds.
        equal: (n + m,) filled with the mark where the two are the same, else with 0.

    Returns:
        True if an unknown has a bound.
    """
    lower, upper, box_lower, box_upper = given
    n, boxed = box_lower.size, False
    for i in range(n + lower.size):
        below = box_lower[i] if i < n else lower[i - n]
        above = box_upper[i] if i < n else upper[i - n]
        boxed |= i < n and (below > -infinity or above < infinity)
        bounds[0, i], bounds[1, i] = max(below, -infinity), min(above, infinity)
        equal[i] = mark if below == above else 0
    return boxed


@kernel
def list_sides(
    given: Bounds, place: IntArray, sign: Array
) -> tuple[int, int]:  # fmt: skip
    """List the sides sign · a x ≤ sign · bound of rows and box, the equalities of rows first.

    Args:
        given: Lower and upper bounds of the rows, (m,) each, and of the unknowns, (n,) each.
        place: (≥ 2 (m + n),) filled with the row of each side, or with m plus the unknown.
        sign: (≥ 2 (m + n),) filled with 1 for an upper bound or an equality, −1 for a lower bound.

    Returns:
        Number of equalities, and number of all sides.
    """
    lower, upper, box_lower, box_upper = given
    m, count = lower.size, 0
    for i in range(m):
        if lower[i] == upper[i]:
            place[count], sign[count] = i, 1.0
            count += 1
    equalities = count
    for i in range(m + box_lower.size):
        below = lower[i] if i < m else box_lower[i - m]
        above = upper[i] if i < m else box_upper[i - m]
        if i >= m or below != above:
            if above < np.inf:
                place[count], sign[count] = i, 1.0
                count += 1
            if below > -np.inf:
                place[count], sign[count] = i, -1.0
                count += 1
    return equalities, count


@kernel
def write_sides(
    C: Array, given: Bounds, place: IntArray, sign: Array,
    columns: Array, sides: Array,
) -> None:  # fmt: skip
    """Write sides as the columns of Gᵀ and h of G x ≥ h.

    Args:
        C: (m, n) rows.
        given: As of `list_sides`.
        place: (≥ p,) as `list_sides` filled it.
        sign: (≥ p,) as `list_sides` filled it.
        columns: (n, p) filled.
        sides: (p,) filled.
    """
    lower, upper, box_lower, box_upper = given
    m, n = C.shape
    for c in range(sides.size):
        i, unknown = place[c], place[c] - m
        for j in range(n):
            entry = C[i, j] if unknown < 0 else (1.0 if unknown == j else 0.0)
            columns[j, c] = -sign[c] * entry
        above = upper[i] if unknown < 0 else box_upper[unknown]
        below = lower[i] if unknown < 0 else box_lower[unknown]
        sides[c] = -sign[c] * (above if sign[c] > 0.0 else below)


@kernel
def join_sides(place: IntArray, sign: Array, y: Array, multipliers: Array) -> None:
    """Add the multipliers of sides to those of their rows and unknowns.

    Args:
        place: (≥ p,) as `list_sides` filled it.
        sign: (≥ p,) as `list_sides` filled it.
        y: (p,) multipliers of the sides; ≥ 0 but for equalities.
        multipliers: (m + n,) added to.
    """
    for c in range(y.size):
        multipliers[place[c]] += sign[c] * y[c]
