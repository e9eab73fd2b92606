"""The layout of a hierarchy with rows of `RestDamping` beside its declared rows."""

from collections.abc import Container

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.layout import Block, Layout, numbered
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rest_rows import OF_DAMPING


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


class RestLayout:
    """A hierarchy like another one, with n rows of damping for each level that has curved rows, and n below.

    Args:
        declared: Layout of the hierarchy as declared.
        groups: Groups of its curved rows, see `groups_of`, (M,).

    Attributes:
        declared: Layout of the hierarchy as declared.
        layout: Layout with the rows of damping at the end of their levels.
        sources: For each row the declared row that it copies, or −1.
        kinds: For each row the number of its group, from 1 on, 0 if it is not curved, or OF_DAMPING, (M,).
        places: Where the n rows begin that damp level k, and the n rows of level k + 1 that damp its free
            directions; −1 for none, (2, levels + 1).
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
        starts: dict[tuple[int, bool], int] = {}
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
                    starts[level - below, below] = place
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
        self.places: IntArray = np.full((2, declared.level_count + 1), -1)
        for (k, below), first in starts.items():
            self.places[int(below), k] = first
        self.kinds = np.where(self.sources >= 0, np.append(groups, 0)[self.sources], OF_DAMPING)

    def hierarchy(self, norm: Array) -> Hierarchy:
        """Return a hierarchy of this layout in new memory, with open rows of damping.

        Args:
            norm: W, (n,) or (n, n).

        Returns:
            The hierarchy; `taskopt.hierarchy.rest_rows` fills it.
        """
        made = Hierarchy.view(self.layout, np.zeros(self.layout.size), norm)
        made.weight[:] = 1.0
        return made
