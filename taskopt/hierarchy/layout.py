"""Where everything of a hierarchy stands: names, and places in one flat buffer.

A hierarchy is rows and bounds at one tick. They live in a single float64 array, so that a tick is
handed to a compiled kernel, copied, or logged as one thing.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count

import numpy as np

from taskopt.arrays import IntArray


def numbered(names: Iterable[str]) -> list[str]:
    """The names; one that is taken gets the next number that is free."""
    taken: list[str] = []
    for name in names:
        free = (f"{name} {i}" for i in count(2))
        taken.append(name if name not in taken else next(n for n in free if n not in taken))
    return taken


@dataclass(frozen=True)
class Block:
    """The rows of one task, or of one limit that is not a bound on a single unknown."""

    name: str
    level: int  # 0: hard limits; 1, 2, …: levels in order of priority
    start: int
    stop: int
    row_names: tuple[str, ...]
    row_units: tuple[str, ...]

    @property
    def rows(self) -> slice:
        return slice(self.start, self.stop)


@dataclass(frozen=True)
class Layout:
    """Names and sizes: n unknowns, M rows (hard ones first, then level by level).

    `offsets[k] : offsets[k + 1]` are the rows of level k, level 0 being the hard rows. `column[i]`
    is j where row i is fixed to the unit vector e_j for good, else -1: kernels use it to skip work.
    """

    unknowns: tuple[str, ...]
    blocks: tuple[Block, ...]
    level_count: int
    owners: tuple[str, ...] = ("box",)  # limits that a bound of the box may come from
    column: tuple[int, ...] = field(default=())
    unknown_units: tuple[str, ...] = ()  # of each unknown; none where the unknowns are plain numbers

    @cached_property
    def n(self) -> int:
        return len(self.unknowns)

    @cached_property
    def row_count(self) -> int:
        return sum(len(block.row_names) for block in self.blocks)

    @cached_property
    def width(self) -> int:
        """n + M: unknowns and rows, as multipliers and active sets count them."""
        return self.n + self.row_count

    @cached_property
    def offsets(self) -> IntArray:
        """First row of level 0 (hard), 1, …, and the end: level_count + 2 numbers."""
        counts = np.zeros(self.level_count + 2, dtype=np.int64)
        for block in self.blocks:
            counts[block.level + 1] += block.stop - block.start
        return np.cumsum(counts)

    @cached_property
    def columns(self) -> IntArray:
        """`column` as an array, -1 everywhere if none was given."""
        if not self.column:
            return np.full(self.row_count, -1, dtype=np.int64)
        return np.array(self.column, dtype=np.int64)

    @cached_property
    def row_names(self) -> tuple[str, ...]:
        return tuple(f"{b.name}/{row}" for b in self.blocks for row in b.row_names)

    @cached_property
    def size(self) -> int:
        """Length of the buffer: A (M n), lower, upper, weight (M each), box lower, upper, owners (n each)."""
        return self.row_count * (self.n + 3) + 4 * self.n

    @cached_property
    def answer_size(self) -> int:
        """Length of an answer: x (n), multipliers (levels + 1)(n + M), certificate (levels + 1) 4, buffer."""
        return self.n + (self.level_count + 1) * (self.width + 4) + self.size

    def unit(self, i: int) -> str:
        """Unit of unknown i < n, or of row i − n."""
        if i < self.n:
            return self.unknown_units[i] if self.unknown_units else ""
        block = next(block for block in self.blocks if block.start <= i - self.n < block.stop)
        return block.row_units[i - self.n - block.start]

    def rows_of_level(self, level: int) -> slice:
        return slice(int(self.offsets[level]), int(self.offsets[level + 1]))
