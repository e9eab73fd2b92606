"""Damping at rest in a control loop: answers that are near a loss of rank are resolved again with damping.

    undamped answer ─▶ may a level be near a loss of rank? ─▶ first solve: ε I in such levels
      ─▶ directions of the joints that are free at the damped answer ─▶ solve ─▶ again until they are the same

The first solve says which limits hold the robot. The undamped answer cannot: where a level has lost its rank,
the active set of that answer is full of limits on velocity. Limits that do not depend on the posture are
never taken to hold a joint, since they stop no robot at rest. If the undamped answer leaves nothing to damp,
the answer of the tick before is asked: else single undamped ticks throw a robot that rests.
"""

import numpy as np

from taskopt.arrays import Array, Mask, StateArray
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.rank_doubt import near_limits, rank_in_doubt
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.rest import Directions, damped_directions, free_rows, null_space
from taskopt.hierarchy.rest_layout import RestLayout
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import ZERO_ROW
from taskopt.kinematics.plan import base_box, watch_of
from taskopt.kinematics.stack import Plan
from taskopt.resolver.base import Memory, Resolver

_GAVE_UP = {Status.FAILED, Status.ITERATION_LIMIT}  # as where a rank is in doubt, which damping decides
_SOLVES = 5  # after the first; the held joints are the same at the second, as a rule
_LEAST_SPEED = 1.0  # [rad/s, m/s] at which a limit on positions counts as near, however slow the answer is


