"""Which hard limits contradict each other, and by how much the least would have to give way.

Phase one is our own: all hard bounds as one level of inequalities, in least squares. Its residual
is zero if and only if the limits agree; if not, the residuals are a Farkas certificate, Aᵀ w = 0
with w > 0, whose support holds a conflict, and the least relaxation in the Euclidean norm. Members
that the rest can do without are then taken out one by one, so that what remains is minimal:
removing any one of them makes it feasible. Chinneck (2008), "Feasibility and Infeasibility in
Optimization", Sect. 6.2 (deletion filter).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.active_set.resolver import ActiveSet

_AGREE = 1e-9  # relative to the row's norm and its bound: limits that miss each other by less agree
_NONE = 1e-7  # of the largest gap: what is smaller is rounding
_ROOM = 1e-6  # likewise: what relaxed limits get besides; no solver finds its way in a set thin as rounding


class Side(NamedTuple):
    """One side of one hard limit: a · x ≤ bound (upper) or a · x ≥ bound (lower)."""

    name: str
    side: str
    bound: float
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.name} {'≤' if self.side == 'upper' else '≥'} {_with(self.bound, 6, self.unit)}"


@dataclass(frozen=True, eq=False)
class Conflict:
    """A minimal set of hard limits that cannot hold together, and the least relaxation of all limits.

    `members`: removing any one leaves a set that can hold. `relaxation`: by how much each side would
    have to give way, least in the Euclidean norm, in the units of its row.
    """

    members: tuple[Side, ...]
    relaxation: tuple[tuple[Side, float], ...]

    def __str__(self) -> str:
        cannot = "; ".join(map(str, self.members))
        least = ", ".join(
            f"{side.name} {side.side} by {_with(gap, 3, side.unit)}" for side, gap in self.relaxation
        )
        return f"these limits exclude each other: {cannot}; least relaxation: {least}"


def conflict(hierarchy: Hierarchy) -> Conflict | None:
    """The conflict among the hard limits of a hierarchy, or None where they agree."""
    sides, A, bound = _one_sided(hierarchy)
    every = np.arange(len(sides))
    gap = _gap(A, bound, every)
    if not gap.any():
        return None
    relaxation = tuple((sides[i], float(gap[i])) for i in np.flatnonzero(gap))
    members = np.flatnonzero(gap)
    for candidate in list(members):
        rest = members[members != candidate]
        if _gap(A, bound, rest).any():
            members = rest
    return Conflict(tuple(sides[i] for i in members), relaxation)


def agree(hierarchy: Hierarchy) -> bool:
    """Whether the hard limits can hold together: phase one alone."""
    sides, A, bound = _one_sided(hierarchy)
    return not _gap(A, bound, np.arange(len(sides))).any()


def relaxed(hierarchy: Hierarchy, found: Conflict) -> Hierarchy:
    """A copy in which every side of the relaxation has given way, and 1e-6 more, so that there is room."""
    result = hierarchy.copy()
    n = result.n
    moved = {(side.name, side.side): gap for side, gap in found.relaxation}
    for i in range(n + result.limits.lower.size):
        for upper in (False, True):
            name = hierarchy.bound_name(i, upper) if i < n else hierarchy.layout.row_names[i - n]
            gap = moved.get((name, "upper" if upper else "lower"), 0.0)
            if gap > 0.0:
                box = result.box_upper if upper else result.box_lower
                bounds, at = (box, i) if i < n else ((result.upper if upper else result.lower), i - n)
                hair = _ROOM * max(1.0, abs(bounds[at]))
                bounds[at] += gap + hair if upper else -gap - hair
    return result


def _with(value: float, digits: int, unit: str) -> str:
    return f"{value:.{digits}g} {unit}".rstrip()


def _one_sided(hierarchy: Hierarchy) -> tuple[list[Side], Array, Array]:
    """Every finite hard bound as a · x ≤ bound: its name, a (p, n) and bound (p,)."""
    n, hard = hierarchy.n, hierarchy.limits
    sides: list[Side] = []
    rows, bounds = [], []
    for i, row in enumerate(np.vstack([np.eye(n), hard.A])):
        lower, upper = (
            (hierarchy.box_lower[i], hierarchy.box_upper[i])
            if i < n
            else (hard.lower[i - n], hard.upper[i - n])
        )
        for sign, value in ((-1.0, lower), (1.0, upper)):
            if np.isfinite(value):
                name = hierarchy.bound_name(i, sign > 0) if i < n else hierarchy.layout.row_names[i - n]
                sides.append(
                    Side(name, "upper" if sign > 0 else "lower", float(value), hierarchy.layout.unit(i))
                )
                rows.append(sign * row)
                bounds.append(sign * value)
    return sides, np.array(rows).reshape(-1, n), np.array(bounds)


def _gap(A: Array, bound: Array, chosen: IntArray) -> Array:
    """How far each side is from holding at the least-squares compromise among `chosen`, (p,); 0 elsewhere.

    All zero where the largest counts as agreement. The small ones beside it do not: without them the
    others may hold.
    """
    gap = np.zeros(len(bound))
    if chosen.size:
        rows, most = A[chosen], bound[chosen]
        x = ActiveSet(iterations=5000)(Hierarchy([Level(rows, upper=most)]))[0].x
        over = np.maximum(rows @ x - most, 0.0)
        size = np.linalg.norm(rows, axis=1)
        size[size == 0.0] = 1.0
        if (over > _AGREE * np.maximum(size, np.abs(most))).any():
            gap[chosen] = np.where(over > _NONE * over.max(), over, 0.0)
    return gap
