"""Damping at rest in a control loop: answers that are near a loss of rank are resolved again with damping.

    undamped answer ─▶ may a level be near a loss of rank? ─▶ first solve: ε I in such levels
      ─▶ directions of the joints that are free at the damped answer ─▶ solve ─▶ again until they are the same

The first solve says which limits hold the robot. The undamped answer cannot: where a level has lost its rank,
the active set of that answer is full of limits on velocity. Limits that do not depend on the posture are
never taken to hold a joint, since they stop no robot at rest. If the undamped answer leaves nothing to damp,
the answer of the tick before is asked, and then the undamped answer without the limits that are near it only:
else single undamped ticks throw a robot that rests.
"""

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank_doubt import rank_in_doubt
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.rest_layout import RestLayout
from taskopt.hierarchy.rest_rows import SAME, Numbers, copy_declared, damp_all, damp_free
from taskopt.hierarchy.status import Status
from taskopt.kinematics.plan import base_box, watch_of
from taskopt.kinematics.stack import Plan
from taskopt.resolver.base import Memory, Resolver

_GAVE_UP = {Status.FAILED, Status.ITERATION_LIMIT}  # as where a rank is in doubt, which damping decides
_SOLVES = 5  # after the first; the held joints are the same at the second, as a rule
_LEAST_SPEED = 1.0  # [rad/s, m/s] at which a limit on positions counts as near, however slow the answer is
_ACTIVE_ONLY = 0.0
_NO_CALL_BEFORE = 2  # neither held nor not


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
        self._rows = rows = RestLayout(plan.layout, plan.groups)
        self._hierarchy = rows.hierarchy(plan.hierarchy.norm)
        self._numbers, self._arrangement = _numbers(self._hierarchy), (rows.kinds, rows.places)
        self._base = base_box(plan.tick)[:2].ravel()  # a view
        self._owners = np.array(plan.speed_owners, dtype=np.int64)
        self._own = np.flatnonzero(rows.sources >= 0)
        self._held = np.empty(plan.robot.nv + rows.layout.offsets[1], dtype=np.int8)
        self._damps = bool((rows.places >= 0).any())
        self._thresholds = np.zeros(plan.layout.level_count + 1)
        self.ticks = 0
        self.memory: Memory | None = None
        self.last: tuple[Array, StateArray] | None = None

    @property
    def layout(self) -> Layout:
        """Layout of the problems with damping."""
        return self._rows.layout

    def look(self) -> None:
        """Prepare the quick look of this tick; Δt, which it needs, is written when it changes."""

    def answer(self, undamped: Resolution) -> Resolution:
        """Return the answer of a tick, damped if need be.

        Args:
            undamped: The answer to the hierarchy of the plan as it is now.

        Returns:
            The same answer, or that to a hierarchy with rows of damping, whose `undamped` is the former.
        """
        if not self._damps or not (undamped.claimed or undamped.status in _GAVE_UP):
            return undamped
        if self.last is None and undamped.claimed:
            numbers, watch = _numbers(self._plan.hierarchy), watch_of(self._plan.tick)
            if not rank_in_doubt(*numbers, undamped.x, undamped.state, self._base, watch):
                return undamped
        return self.answer_in_doubt(undamped)

    def answer_in_doubt(self, undamped: Resolution) -> Resolution:
        """Return the answer of a tick for which `rank_in_doubt` is true, damped if need be.

        Args:
            undamped: As of `answer`.

        Returns:
            As of `answer`.
        """
        rows, n, declared = self._rows, self._hierarchy.n, self._plan.hierarchy
        numbers, columns = self._numbers, declared.layout.columns
        copy_declared(declared.buffer, columns, rows.sources, numbers, rows.kinds)
        state, x = np.zeros(rows.layout.width, dtype=np.int8), np.zeros(n)
        if undamped.claimed:
            x, state[:n] = undamped.x, undamped.state[:n]
            state[n + self._own] = undamped.state[n:]
        found = self._damp_anew(x, state, _LEAST_SPEED)
        if not found and self.last is not None:
            found = self._damp_anew(*self.last, _ACTIVE_ONLY) or self._damp_anew(x, state, _ACTIVE_ONLY)
        self.last = None
        if not found:
            return undamped
        self._damp_all()
        damped = self._until_same(state, x)
        if damped is None or not damped.claimed:
            return undamped
        self.ticks += 1
        self.last = damped.x, damped.state
        return damped.damped_from(undamped)

    def _until_same(self, state: StateArray, x: Array) -> Resolution | None:
        """Solve, and damp what is free at the answer, until that is the same; None if nothing is damped.

        A joint that is held at the damped answer may be free at the undamped one, (`x`, `state`), which then
        needs the damping that the former does not: the damped answer stays.
        """
        self.memory = Memory(state)
        resolution, memory = self._resolver(self._hierarchy, self.memory)
        self._held[:] = _NO_CALL_BEFORE
        for _ in range(_SOLVES):
            if not resolution.claimed:
                return resolution
            found = self._damp_free(resolution.x, resolution.state, _ACTIVE_ONLY)
            if found == SAME:
                return resolution
            if not found:
                return resolution if self._damp_anew(x, state, _ACTIVE_ONLY) else None
            self.memory = memory
            resolution, memory = self._resolver(self._hierarchy, memory)
        return resolution

    def _damp_all(self) -> None:
        """Damp all unknowns that move a level of those that are damped, see `damp_all`."""
        damp_all(self._numbers, self._arrangement, self._thresholds)

    def _damp_anew(self, x: Array, state: StateArray, speed: float) -> int:
        """Damp what is free at an answer, whatever held at the last call."""
        self._held[:] = _NO_CALL_BEFORE
        return self._damp_free(x, state, speed)

    def _damp_free(self, x: Array, state: StateArray, speed: float) -> int:
        """Damp what is free at an answer, see `damp_free`."""
        stops = self._base, self._owners, speed
        return damp_free(
            self._numbers, self._arrangement, x, state, stops, self._held, self._plan.dt, self._thresholds
        )


def _numbers(hierarchy: Hierarchy) -> Numbers:
    """Return buffer, norm, offsets and columns of a hierarchy."""
    layout = hierarchy.layout
    return hierarchy.buffer, np.array(hierarchy.norm).ravel(), layout.offsets, layout.columns