class Rest:
    """Resolve again with damping what would not come to rest, see `taskopt.hierarchy.rest`.

    Args:
        plan: The stack, compiled for the robot.
        resolver: A strict resolver.

    Attributes:
        ticks: Number of ticks that were damped.
        memory: Memory with which the last solution of the last damped tick began.
        last: Answer and active set of the last tick, (n,) and (n + rows,), if it was damped, else None.
    """

    def __init__(self, plan: Plan, resolver: Resolver) -> None:
        self._plan, self._resolver = plan, resolver
        self._rows = RestLayout(plan.layout, plan.groups)
        self._hierarchy = self._rows.hierarchy(plan.hierarchy.norm)
        self.ticks = 0
        self.memory: Memory | None = None
        self.last: tuple[Array, StateArray] | None = None

    @property
    def layout(self) -> Layout:
        """Layout of the problems with damping."""
        return self._rows.layout

    def answer(self, undamped: Resolution) -> Resolution:
        """Return the answer of a tick, damped if need be.

        Args:
            undamped: The answer to the hierarchy of the plan as it is now.

        Returns:
            The same answer, or that to a hierarchy with rows of damping, whose `undamped` is the former.
        """
        h, x = self._plan.hierarchy, undamped.x
        if not self._rows.damping or not (undamped.claimed or undamped.status in _GAVE_UP):
            return undamped
        base = base_box(self._plan.tick)[:2].ravel()
        layout, norm = h.layout, np.array(h.norm).ravel()
        watch = watch_of(self._plan.tick)
        certain = self.last is None and undamped.claimed
        if certain and not rank_in_doubt(
            h.buffer, norm, layout.offsets, layout.columns, x, undamped.state, base, watch
        ):
            return undamped
        return self.answer_in_doubt(undamped)

    def answer_in_doubt(self, undamped: Resolution) -> Resolution:
        """Return the answer of a tick for which `rank_in_doubt` is true, damped if need be.

        Args:
            undamped: As of `answer`.

        Returns:
            As of `answer`.
        """
        rows, h = self._rows, self._hierarchy
        rows.copy_declared(self._plan.hierarchy, h)
        state, x = np.zeros(rows.layout.width, dtype=np.int8), np.zeros(h.n)
        if undamped.claimed:
            x, state[: h.n] = undamped.x, undamped.state[: h.n]
            state[h.n :][rows.sources >= 0] = undamped.state[h.n :][rows.sources[rows.sources >= 0]]
        joints, hard = self._held(state)
        found = self._directions(x, state, (joints | self._near(x), hard))
        if not found and self.last is not None:
            found = self._directions(*self.last, self._held(self.last[1]))
        self.last = None
        if not found:
            return undamped
        rows.open(h)
        for level, directions in found.items():
            damped = np.sqrt(directions.threshold) * np.eye(h.n)[self._moved(level)]
            rows.write(h, rows.damping[level], damped)
        damped = self._until_same(state)
        if damped is None or not damped.claimed:
            return undamped
        self.ticks += 1
        self.last = damped.x, damped.state
        return damped.damped_from(undamped)

    def _until_same(self, state: StateArray) -> Resolution | None:
        """Solve, and damp what is free at the answer, until that is the same; None if nothing is damped."""
        h, rows = self._hierarchy, self._rows
        self.memory = Memory(state)
        resolution, memory = self._resolver(h, self.memory)
        held = None
        for _ in range(_SOLVES):
            if not resolution.claimed:
                return resolution
            before, held = held, self._held(resolution.state)
            if before is not None and all(map(np.array_equal, before, held)):
                return resolution
            rows.open(h)
            if not self._directions(resolution.x, resolution.state, held):
                return None
            self.memory = memory
            resolution, memory = self._resolver(h, memory)
        return resolution

    def _held(self, state: StateArray) -> tuple[Mask, Mask]:
        """Return which unknowns limits on positions hold, (n,), and which hard rows hold, (m,)."""
        h, base = self._hierarchy, base_box(self._plan.tick)
        side, (lower, upper) = state[: h.n], self._stops()
        joints = ((side < 0) & (lower > base[0])) | ((side > 0) & (upper < base[1]))
        hard = h.layout.rows_of_level(0)
        rows = (state[h.n :][hard] != 0) | (h.lower[hard] == h.upper[hard])
        return joints | (h.box_lower == h.box_upper), rows

    def _near(self, x: Array) -> Mask:
        """Return which unknowns a limit on positions may hold at velocities such as those of x, (n,)."""
        speed = max(_LEAST_SPEED, float(np.linalg.norm(x)))
        return near_limits(*self._stops(), base_box(self._plan.tick)[:2].ravel(), speed)

    def _stops(self) -> tuple[Array, Array]:
        """Return lower and upper bounds of x without those that limit speeds only, each (n,).

        Near an obstacle a distance limit narrows the speeds of all joints, with the posture; it holds none.
        """
        h, owners = self._hierarchy, self._plan.speed_owners
        return (
            np.where(np.isin(h.owner[0], owners), -np.inf, h.box_lower),
            np.where(np.isin(h.owner[1], owners), np.inf, h.box_upper),
        )

    def _moved(self, level: int) -> Mask:
        """Return which unknowns move the curved rows of a level, (n,)."""
        rows = np.concatenate(self._rows.groups[level])
        return np.linalg.norm(self._hierarchy.A[rows], axis=0) > ZERO_ROW

    def _directions(self, x: Array, state: StateArray, held: tuple[Mask, Mask]) -> dict[int, Directions]:
        """Find the directions to damp at each level, and write their rows, which must be open before.

        Args:
            x: The answer, (n,).
            state: Its active set.
            held: Unknowns and hard rows that hold, as `_held` returns them.

        Returns:
            The directions of each damped level, by level.
        """
        h, rows, found = self._hierarchy, self._rows, {}
        decided = [np.eye(h.n)[held[0]], h.A[h.layout.rows_of_level(0)][held[1]]]
        unlimited = null_space(np.vstack(decided))
        for k in range(1, h.layout.level_count + 1):
            own, A, b = self._level(k, state)
            if k in rows.groups:
                places = [np.flatnonzero(np.isin(own, group)) for group in rows.groups[k]]
                free = null_space(np.vstack([*decided, np.eye(h.n)[~self._moved(k)]]))
                left = b - A @ (x - free @ (free.T @ x))
                groups = [place for place in places if place.size]
                directions = damped_directions(A, left, groups, free, self._plan.dt, unlimited)
                if directions.threshold > 0.0:
                    found[k] = directions
                    decided.append(directions.damped)
                    rows.write(h, rows.damping[k], directions.damped)
                    self._damp_below(k, np.vstack([*decided, A]), directions.gate)
            decided.append(A)
        return found

    def _damp_below(self, level: int, decided: Array, gate: float) -> None:
        """Write the rows of the next level that damp what a level leaves free."""
        h, rows = self._hierarchy, self._rows
        if level in rows.below:
            below = h.layout.rows_of_level(level + 1)
            asked = np.isfinite(h.lower[below]) | np.isfinite(h.upper[below])
            sizes = h.weight[below] * (h.A[below] ** 2).sum(axis=1)
            size = float(sizes[asked].max(initial=0.0))
            rows.write(h, rows.below[level], free_rows(decided, self._moved(level), gate, size))

    def _level(self, level: int, state: StateArray) -> tuple[Array, Array, Array]:
        """Return the rows of a level that hold as equalities: their indices, √w A and √w b."""
        h = self._hierarchy
        rows = np.arange(*h.layout.offsets[level : level + 2])
        side = np.where(self._rows.sources[rows] >= 0, state[h.n :][rows], 0)
        rows, side = rows[kept := (h.lower[rows] == h.upper[rows]) | (side != 0)], side[kept]
        root = np.sqrt(h.weight[rows])
        return rows, root[:, None] * h.A[rows], root * np.where(side < 0, h.lower[rows], h.upper[rows])
