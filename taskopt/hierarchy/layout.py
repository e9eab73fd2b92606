"""The names and sizes of a hierarchy, which stay the same from tick to tick."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count

import numpy as np

from taskopt.arrays import IntArray
from taskopt.hierarchy.view import answer_size, buffer_size, place_of_x


def numbered(names: Iterable[str]) -> list[str]:
    """Make names different from each other: a name that is taken gets the next free number.

    Rows, pictures and logs all use this function, so that each thing has the same name everywhere.

    Args:
        names: Names, some of them perhaps equal.

    Returns:
        As many names; of "ball", "sphere", "sphere" the last becomes "sphere 2".
    """
    taken: list[str] = []
    for name in names:
        free = (f"{name} {i}" for i in count(2))
        taken.append(name if name not in taken else next(n for n in free if n not in taken))
    return taken


def short_names(names: Sequence[str]) -> list[str]:
    """Drop the prefix that all names share.

    Args:
        names: Names such as "panda_joint1", "panda_joint2".

    Returns:
        The names after the last underscore of the prefix, such as "joint1", "joint2".
    """
    alike = [len(set(letters)) == 1 for letters in zip(*names, strict=False)] if len(names) > 1 else []
    common = names[0][: [*alike, False].index(False)] if names else ""
    start = common.rfind("_") + 1
    return [name[start:] for name in names]


@dataclass(frozen=True)
class Block:
    """The rows of one task, or of one limit that is not a bound on a single unknown.

    Attributes:
        name: Name of the task or limit.
        level: 0 for hard rows; 1, 2, … for the levels in order of priority.
        start: First row.
        stop: The row after the last one.
        row_names: Name of each row within the block.
        row_units: Unit of each row's bounds, "" for plain numbers.
        choices: Names that a row of the block may have instead of its own, as its label at a tick states.
            Empty if the names of the rows never change.
    """

    name: str
    level: int
    start: int
    stop: int
    row_names: tuple[str, ...]
    row_units: tuple[str, ...]
    choices: tuple[str, ...] = ()

    @property
    def rows(self) -> slice:
        """The rows of the block among all rows."""
        return slice(self.start, self.stop)


@dataclass(frozen=True)
class Layout:
    """Names and sizes of a hierarchy with n unknowns and M rows, hard rows first, then level by level.

    Attributes:
        unknowns: Name of each unknown, n of them.
        blocks: Blocks of rows in order.
        level_count: Number of levels, the hard rows and the norm not counted.
        owners: Names of the limits that a bound on an unknown may come from.
        column: For each row, the index j if the row is the unit vector e_j at every tick, else −1; empty if
            there is no such row. Kernels use it to skip work.
        unknown_units: Unit of each unknown; empty where the unknowns are plain numbers.
    """

    unknowns: tuple[str, ...]
    blocks: tuple[Block, ...]
    level_count: int
    owners: tuple[str, ...] = ("box",)
    column: tuple[int, ...] = field(default=())
    unknown_units: tuple[str, ...] = ()

    @cached_property
    def is_of_accelerations(self) -> bool:
        """True if the unknowns are joint accelerations, as their units tell."""
        return any(unit.endswith("/s²") for unit in self.unknown_units)

    @property
    def noun(self) -> str:
        """Words for an unknown of a robot, "a velocity" or "an acceleration"."""
        return "an acceleration" if self.is_of_accelerations else "a velocity"

    @property
    def angular_unit(self) -> str:
        """Unit of unknowns that turn, "rad/s" or "rad/s²"; those that slide have m in place of rad."""
        return "rad/s²" if self.is_of_accelerations else "rad/s"

    @cached_property
    def place_of_x(self) -> slice:
        """Where x stands in the flat answer, kept since every tick needs it."""
        return place_of_x(self.n)

    @cached_property
    def n(self) -> int:
        """Number of unknowns."""
        return len(self.unknowns)

    @cached_property
    def row_count(self) -> int:
        """Number M of rows, hard ones included."""
        return sum(len(block.row_names) for block in self.blocks)

    @cached_property
    def width(self) -> int:
        """The number n + M, which is the length of an active set and of the multipliers of one level."""
        return self.n + self.row_count

    @cached_property
    def offsets(self) -> IntArray:
        """First row of the hard rows, of level 1, 2, …, and the end, (level_count + 2,)."""
        counts = np.zeros(self.level_count + 2, dtype=np.int64)
        for block in self.blocks:
            counts[block.level + 1] += block.stop - block.start
        return np.cumsum(counts)

    @cached_property
    def level_sizes(self) -> tuple[int, ...]:
        """Number of the hard rows, and of the rows of level 1, 2, …"""
        return tuple(np.diff(self.offsets).tolist())

    @cached_property
    def columns(self) -> IntArray:
        """`column` as an array, (M,); −1 everywhere if `column` is empty."""
        if not self.column:
            return np.full(self.row_count, -1, dtype=np.int64)
        return np.array(self.column, dtype=np.int64)

    @cached_property
    def row_names(self) -> tuple[str, ...]:
        """Name of each row with its block, such as "hand/x"."""
        return tuple(f"{b.name}/{row}" for b in self.blocks for row in b.row_names)

    @cached_property
    def size(self) -> int:
        """Length of the buffer that holds the numbers of a hierarchy (see `view`)."""
        return buffer_size(self.n, self.row_count)

    @cached_property
    def answer_size(self) -> int:
        """Length of an answer: x, multipliers, KKT residuals, and a copy of the buffer (see `view`)."""
        return answer_size(self.n, self.row_count, self.level_count)

    def unit(self, i: int) -> str:
        """Return the unit of an unknown or of a row.

        Args:
            i: Index of an unknown, i < n, or n plus the index of a row.

        Returns:
            The unit, "" for plain numbers.
        """
        if i < self.n:
            return self.unknown_units[i] if self.unknown_units else ""
        block = self.block_of(i - self.n)
        return block.row_units[i - self.n - block.start]

    def block_of(self, row: int) -> Block:
        """Return the block that a row belongs to.

        Args:
            row: Index of the row among all rows.

        Returns:
            The block.
        """
        return next(block for block in self.blocks if block.start <= row < block.stop)

    def row_name(self, row: int, label: int) -> str:
        """Return the name of a row at a tick, with its block.

        Args:
            row: Index of the row among all rows.
            label: Its label at the tick, see `view.Rows`.

        Returns:
            A name such as "hand/x".
        """
        if label == 0:
            return self.row_names[row]
        block = self.block_of(row)
        return f"{block.name}/{block.choices[label - 1]}"

    def rows_of_level(self, level: int) -> slice:
        """Return the rows of a level among all rows.

        Args:
            level: 0 for the hard rows, 1 for the first priority, and so on.

        Returns:
            The slice.
        """
        return slice(int(self.offsets[level]), int(self.offsets[level + 1]))
