"""Active rows by name: the limits and inequalities that hold an answer back, with their multipliers."""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, Mask, StateArray
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.tolerances import COUNTED_MULTIPLIER

FIXED = "lower = upper"
"""The side of a bound that leaves no room."""


class Active(NamedTuple):
    """A bound in the final active set, with its multiplier at one level.

    Attributes:
        name: Name of the limit or task, and of the unknown or row, such as "velocity/joint4".
        side: "lower" or "upper", or "lower = upper" for a bound that leaves no room.
        multiplier: The multiplier, positive at an upper bound and negative at a lower one. At the first level
            with a multiplier, moving the bound outwards lowers ½ Σ w d² of that level at the rate
            |multiplier| per unit of the bound.
        level: The level that it belongs to, 1 for the first; the number of levels plus one is the norm.
    """

    name: str
    side: str
    multiplier: float
    level: int

    def __str__(self) -> str:
        return f"{self.name} {self.side}"


def active_rows(problem: Hierarchy, state: StateArray, multipliers: Array) -> tuple[Active, ...]:
    """Return the limits and inequalities in an active set, each at the first level where it has a multiplier.

    Equalities are left out, since they are always active.

    Args:
        problem: The hierarchy that was answered.
        state: Active set, (n + M,): −1 at a lower bound, 1 at an upper one, else 0.
        multipliers: Multipliers (levels + 1, n + M), those of the norm last.

    Returns:
        One entry for each active bound, box first, then rows in order.
    """
    lower, upper = problem.bounds()
    found = []
    for i in np.flatnonzero((state != 0) & (lower < upper)):
        level = _binding_level(multipliers[:, i])
        name = problem.name_of(int(i), bool(state[i] > 0))
        side = "upper" if state[i] > 0 else "lower"
        found.append(Active(name, side, float(multipliers[level, i]), level + 1))
    return tuple(found)


def fixed_rows(problem: Hierarchy, multipliers: Array) -> tuple[Active, ...]:
    """Return the hard bounds with lower = upper, which hold their unknown or row whatever the levels ask for.

    Args:
        problem: The hierarchy that was answered.
        multipliers: Multipliers (levels + 1, n + M), those of the norm last.

    Returns:
        One entry for each of them, box first, then hard rows in order, with its multiplier at the first level
        where it has one. An unknown whose two bounds come from different limits has the names of both.
    """
    stop = int(problem.layout.offsets[1])
    lower, upper = problem.bounds(stop)
    found = []
    for i in np.flatnonzero(lower == upper):
        level = _binding_level(multipliers[:, i])
        names = dict.fromkeys(problem.name_of(int(i), side) for side in (False, True))
        found.append(Active(" and ".join(names), FIXED, float(multipliers[level, i]), level + 1))
    return tuple(found)


def level_multipliers(problem: Hierarchy, state: StateArray, multipliers: Array) -> tuple[Active, ...]:
    """Return the multiplier of every active bound at every level where it has one, level by level.

    At the first of these levels, ∂(½ Σ w d²)/∂bound = −multiplier. At later levels the same holds for the
    cost of that level while the residuals of all levels before are kept.

    Args:
        problem: The hierarchy that was answered.
        state: Active set, (n + M,): −1 at a lower bound, 1 at an upper one, else 0.
        multipliers: Multipliers (levels + 1, n + M), those of the norm last.

    Returns:
        The entries, those of the first level first.
    """
    columns = {problem.name_of(int(i), bool(state[i] > 0)): int(i) for i in np.flatnonzero(state)}
    found = []
    for row in active_rows(problem, state, multipliers):
        values = multipliers[:, columns[row.name]]
        found += [
            row._replace(multiplier=float(values[k]), level=int(k) + 1)
            for k in np.flatnonzero(_counted(values))
            if k + 1 >= row.level
        ]
    return tuple(sorted(found, key=lambda row: row.level))


def _counted(values: Array) -> Mask:
    """Return True for each multiplier of one row, (levels + 1,), that is larger than solver accuracy."""
    return np.abs(values) > COUNTED_MULTIPLIER * max(1.0, float(np.abs(values).max()))


def _binding_level(values: Array) -> int:
    """Return the index of the first level at which a row, with multipliers (levels + 1,), has a price."""
    return int(np.argmax(_counted(values)))
