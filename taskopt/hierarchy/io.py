"""Files of hierarchies: numbers as arrays, names as JSON text. Nothing in a file is ever executed."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue, MissingFile
from taskopt.hierarchy.layout import Block, Layout

_FORMAT = 2
_WITHOUT_LABELS = 1  # the format before rows had labels


def write(path: Path, layout: Layout, buffer: Array, norm: Array) -> None:
    """Write names and numbers of a hierarchy to one .npz file.

    Args:
        path: The file; it is written completely or not at all.
        layout: Names and sizes.
        buffer: The flat buffer, (`layout.size`,).
        norm: W, (n,) or (n, n).
    """
    part = path.with_name(f"{path.name}.part")
    with part.open("wb") as file:
        np.savez_compressed(file, buffer=buffer, norm=norm, layout=np.array(names_of(layout)))
    part.replace(path)


def names_of(layout: Layout) -> str:
    """Write the names and sizes of a hierarchy as text.

    Args:
        layout: Names and sizes.

    Returns:
        JSON text, which `layout_of` reads.
    """
    return json.dumps({"format": _FORMAT, **asdict(layout)})


def layout_of(text: str) -> Layout:
    """Read the names and sizes of a hierarchy from text of the present format.

    Args:
        text: The text that `names_of` wrote.

    Returns:
        The layout.

    Raises:
        KeyError: A part is missing.
        TypeError: A part is not known.
        ValueError: The text is no JSON, or has another format.
    """
    names = json.loads(text)
    if names["format"] != _FORMAT:
        raise ValueError(f"names of format {names['format']}; this version reads {_FORMAT}")
    return _layout(names)


def read(path: Path) -> tuple[Layout, Array, Array]:
    """Read a file that `write` wrote.

    Args:
        path: The file.

    Returns:
        Layout, buffer and norm.

    Raises:
        MissingFile: There is no such file.
        InvalidValue: `write` did not write the file, or its numbers do not fit its names.
    """
    if not path.is_file():
        raise MissingFile(f"no hierarchy file '{path}'; Hierarchy.save(path) writes one")
    try:
        with np.load(path, allow_pickle=False) as file:
            buffer, norm, text = file["buffer"], file["norm"], str(file["layout"])
        names = json.loads(text)
        labelled = names["format"] != _WITHOUT_LABELS
        layout = _layout(names)
        buffer = buffer if labelled else _with_labels(layout, buffer)
    except (BadZipFile, EOFError, KeyError, TypeError, ValueError) as error:
        raise InvalidValue(f"{path} is not a hierarchy that Hierarchy.save wrote: {error}") from error
    if buffer.shape != (layout.size,) or norm.shape not in ((layout.n,), (layout.n, layout.n)):
        raise InvalidValue(f"{path}: the numbers do not fit the names, {buffer.size} for {layout.size}")
    return layout, np.ascontiguousarray(buffer, np.float64), np.asarray(norm, np.float64)


def _layout(names: dict[str, Any]) -> Layout:
    """Make the layout from the names in a file; errors of wrong names are passed on."""
    if names.pop("format") not in (_WITHOUT_LABELS, _FORMAT):
        raise ValueError(f"this version reads the formats {_WITHOUT_LABELS} and {_FORMAT}")
    blocks = tuple(Block(**_with_tuples(block)) for block in names.pop("blocks"))
    return Layout(blocks=blocks, **_with_tuples(names))


def _with_labels(layout: Layout, buffer: Array) -> Array:
    """Give each row of an older buffer the label 0, by which it has its own name."""
    if buffer.shape != (layout.size - layout.row_count,):
        raise ValueError(f"{buffer.size} numbers do not fit the names")
    return np.insert(buffer, buffer.size - 4 * layout.n, np.zeros(layout.row_count))


def _with_tuples(names: dict[str, Any]) -> dict[str, Any]:
    """Return the same entries with tuples for lists, as frozen records hold them."""
    return {key: tuple(value) if isinstance(value, list) else value for key, value in names.items()}
