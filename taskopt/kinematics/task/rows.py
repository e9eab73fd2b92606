"""What the rows of all tasks are made of: the rate asked for, gains, weights, units."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, finite
from taskopt.errors import InvalidValue
from taskopt.jit import kernel


@kernel
def task_rate(feedforward, gain, error):
    """b = ẋ_d + K e, so that A v = b lets the error die out as ė = −K e (3.67)–(3.70)."""
    return feedforward + gain * error


def gains(gain: ArrayLike, count: int) -> Array:
    """K [1/s] a row, from one number or `count`; raise `InvalidValue` if one is negative."""
    return _each("gain", gain, count, ())


def weights(weight: ArrayLike, count: int, pair: tuple[int, ...] = ()) -> Array:
    """Weight a row, from one number, `count`, or one for each part of `pair`; 0 switches a row off."""
    out = _each("weight", weight, count, pair)
    if not out.any():
        raise InvalidValue("weight must be > 0 for at least one row, got 0 for all")
    return out


def _each(name: str, value: ArrayLike, count: int, pair: tuple[int, ...]) -> Array:
    size = np.size(value)
    if np.ndim(value) == 0:
        out = np.full(count, finite(name, value, ()))
    elif pair and size == len(pair) != count:
        out = np.repeat(finite(name, value, (len(pair),)), pair)
    else:
        out = finite(name, value, (count,))
    if (out < 0.0).any():
        raise InvalidValue(f"{name} must be ≥ 0, got {out.min():g}")
    return out


def rate_units(units: Iterable[str]) -> tuple[str, ...]:
    """Units of the rates of coordinates, "rad" to "rad/s"."""
    return tuple(f"{unit}/s" for unit in units)
