"""Parameters: values of tasks and limits that may change while a stack runs, without a new compilation.

The method `adjustable` of a part returns its parameters. In a plan the address of a parameter is the name of
the part and that of the attribute, as in "hand.weight". Changes are applied at the beginning of a tick
(`taskopt.kinematics.changes`).
"""

from collections.abc import Callable
from typing import Protocol, cast

import numpy as np
from typing_extensions import TypeAliasType

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue

Setting = TypeAliasType("Setting", object)
"""A value of a parameter; each parameter says which ones it takes."""

Ramp = Callable[[float], bool]
"""`ramp(t)` carries a change on at the time t [s], and returns True when it is done."""


class Parameter(Protocol):
    """One value of a task or a limit that may change while a stack runs."""

    def checked(self, value: Setting, over: float) -> Setting:
        """Check a value when it is set, so that an error points at the line that sets it.

        Args:
            value: The value that the user gave.
            over: Time over which the change is blended [s]; 0 for at once.

        Returns:
            The value in the form that `change` takes, with no reference to the user's arrays.

        Raises:
            InvalidValue: The parameter does not accept the value, or cannot be blended over a time.
        """
        ...

    def change(self, value: Setting, t: float, over: float) -> Ramp | None:
        """Write a checked value at the beginning of a tick.

        Args:
            value: The value, as `checked` returned it.
            t: Time of the tick [s].
            over: Time over which the change is blended [s].

        Returns:
            The ramp that continues the change in later ticks, or None if the change is complete.
        """
        ...

    def read(self) -> Setting:
        """Return the present value, as a copy."""
        ...


class Numbers:
    """A parameter that is one number, or one number for each row, joint or pair (an array).

    Args:
        array: The present numbers, overwritten by each change; a single number has the shape (1,).
        each: Function that converts the user's value to one number for each entry of `array`, or to one float
            for all; it raises `InvalidValue`.
        written: Function that is called after each change; None if a tick reads `array` itself.
        geometric: True blends by equal ratios, which suits weights, False by equal steps.
    """

    def __init__(
        self,
        array: Array,
        each: Callable[[ArrayLike], Array | float],
        written: Callable[[], None] | None = None,
        *,
        geometric: bool = False,
    ) -> None:
        self._array, self._each, self._written, self._geometric = array, each, written, geometric

    def checked(self, value: Setting, over: float) -> Array | float:  # noqa: ARG002 (protocol)
        """Return one number for each entry, or one float for all; see `Parameter.checked`.

        Raises:
            InvalidValue: A number is out of its range, or there are too many or too few numbers.
        """
        return self._each(value)  # type: ignore[arg-type]

    def change(self, value: Setting, t: float, over: float) -> Ramp | None:
        """Write the numbers, at once or over a time; see `Parameter.change`."""
        if over <= 0.0:
            if value.__class__ is float:  # `fill` is four times as fast as an assignment
                self._array.fill(value)
            else:
                self._array[...] = value  # type: ignore[call-overload]
            if self._written is not None:
                self._written()
            return None
        begin, end = self._array.copy(), np.broadcast_to(cast("Array", value), self._array.shape)
        geometric = self._geometric and bool((begin > 0.0).all() and (end > 0.0).all())

        def ramp(now: float) -> bool:
            s = min(max((now - t) / over, 0.0), 1.0)
            if s < 1.0:
                self._array[...] = begin * (end / begin) ** s if geometric else begin + s * (end - begin)
            else:
                self._array[...] = end
            if self._written is not None:
                self._written()
            return s >= 1.0

        ramp(t)
        return ramp

    def read(self) -> Array | float:
        """Return a copy of the numbers, or one float where all are equal."""
        return compact(self._array)


class Followed:
    """A parameter with a function that is called after each of its changes.

    Args:
        parameter: The parameter.
        then: The function that is called.
    """

    def __init__(self, parameter: Parameter, then: Callable[[], None]) -> None:
        self._parameter, self._then = parameter, then

    def checked(self, value: Setting, over: float) -> Setting:
        """Return the value as the parameter checks it; see `Parameter.checked`."""
        return self._parameter.checked(value, over)

    def change(self, value: Setting, t: float, over: float) -> Ramp | None:
        """Write the value, and call the function; see `Parameter.change`."""
        ramp = self._parameter.change(value, t, over)
        self._then()
        if ramp is None:
            return None

        def followed(now: float) -> bool:
            done = ramp(now)
            self._then()
            return done

        return followed

    def read(self) -> Setting:
        """Return the present value."""
        return self._parameter.read()


def compact(numbers: Array) -> Array | float:
    """Write numbers as a user reads them.

    Args:
        numbers: Any number of numbers, as of a limit that no joint has.

    Returns:
        One float where there are numbers and all are equal, else a copy of the array.
    """
    first = float(numbers.flat[0]) if numbers.size else 0.0
    return first if numbers.size and bool((numbers == first).all()) else numbers.copy()


def one_number(name: str, value: ArrayLike, least: float, most: float = np.inf) -> float:
    """Check a number that is set while a stack runs.

    Args:
        name: Name of the parameter, for the message.
        value: The value that the user gave.
        least: The number must be larger than this.
        most: The number must not be larger than this.

    Returns:
        The number.

    Raises:
        InvalidValue: The value is not a finite number, or is out of its range.
    """
    number = float(finite(name, value, ()))
    if not least < number <= most:
        allowed = f"> {least:g}" if most == np.inf else f"in ({least:g}, {most:g}]"
        raise InvalidValue(f"{name} must be {allowed}, got {number:g}")
    return number
