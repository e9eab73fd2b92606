"""Where values stand relative to their bounds: the one place that says how far outside an interval is."""

import numpy as np

from taskopt.arrays import Array, IntArray


def excess(value: Array, lower: Array, upper: Array) -> Array:
    """Return by how much each value lies outside its interval: max(lower − value, value − upper).

    Args:
        value: Values, (m,).
        lower: Lower bounds, (m,); −inf where there is none.
        upper: Upper bounds, (m,); inf where there is none.

    Returns:
        (m,) in the unit of the values: positive outside, negative inside, the distance to the nearer bound.
    """
    return np.maximum(lower - value, value - upper)


def signed_distance(value: Array, lower: Array, upper: Array) -> Array:
    """Return the distance of each value to its interval, with the sign of the side that it left.

    Args:
        value: Values, (m,).
        lower: Lower bounds, (m,).
        upper: Upper bounds, (m,).

    Returns:
        (m,): value − upper above the upper bound, value − lower (negative) below the lower one, 0 inside.
    """
    return value - np.clip(value, lower, upper)


def nearer_side(value: Array, lower: Array, upper: Array) -> IntArray:
    """Return the side of the bound that each value is nearer to.

    Args:
        value: Values, (m,).
        lower: Lower bounds, (m,).
        upper: Upper bounds, (m,).

    Returns:
        (m,): 1 where the upper bound is at most as far as the lower one, else −1.
    """
    return np.where(np.abs(upper - value) <= np.abs(value - lower), 1, -1)
