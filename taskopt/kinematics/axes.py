"""Which of the six rows of a frame a task takes: a word like "xy" or "xyz rpy", or truth values."""

from collections.abc import Sequence

import numpy as np

from taskopt.arrays import IntArray
from taskopt.errors import InvalidValue

ROW_NAMES = ("x", "y", "z", "rx", "ry", "rz")
ROW_UNITS = ("m/s", "m/s", "m/s", "rad/s", "rad/s", "rad/s")


def chosen_rows(axes: str | Sequence[bool], letters: str, first: int = 0) -> IntArray:
    """Indices into the six rows that `axes` chooses among `letters`, the first of which is row `first`.

    Letters are read from left to right in the order of `letters`, and a blank goes on to the
    orientation: "xyz", "xy y" (position in the plane, and yaw), "rp". Or one truth value a letter.
    Raises `InvalidValue` if nothing, or something else, is chosen.
    """
    chosen: list[int] = []
    if isinstance(axes, str):
        at = 0
        for letter in axes:
            if letter == " ":
                at = max(at, letters.find("rpy"))
                continue
            at = letters.find(letter, at)
            if at < 0:
                raise InvalidValue(f"axes must be letters of '{letters}' in this order, got '{axes}'")
            chosen.append(at)
            at += 1
    else:
        mask = np.asarray(axes)
        if mask.shape != (len(letters),) or not np.isin(mask, (0, 1)).all():
            raise InvalidValue(
                f"axes must be {len(letters)} truth values, one for each of '{letters}', got {axes}"
            )
        chosen = np.flatnonzero(mask).tolist()
    if not chosen:
        raise InvalidValue(f"axes chooses no row; name some of '{letters}'")
    return np.array(chosen, dtype=np.int64) + first
