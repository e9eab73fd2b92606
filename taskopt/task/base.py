"""What every task is: a declaration that, bound to a robot, fills its rows in place on every tick."""

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, finite
from taskopt.configuration import Configuration
from taskopt.errors import InvalidValue
from taskopt.jit import kernel
from taskopt.problem.hierarchy import LevelRows
from taskopt.robot import Robot


class BoundTask(Protocol):
    """A task of one robot in one plan: rows A v = b, or lower ≤ A v ≤ upper, and their names.

    `error` is e = x_d − x of the last `fill`, unweighted, one number a row; `gain` K [1/s] is what
    multiplies it. `column[i]` is j where row i is e_j for good, else −1. Frame tasks have the name of
    their `frame` and the poses `target` and `actual` (4, 4) of the last `fill`; elsewhere None.
    """

    name: str
    row_names: tuple[str, ...]
    row_units: tuple[str, ...]  # of b and of the residual A v − b
    column: tuple[int, ...]
    weight: Array
    gain: Array
    error: Array
    constant: bool  # what `prepare` wrote never changes, and `fill` need not be called

    @property
    def frame(self) -> str | None: ...
    @property
    def target(self) -> Array | None: ...
    @property
    def actual(self) -> Array | None: ...

    def prepare(self, rows: LevelRows) -> None:
        """Write once what never changes; A arrives full of zeros."""
        ...

    def start(self, at: Configuration, t: float) -> None:
        """Anchor references that begin at the start posture, at the time t [s]."""
        ...

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows at a configuration and time, in place, without allocating."""
        ...


@runtime_checkable
class Task(Protocol):
    """A declaration, known to no robot yet."""

    @property
    def name(self) -> str | None: ...

    def bind(self, robot: Robot, name: str) -> BoundTask:
        """The task's rows for a robot; raise `UnknownName` for a frame or joint that it lacks."""
        ...

    def default_name(self) -> str:
        """What the stack calls it if it has no name."""
        ...


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


def rate_units(units: Any) -> tuple[str, ...]:
    """Units of the rates of coordinates, "rad" to "rad/s"."""
    return tuple(f"{unit}/s" for unit in units)
