"""A hierarchy as one file: numbers as arrays, names as JSON text; nothing in it is ever executed."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from taskopt.errors import InvalidValue, MissingFile
from taskopt.hierarchy.layout import Block, Layout
from taskopt.hierarchy.problem import Hierarchy

_FORMAT = 1


def write(hierarchy: Hierarchy, path: Path) -> None:
    """Write buffer, norm and layout; the file is there as a whole or not at all."""
    names = json.dumps({"format": _FORMAT, **asdict(hierarchy.layout)})
    part = path.with_name(f"{path.name}.part")
    with part.open("wb") as file:
        np.savez_compressed(file, buffer=hierarchy.buffer, norm=hierarchy.norm, layout=np.array(names))
    part.replace(path)


def read(path: Path) -> Hierarchy:
    """The hierarchy of a file; its arrays must fit its names."""
    if not path.is_file():
        raise MissingFile(f"no hierarchy file '{path}'; Hierarchy.save(path) writes one")
    try:
        with np.load(path, allow_pickle=False) as file:
            buffer, norm, text = file["buffer"], file["norm"], str(file["layout"])
        layout = _layout(json.loads(text))
    except (BadZipFile, EOFError, KeyError, TypeError, ValueError) as error:
        raise InvalidValue(f"{path} is not a hierarchy that Hierarchy.save wrote: {error}") from error
    if buffer.shape != (layout.size,) or norm.shape not in ((layout.n,), (layout.n, layout.n)):
        raise InvalidValue(f"{path}: the numbers do not fit the names, {buffer.size} for {layout.size}")
    return Hierarchy.view(layout, np.ascontiguousarray(buffer, np.float64), np.asarray(norm, np.float64))


def _layout(names: dict[str, Any]) -> Layout:
    """A layout from what JSON makes of it; raises what reading the wrong thing raises."""
    if names.pop("format") != _FORMAT:
        raise ValueError(f"this version reads format {_FORMAT}")
    blocks = tuple(Block(**_with_tuples(block)) for block in names.pop("blocks"))
    return Layout(blocks=blocks, **_with_tuples(names))


def _with_tuples(names: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in names.items()}
