"""The layout of a hierarchy with rows of `RestDamping` beside its declared rows."""

from collections.abc import Container
from itertools import chain

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.layout import Block, Layout, numbered
from taskopt.hierarchy.problem import Hierarchy


def groups_of(layout: Layout, curved: Container[str]) -> IntArray:
    """Return the groups of rows whose A changes with the posture: those of one task and one unit.

    Args:
        layout: Layout of a hierarchy.
        curved: Names of the tasks with such rows.

    Returns:
        The number of the group of each row, from 1 on; 0 for hard rows, unit vectors and other tasks, (M,).
    """
    groups, count = np.zeros(layout.row_count, dtype=np.int64), 0
    for block in layout.blocks:
        if block.level and block.name in curved:
            bends, units = layout.columns[block.rows] < 0, np.array(block.row_units)
            for unit in dict.fromkeys(block.row_units):
                rows = bends & (units == unit)
                count += bool(rows.any())
                groups[block.rows][rows] = count
    return groups


def _split(groups: IntArray, rows: slice) -> list[IntArray]:
    """Return the rows of each group of a level."""
    numbers = dict.fromkeys(number for number in groups[rows].tolist() if number)
    return [np.flatnonzero(groups == number) for number in numbers]


class RestLayout:
    """A hierarchy like another one, with n rows of damping for each level that has curved rows, and n below.

    Args:
        declared: Layout of the hierarchy as declared.
        groups: Groups of its curved rows, see `groups_of`, (M,).

    Attributes:
        declared: Layout of the hierarchy as declared.
        layout: Layout with the rows of damping at the end of their levels.
        sources: For each row the declared row that it copies, or −1.
        groups: For each level k, from 1 on, the curved rows by task and unit.
        damping: Rows that damp level k, by k.
        below: Rows of level k + 1 that damp the free directions of level k, by k.
    """

    def __init__(self, declared: Layout, groups: IntArray) -> None:
        self.declared, n = declared, declared.n
        levels = {block.level for block in declared.blocks if block.level and groups[block.rows].any()}
        extra = [(k, f"rest of level {k}") for k in sorted(levels)]
        extra += [
            (k + 1, f"free directions of level {k}") for k in sorted(levels) if k < declared.level_count
        ]
        names = numbered([*(block.name for block in declared.blocks), *(name for _, name in extra)])
        added = list(zip(extra, names[len(declared.blocks) :], strict=True))
        blocks: list[Block] = []
        sources: list[int] = []
        rows: dict[tuple[int, bool], slice] = {}
        directions = tuple(f"direction {i + 1}" for i in range(n))
        for k in range(declared.level_count + 1):
            for block in (block for block in declared.blocks if block.level == k):
                place = len(sources)
                sources += range(block.start, block.stop)
                names_of_rows = block.row_names, block.row_units, block.choices
                blocks.append(Block(block.name, k, place, len(sources), *names_of_rows))
            for (level, what), name in added:
                if level == k:
                    place, below = len(sources), what.startswith("free")
                    sources += [-1] * n
                    blocks.append(Block(name, k, place, len(sources), directions, ("",) * n))
                    rows[level - below, below] = slice(place, len(sources))
        self.sources: IntArray = np.array(sources, dtype=np.int64)
        columns = tuple(int(declared.columns[i]) if i >= 0 else -1 for i in sources)
        self.layout = Layout(
            declared.unknowns,
            tuple(blocks),
            declared.level_count,
            declared.owners,
            columns,
            declared.unknown_units,
        )
        self.damping = {k: own for (k, below), own in rows.items() if not below}
        self.below = {k: own for (k, below), own in rows.items() if below}
        of_row = np.where(self.sources >= 0, np.append(groups, 0)[self.sources], 0)
        self.groups = {k: _split(of_row, self.layout.rows_of_level(k)) for k in self.damping}

    def hierarchy(self, norm: Array) -> Hierarchy:
        """Return a hierarchy of this layout in new memory, with open rows of damping.

        Args:
            norm: W, (n,) or (n, n).

        Returns:
            The hierarchy; `copy_declared` fills the other rows.
        """
        made = Hierarchy.view(self.layout, np.zeros(self.layout.size), norm)
        made.weight[:] = 1.0
        return made

    def copy_declared(self, declared: Hierarchy, into: Hierarchy) -> None:
        """Copy the declared rows and the box, and open all rows of damping.

        Args:
            declared: A hierarchy of the declared layout.
            into: A hierarchy of this layout, which is written to.
        """
        own, rows = self.sources >= 0, self.sources[self.sources >= 0]
        into.A[own], into.lower[own], into.upper[own] = (
            declared.A[rows],
            declared.lower[rows],
            declared.upper[rows],
        )
        into.weight[own], into.label[own] = declared.weight[rows], declared.label[rows]
        into.box_lower[:], into.box_upper[:], into.owner[:] = (
            declared.box_lower,
            declared.box_upper,
            declared.owner,
        )
        self.open(into)

    def open(self, hierarchy: Hierarchy) -> None:
        """Take the bounds of all rows of damping away, so that they ask for nothing.

        Args:
            hierarchy: A hierarchy of this layout, which is written to.
        """
        for rows in chain(self.damping.values(), self.below.values()):
            hierarchy.A[rows] = 0.0
            hierarchy.lower[rows], hierarchy.upper[rows] = -np.inf, np.inf

    def write(self, hierarchy: Hierarchy, place: slice, rows: Array) -> None:
        """Write rows of damping, each with the right-hand side 0.

        Args:
            hierarchy: A hierarchy of this layout, which is written to.
            place: One of `damping` or `below`, whose rows are open.
            rows: At most n rows, (r, n).
        """
        hierarchy.A[place][: len(rows)] = rows
        hierarchy.lower[place][: len(rows)] = hierarchy.upper[place][: len(rows)] = 0.0
