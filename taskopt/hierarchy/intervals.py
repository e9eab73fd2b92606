"""Distances of values from their bounds, as every module of the package measures them."""

import numpy as np

from taskopt.arrays import Array, IntArray


def excess(value: Array, lower: Array, upper: Array) -> Array:
    """Return the excess of each value over its interval, max(lower − value, value − upper).

    Args:
        value: Values, (m,).
        lower: Lower bounds, (m,); −inf where there is none.
        upper: Upper bounds, (m,); inf where there is none.

    Returns:
        (m,) in the unit of the values: positive outside the interval and negative inside; the magnitude is
        the distance to the nearer bound.
    """
    return np.maximum(lower - value, value - upper)


def signed_distance(value: Array, lower: Array, upper: Array) -> Array:
    """Return the distance of each value to its interval, with a sign for the side.

    Args:
        value: Values, (m,).
        lower: Lower bounds, (m,).
        upper: Upper bounds, (m,).

    Returns:
        (m,): value − upper above the upper bound, value − lower (negative) below the lower one, 0 inside.
    """
    return value - np.clip(value, lower, upper)


def nearer_side(value: Array, lower: Array, upper: Array) -> IntArray:
    """Return the side of the nearer bound of each value.

    Args:
        value: Values, (m,).
        lower: Lower bounds, (m,).
        upper: Upper bounds, (m,).

    Returns:
        (m,): 1 where the upper bound is at least as near as the lower one, else −1.
    """
    return np.where(np.abs(upper - value) <= np.abs(value - lower), 1, -1)
