"""Files of LexLS, a solver of lexicographic least squares: text with one block of rows for each objective.

Blocks start with `#` and a name: `#HierType`, `#nVar` (n), `#nObj`, `#nCtr` (rows of each objective),
`#ObjType` (100 for simple bounds, 200 for general rows), and `#OBJECTIVE k` with one row in each line. A
simple bound is `index lower upper guess`, in which the index counts from 1. A general row is
`a_1 … a_n lower upper guess`. The guess of the active set, `#SolGuess` and `#Solution` are not needed.

Source: Dimitrov, Sherikov and Wieber (2015), "Efficient resolution of potentially conflicting linear
constraints in robotics"; LexLS, software, BSD-2-Clause.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, bound
from taskopt.errors import InvalidValue

_WITH_GUESS = 210  # the type of hierarchies whose rows end with a guess of the active set
_SIMPLE, _GENERAL = 100, 200


class LexlsFile(NamedTuple):
    """The problem in a file.

    Attributes:
        box: Bounds (lower, upper) of x, (n,) each, which hold whatever the levels ask for: the first
            objective, if it has simple bounds only.
        levels: Rows (A, lower, upper) of each level, highest priority first.
    """

    box: tuple[Array, Array]
    levels: tuple[tuple[Array, Array, Array], ...]


def is_lexls(path: Path) -> bool:
    """Return True if a file is text with the blocks that a file of LexLS begins with.

    Args:
        path: An existing file.

    Returns:
        True for a file of LexLS, complete or not.
    """
    with path.open("rb") as file:
        return b"#HierType" in file.read(4096)


def read(path: Path) -> LexlsFile:
    """Read a file of LexLS.

    Args:
        path: The file.

    Returns:
        Its box and levels.

    Raises:
        InvalidValue: A block is missing, a line has another length than its block asks for, or the type of
            the hierarchy or of an objective is unknown.
    """
    blocks = _blocks(path)
    kind, n = _integers(path, blocks, "#HierType", 1)[0], _integers(path, blocks, "#nVar", 1)[0]
    if kind != _WITH_GUESS:
        raise InvalidValue(f"{path}: #HierType must be {_WITH_GUESS}, rows with a guess, got {kind}")
    count = _integers(path, blocks, "#nObj", 1)[0]
    sizes, kinds = (_integers(path, blocks, name, count) for name in ("#nCtr", "#ObjType"))
    objectives = [_objective(path, blocks, k, kinds[k], sizes[k], n) for k in range(count)]
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    hard = 1 if kinds and kinds[0] == _SIMPLE else 0
    for A, below, above in objectives[:hard]:
        index = np.argmax(A, axis=1)
        np.maximum.at(lower, index, below)
        np.minimum.at(upper, index, above)
    return LexlsFile((lower, upper), tuple(objectives[hard:]))


def _blocks(path: Path) -> dict[str, list[list[float]]]:
    """Return the numbers of each block, line by line."""
    blocks: dict[str, list[list[float]]] = {}
    lines: list[list[float]] = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("#"):
            lines = blocks.setdefault(" ".join(line.split()), [])
        elif line.strip():
            try:
                lines.append([float(word) for word in line.split()])
            except ValueError as error:
                raise InvalidValue(f"{path}, line {number}: {error}") from error
    return blocks


def _block(path: Path, blocks: dict[str, list[list[float]]], name: str) -> list[list[float]]:
    """Return a block, which must be there."""
    if name not in blocks:
        raise InvalidValue(f"{path} is no complete file of LexLS: it has no block {name}")
    return blocks[name]


def _integers(path: Path, blocks: dict[str, list[list[float]]], name: str, count: int) -> list[int]:
    """Return the integers in a block."""
    numbers = [number for line in _block(path, blocks, name) for number in line]
    if len(numbers) != count or any(number != int(number) or number < 0 for number in numbers):
        raise InvalidValue(f"{path}: {name} must hold {count} integers, got {numbers}")
    return [int(number) for number in numbers]


def _objective(
    path: Path, blocks: dict[str, list[list[float]]], k: int, kind: int, size: int, n: int
) -> tuple[Array, Array, Array]:
    """Return the rows (A, lower, upper) of one objective."""
    if kind not in (_SIMPLE, _GENERAL):
        raise InvalidValue(f"{path}: #ObjType must be {_SIMPLE} or {_GENERAL}, got {kind}")
    lines, width = _block(path, blocks, f"#OBJECTIVE {k}"), 4 if kind == _SIMPLE else n + 3
    if len(lines) != size or any(len(line) != width for line in lines):
        got = sorted({len(line) for line in lines})
        raise InvalidValue(
            f"{path}: #OBJECTIVE {k} must have {size} lines of {width} numbers, got {len(lines)} of {got}"
        )
    table = np.array(lines).reshape(size, width)
    lower, upper = (bound(f"#OBJECTIVE {k}", table[:, column], (size,)) for column in (-3, -2))
    if kind == _GENERAL:
        return table[:, :n], lower, upper
    if not np.isin(table[:, 0], np.arange(1, n + 1)).all():
        raise InvalidValue(f"{path}: #OBJECTIVE {k} must bound unknowns 1 to {n}, got {table[:, 0]}")
    return np.eye(n)[table[:, 0].astype(int) - 1], lower, upper
