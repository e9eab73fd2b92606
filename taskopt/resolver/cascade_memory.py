"""The arrays of a cascade, which each thread keeps from tick to tick, since making them takes long."""

from threading import local

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.layout import Layout
from taskopt.resolver.unit_program import UnitProgram

_MOST_LAYOUTS = 16  # kept by each thread; a control loop needs one

Stage = tuple[UnitProgram, Array, Array]  # the program of a level, its rows M on z (m, p), and Q (p, p)


class CascadeMemory:
    """Arrays for hierarchies of one layout.

    Args:
        layout: The layout.

    Attributes:
        layout: The layout.
        place: The basis of the free directions row by row, and ξ in the last row, (n + 1, n).
        kept: Inequality rows: rows on ξ (n + M, n), lower and upper bounds (2, n + M), and the position of
            each row among unknowns and rows of the hierarchy (n + M,).
    """

    def __init__(self, layout: Layout) -> None:
        n, rows = layout.n, layout.width
        self.layout, self.place = layout, np.empty((n + 1, n))
        self.kept = np.empty((rows, n)), np.empty((2, rows)), np.empty(rows, np.int64)
        self._stages: dict[tuple[int, int], Stage] = {}

    def stage(self, k: int, p: int) -> Stage:
        """Return the arrays of a level.

        Args:
            k: The level, counted from 1.
            p: Number of directions that are free.

        Returns:
            The arrays; what they hold is old.
        """
        found = self._stages.get((k, p))
        if found is None:
            m = self.layout.level_sizes[k]
            unit = UnitProgram(p, min(m, p) + self.layout.width)
            found = self._stages[k, p] = unit, np.empty((m, p)), np.empty((p, p))
        return found


class _Memories(local):
    """The memories of this thread, by the identity of their layout, which they keep alive."""

    def __init__(self) -> None:
        self.kept: dict[int, CascadeMemory] = {}


_memories = _Memories()


def take_memory(layout: Layout) -> CascadeMemory:
    """Return a memory that nobody else uses: that of the last tick, or a new one.

    Args:
        layout: Layout of the hierarchies.

    Returns:
        The memory; `give_back` keeps it for the next tick.
    """
    return _memories.kept.pop(id(layout), None) or CascadeMemory(layout)


def give_back(memory: CascadeMemory) -> None:
    """Keep a memory of which nothing is used any more.

    Args:
        memory: The memory.
    """
    kept = _memories.kept
    if len(kept) >= _MOST_LAYOUTS:
        kept.clear()
    kept[id(memory.layout)] = memory
