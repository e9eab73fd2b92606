"""The slots of a log: one slot is the raw record of one tick, a row of numbers at fixed places.

The control loop copies numbers into a slot, and a separate process (`writer`) turns slots into rows of an
Arrow file. Both know the places from the same list of fields. What is a column of the file, and under which
name and unit, is a second list, so that the writer knows nothing about hierarchies.
"""

from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

TEXT_BYTES = 4096  # of a slot for sentences; a longer text is cut, and says so
NANOSECONDS = 10**9  # in a second
PERIOD = 0.2  # [s] between two batches of rows in the file
SLOT_ALIGNMENT = 64  # [bytes] the length of a cache line, so that no two slots share one


class Field(NamedTuple):
    """Numbers of one kind in a slot.

    Attributes:
        name: Name of the field.
        kind: NumPy's code of their type, such as "<f8".
        size: Number of them.
    """

    name: str
    kind: str
    size: int


class Column(NamedTuple):
    """A column of the file, whose values are a part of a field.

    Attributes:
        name: Name of the column.
        field: Name of the field.
        start: First number of the field.
        stop: The number after the last one; `start` + 1 for one value in each row instead of a list.
        listed: True if each row has a list of numbers, even if it has one only.
        when: Name of a number of the field "numbers" that must not be 0, or the row has no value; "" if every
            row has one.
        words: Words that the numbers stand for, from 0 on; empty if they are numbers.
        unit: Unit of the values; "" where there is none or where they differ.
        names: Name of each entry of the list; empty where there is none.
        about: What it is, in words.
    """

    name: str
    field: str
    start: int
    stop: int
    listed: bool = False
    when: str = ""
    words: tuple[str, ...] = ()
    unit: str = ""
    names: tuple[str, ...] = ()
    about: str = ""


NUMBERS = (
    "tick", "clock", "resolver", "status", "iterations", "failed", "timed", "remembers", "has_previous",
    "alternates", "has_ranks", "damped", "undamped_status", "undamped_iterations", "damped_remembers",
    "damped_has_previous", "damped_alternates", "changed", "given", "foreign", "text",
)  # fmt: skip
"""The integers of a slot, in the order of the field "numbers"; "text" is the length of the text in bytes."""


def view_fields(memory: Bytes, fields: Sequence[Field], slots: int) -> dict[str, NDArray[np.generic]]:
    """Return the fields of all slots as views.

    Args:
        memory: The memory of the slots, (slots · `slot_size`,).
        fields: The fields of a slot.
        slots: Number of slots.

    Returns:
        Array (slots, size) of each field, by its name.
    """
    length, starts, found = slot_size(fields), offsets_of(fields), {}
    for field in fields:
        kind = np.dtype(field.kind)
        shape, strides = (slots, field.size), (length, kind.itemsize)
        found[field.name] = np.ndarray(shape, kind, memory.data, starts[field.name], strides)
    return found


def offsets_of(fields: Sequence[Field]) -> dict[str, int]:
    """Return where the fields of a slot begin.

    Args:
        fields: The fields of a slot.

    Returns:
        The first byte of each field, by its name.
    """
    sizes = [_padded(field.size * np.dtype(field.kind).itemsize, 8) for field in fields]
    starts = accumulate(sizes, initial=0)
    return {field.name: start for field, start in zip(fields, starts, strict=False)}


def slot_size(fields: Sequence[Field]) -> int:
    """Return the length of a slot.

    Args:
        fields: The fields of a slot.

    Returns:
        The length in bytes.
    """
    content = sum(_padded(field.size * np.dtype(field.kind).itemsize, 8) for field in fields)
    return _padded(content, SLOT_ALIGNMENT)


def _padded(size: int, unit: int) -> int:
    """Round a size up to a multiple of a unit."""
    return -(-size // unit) * unit
