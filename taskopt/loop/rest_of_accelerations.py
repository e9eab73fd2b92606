"""Damping at rest in a control loop of second order, see `taskopt.hierarchy.rest_bend`."""

from itertools import accumulate

import numpy as np

from taskopt.arrays import Array, IntArray, Mask, StateArray
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.rest_bend import bent_directions, null_space, rank
from taskopt.hierarchy.rest_rows import OF_DAMPING, SAME
from taskopt.hierarchy.tolerances import ZERO_ROW
from taskopt.kinematics.bending import Bending
from taskopt.kinematics.limit import BoundLimit
from taskopt.kinematics.plan import watch_of
from taskopt.kinematics.stack import Plan
from taskopt.kinematics.task import BoundTask
from taskopt.loop.rest import Rest
from taskopt.resolver.base import Resolver


class RestOfAccelerations(Rest):
    """Resolve again with damping what would swing, in a stack of second order.

    A limit on positions holds a joint at which it sets the bound; one on accelerations holds no robot that
    rests. Rows of damping ask for q̈ = −K_D v in their direction, with the largest K_D of the level. Free
    directions of a level need no rows of their own: what a level damps is slow here.

    Args:
        plan: The stack, compiled for the robot.
        resolver: A strict resolver.
    """

    def __init__(self, plan: Plan, resolver: Resolver) -> None:
        super().__init__(plan, resolver)
        self._stopping, self._bending = _stopping_owners(plan), Bending(plan)
        rows = {block.name: block.rows for block in self._rows.layout.blocks if block.level}
        self._of_task = [(task, rows[task.name]) for task in plan.tasks]
        self._curved = [
            (task, rows) for task, rows in self._of_task if plan.groups[_declared(plan, task)].any()
        ]
        self.look()

    def look(self) -> None:
        """Tell the quick look the largest 1/K_P of the rows that bend, but of no level below; see `Rest`."""
        gains = [gain for task, _ in self._curved for gain in task.gain.tolist() if gain > 0.0]
        watch_of(self._plan.tick)[:2] = 1.0 / min(gains) ** 2 if gains else 0.0, 0.0

    def answer(self, undamped: Resolution) -> Resolution:
        """Return the answer of a tick, damped if need be; see `Rest.answer`."""
        self.look()
        return super().answer(undamped)

    def _damp_all(self) -> None:
        """Damp all unknowns that move a level, see `Rest`, by rows that ask for q̈ = −K_D v."""
        super()._damp_all()
        for k in np.flatnonzero(self._thresholds).tolist():
            self._ask(k, self._place(k))

    def _damp_free(self, x: Array, state: StateArray, speed: float) -> int:
        """Damp what is free at an answer, and return the number of damped levels, or SAME; see `Rest`."""
        held = self._holding(state, near=speed > 0.0)
        if np.array_equal(held, self._held):
            return SAME
        self._held[:] = held
        h = self._hierarchy
        damping = self._rows.kinds == OF_DAMPING
        h.A[damping], h.lower[damping], h.upper[damping] = 0.0, -np.inf, np.inf
        decided = [np.eye(h.n)[held[: h.n] == 1], h.A[h.layout.rows_of_level(0)][held[h.n :] == 1]]
        unlimited, found = null_space(np.vstack(decided)), 0
        for k in range(1, h.layout.level_count + 1):
            own = self._equalities(k, state)
            self._thresholds[k] = 0.0
            if self._rows.places[0, k] >= 0:
                still = np.eye(h.n)[~self._moved(k)]
                bases = null_space(np.vstack([*decided, still])), unlimited
                self._thresholds[k], rows = self._find(own, x, state, bases)
                place = self._place(k)
                h.A[place][: len(rows)] = rows
                self._ask(k, slice(place.start, place.start + len(rows)))
                decided.append(rows)
                found += len(rows) > 0
            decided.append(h.A[own])
        return found

    def _holding(self, state: StateArray, *, near: bool) -> StateArray:
        """Return 1 for unknowns that limits on positions hold, or slow down, and for hard rows that hold."""
        h, owner = self._hierarchy, self._hierarchy.owner
        lower, upper = np.isin(owner[0], self._stopping), np.isin(owner[1], self._stopping)
        side, hard = state[: h.n], h.layout.rows_of_level(0)
        joints = ((side < 0) & lower) | ((side > 0) & upper) | (h.box_lower == h.box_upper)
        joints |= (lower | upper) & near
        rows = (state[h.n :][hard] != 0) | (h.lower[hard] == h.upper[hard])
        return np.concatenate([joints, rows]).astype(np.int8)

    def _equalities(self, level: int, state: StateArray) -> IntArray:
        """Return the rows of a level that hold as equalities, those of damping left out."""
        h = self._hierarchy
        rows = np.arange(*h.layout.offsets[level : level + 2])
        holds = (h.lower[rows] == h.upper[rows]) | (state[h.n :][rows] != 0)
        return rows[holds & (self._rows.kinds[rows] != OF_DAMPING)]

    def _moved(self, level: int) -> Mask:
        """Return which unknowns move the curved rows of a level, (n,)."""
        own = self._hierarchy.layout.rows_of_level(level)
        return np.linalg.norm(self._hierarchy.A[own][self._rows.kinds[own] > 0], axis=0) > ZERO_ROW

    def _find(
        self, own: IntArray, x: Array, state: StateArray, bases: tuple[Array, Array]
    ) -> tuple[float, Array]:
        """Return ε² and the rows of damping of one level, whose rows `own` hold, see `bent_directions`."""
        h, (free, unlimited), sources = self._hierarchy, bases, self._rows.sources[own]
        root = np.sqrt(h.weight[own])
        A = root[:, None] * h.A[own]
        b = root * np.where(state[h.n :][own] < 0, h.lower[own], h.upper[own])
        left, size = b - A @ (x - free @ (free.T @ x)), float(np.linalg.norm(A))
        kinds = self._rows.kinds[own]
        groups = [np.flatnonzero(kinds == kind) for kind in dict.fromkeys(kinds[kinds > 0].tolist())]
        taken = max(0, rank(A @ unlimited, size) - rank(A @ free, size))

        def bend(v: Array) -> Array:
            return root * self._bending.along(v)[sources]

        return bent_directions(A, left, groups, free, self._periods()[own], bend, taken)

    def _place(self, level: int) -> slice:
        """Return the rows that damp a level."""
        start = int(self._rows.places[0, level])
        return slice(start, start + self._hierarchy.n)

    def _ask(self, level: int, place: slice) -> None:
        """Let rows of damping ask for q̈ = −K_D v, with the largest K_D of the curved tasks of the level."""
        h, most = self._hierarchy, 0.0
        first, last = h.layout.offsets[level : level + 2]
        for task, rows in self._curved:
            if first <= rows.start < last:
                asked = np.asarray(task.rate_gain, dtype=np.float64)
                most = max(most, float(np.where(asked < 0.0, 2.0 * task.gain, asked).max()))
        h.lower[place] = h.upper[place] = -most * (h.A[place] @ self._plan.velocity)

    def _periods(self) -> Array:
        """Return 1/K_P [s²] of all rows of curved tasks; 0 for others, and where K = 0."""
        out = np.zeros(self._rows.layout.row_count)
        for task, rows in self._curved:
            np.divide(1.0, task.gain**2, out=out[rows], where=task.gain > 0.0)
        return out


def _declared(plan: Plan, task: BoundTask) -> slice:
    """Return the rows of a task in its plan."""
    return next(block.rows for block in plan.layout.blocks if block.level and block.name == task.name)


def _stopping_owners(plan: Plan) -> list[int]:
    """Return the numbers of the owners of bounds that can hold a robot that rests."""
    boxes = [limit.box_part() for limit in plan.limits if isinstance(limit, BoundLimit)]
    starts = accumulate((len(limit.owners) for limit in boxes), initial=1)
    return [start + place for limit, start in zip(boxes, starts, strict=False) for place in limit.stops]
