"""Array types, and the checks of every array that a user gives.

The types have short names, so that `help()` prints `Array` instead of the type parameters of NumPy.
"""

from collections.abc import Iterable, Mapping
from reprlib import repr as shortened
from typing import Any

import numpy as np
import numpy.typing as npt
from typing_extensions import TypeAliasType

from taskopt.errors import InvalidValue

Array = TypeAliasType("Array", npt.NDArray[np.float64])
IntArray = TypeAliasType("IntArray", npt.NDArray[np.int64])
BoolArray = TypeAliasType("BoolArray", npt.NDArray[np.bool_])
StateArray = TypeAliasType("StateArray", npt.NDArray[np.int8])  # −1 lower, 0 inactive, +1 upper
AnyArray = TypeAliasType("AnyArray", npt.NDArray[Any])  # numbers, texts or objects
Mask = TypeAliasType("Mask", npt.NDArray[np.bool_])
ObjectArray = TypeAliasType("ObjectArray", npt.NDArray[np.object_])
ArrayLike = TypeAliasType("ArrayLike", npt.ArrayLike)  # lists, tuples, numbers, arrays


NO_BOUND = 1e20
"""A bound of this size or more is none. Files and solvers write "none" as 1e20, 1e30 or 1.8e308."""


def finite(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """Copy finite numbers into an array.

    Args:
        name: Name of the value in messages.
        value: Numbers, as an array or in nested lists.
        shape: The shape that is expected; None accepts any length along that axis.

    Returns:
        A new float64 array in C order.

    Raises:
        InvalidValue: The value is not an array of numbers, has another shape, or holds NaN or ±inf.
    """
    array = number(name, value, shape)
    if not np.isfinite(array).all():
        raise InvalidValue(f"{name} has a value that is not finite{_where(~np.isfinite(array))}")
    return array


def number(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """Copy numbers into an array; ±inf is allowed.

    Args:
        name: Name of the value in messages.
        value: Numbers, as an array or in nested lists.
        shape: The shape that is expected; None accepts any length along that axis.

    Returns:
        A new float64 array in C order.

    Raises:
        InvalidValue: The value is not an array of real numbers, has another shape, or holds NaN.
    """
    try:
        if value is None or np.iscomplexobj(value):  # NumPy makes NaN of None
            raise TypeError
        array = np.array(value, dtype=np.float64, order="C")
    except OverflowError as error:
        raise InvalidValue(
            f"{name} must be numbers below 1.8e308, the largest float, got {shortened(value)}; inf means none"
        ) from error
    except (TypeError, ValueError) as error:
        raise InvalidValue(f"{name} must be numbers, got {shortened(value)}") from error
    fits = array.ndim == len(shape) and all(
        want is None or want == got for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        expected = "×".join("any" if s is None else str(s) for s in shape)
        got = "×".join(map(str, array.shape)) or "a single number"
        raise InvalidValue(f"{name} must have shape {expected or 'of a number'}, got {got}")
    if np.isnan(array).any():
        raise InvalidValue(f"{name} has NaN{_where(np.isnan(array))}")
    return array


def bound(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """Copy bounds into an array; what is at least `NO_BOUND` in size means that there is no bound.

    Args:
        name: Name of the value in messages.
        value: Numbers, as an array or in nested lists.
        shape: The shape that is expected; None accepts any length along that axis.

    Returns:
        A new float64 array in C order, with ±inf for every number that means "none".

    Raises:
        InvalidValue: As `number`.
    """
    array = number(name, value, shape)
    array[array >= NO_BOUND], array[array <= -NO_BOUND] = np.inf, -np.inf
    return array


def positive(name: str, value: ArrayLike) -> float:
    """Check that a number is finite and > 0, and return it.

    Args:
        name: Name of the value in messages.
        value: The number.

    Returns:
        The number as a float.

    Raises:
        InvalidValue: The value is not a single number, is not finite, or is ≤ 0.
    """
    result = float(finite(name, value, ()))
    if result <= 0.0:
        raise InvalidValue(f"{name} must be > 0, got {result:g}")
    return result


def require_mapping(name: str, value: object, example: str) -> None:
    """Check that a value is a mapping.

    Args:
        name: Name of the value in messages.
        value: The value that the user gave.
        example: A mapping as it should be, for the message.

    Raises:
        InvalidValue: The value is no mapping.
    """
    if not isinstance(value, Mapping):
        raise InvalidValue(f"{name} must be a mapping such as {example}, got {shortened(value)}")


def names_in(what: str, value: str | Iterable[str]) -> list[str]:
    """Return one name or several as a list.

    Args:
        what: Name of the argument in messages.
        value: One name, or several.

    Returns:
        The names.

    Raises:
        InvalidValue: The value is neither, such as None.
    """
    if not isinstance(value, Iterable):
        raise InvalidValue(f"{what} must be names of joints, got {value!r}; leave it out for none")
    return [value] if isinstance(value, str) else list(value)


def _where(mask: Mask) -> str:
    """Return the index of the first True entry as text, which is empty for a single number."""
    index = tuple(int(i) for i in np.argwhere(mask)[0])
    return f" at index {index if len(index) != 1 else index[0]}" if index else ""
