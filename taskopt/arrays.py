"""Array types, and the checks that every array from outside passes."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from taskopt.errors import InvalidValue

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
StateArray = NDArray[np.int8]


def finite(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """A float64 copy of `value`, C-ordered; raise `InvalidValue` on a wrong shape or NaN, inf.

    `None` in `shape` accepts any length on that axis.
    """
    array = number(name, value, shape)
    if not np.isfinite(array).all():
        raise InvalidValue(f"{name} has a value that is not finite at {_where(~np.isfinite(array))}")
    return array


def bound(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """As `finite`, but ±inf is allowed and means no bound; NaN is still refused."""
    return number(name, value, shape)


def number(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """A float64 copy of `value` without NaN, of the shape given."""
    try:
        if np.iscomplexobj(value):
            raise TypeError("complex")
        array = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InvalidValue(f"{name} must be numbers, got {value!r}") from error
    fits = array.ndim == len(shape) and all(
        want is None or want == got for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        expected = "×".join("any" if s is None else str(s) for s in shape)
        got = "×".join(map(str, array.shape)) or "a single number"
        raise InvalidValue(f"{name} must have shape {expected or 'of a number'}, got {got}")
    if np.isnan(array).any():
        raise InvalidValue(f"{name} has NaN at {_where(np.isnan(array))}")
    return array


def positive(name: str, value: Any) -> float:
    """A finite number > 0; raise `InvalidValue` otherwise."""
    result = float(finite(name, value, ()))
    if result <= 0.0:
        raise InvalidValue(f"{name} must be > 0, got {result:g}")
    return result


def _where(mask: NDArray[np.bool_]) -> str:
    index = tuple(int(i) for i in np.argwhere(mask)[0])
    return f"index {index if len(index) != 1 else index[0]}"
