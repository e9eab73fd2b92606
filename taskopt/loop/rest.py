"""Damping at rest in a control loop: answers that are near a loss of rank are resolved again with damping.

    undamped answer ─▶ may a level be near a loss of rank? ─▶ first solve: ε I in such levels
      ─▶ directions of the joints that are free at the damped answer ─▶ solve ─▶ again until they are the same

The first solve says which limits hold the robot. The undamped answer cannot where a level has lost its rank:
the active set of that answer is full of limits on velocity then, and limits on positions that are near count
as well. Limits that do not depend on the posture are
never taken to hold a joint, since they stop no robot at rest. If the undamped answer leaves nothing to damp,
the answer of the tick before is asked, and then the undamped answer without the limits that are near it only:
else single undamped ticks throw a robot that rests.
"""

from functools import partial

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank_doubt import rank_in_doubt
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.rest_layout import RestLayout
from taskopt.hierarchy.rest_rows import SAME, Numbers, copy_declared, damp_all, damp_free
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.view import view_box
from taskopt.kinematics.plan import base_box, watch_of
from taskopt.kinematics.stack import Plan
from taskopt.loop.rest_again import damp_again
from taskopt.resolver.active_set.tick import ALTERNATES, LAST, PREVIOUS, new_history
from taskopt.resolver.active_set.workspace import Outcome
from taskopt.resolver.base import Memory, Resolver
from taskopt.resolver.tick_review import TickReview

_GAVE_UP = {Status.FAILED, Status.ITERATION_LIMIT}  # as where a rank is in doubt, which damping decides
_SOLVES = 5  # after the first; the held joints are the same at the second, as a rule
_LEAST_SPEED = 1.0  # [rad/s, m/s] at which a limit on positions counts as near, however slow the answer is
_ACTIVE_ONLY = 0.0
_NO_CALL_BEFORE = 2  # neither held nor not
_SOLVED = int(Outcome.SOLVED)


class Rest:
    """Resolve again with damping what would not come to rest, see `taskopt.hierarchy.rest`.

    Args:
        plan: The stack, compiled for the robot.
        resolver: A strict resolver.

    Attributes:
        ticks: Number of ticks that were damped.
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
        declared = plan.hierarchy
        self._declared = declared.buffer, declared.layout.columns, rows.sources
        self._history = new_history(rows.layout)
        self._continued: StateArray | None = None  # the active set from which the history goes on
        self._began: Memory | StateArray | None = None
        self.ticks = 0
        self.last: tuple[Array, StateArray] | None = None

    @property
    def layout(self) -> Layout:
        """Layout of the problems with damping."""
        return self._rows.layout

    @property
    def memory(self) -> Memory | None:
        """Memory with which the last solution of the last damped tick began."""
        began = self._began
        return began if began is None or isinstance(began, Memory) else _memory_of(began)

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

    def again(self, settings: tuple[int, int], history: StateArray) -> Resolution | None:
        """Damp a tick after a damped one, in one compiled call, see `taskopt.loop.rest_again`.

        Args:
            settings: Settings of the active-set method.
            history: Memory of the compiled entries with which the undamped problem would be resolved.

        Returns:
            The answer, whose `undamped` is found when it is asked for. None if it takes that answer to go on:
            `answer_in_doubt` does.
        """
        last, layout = self.last, self._rows.layout
        if last is None:
            return None
        if last[1] is not self._continued:
            self._history[LAST] = self._history[PREVIOUS] = last[1]
            self._history[ALTERNATES] = 0
        begun, state = np.empty_like(self._history), np.empty(layout.width, dtype=np.int8)
        answer, stops = np.empty(layout.answer_size), (self._base, self._owners, _ACTIVE_ONLY)
        outcome, count = damp_again(
            self._declared, self._numbers, self._arrangement, stops,
            (self._plan.dt, self._thresholds, self._held), last, (*settings, _SOLVES),
            (self._history, begun, state, answer),
        )  # fmt: skip
        if outcome != _SOLVED:
            return None
        damped = Resolution(self._hierarchy, answer, state, Status.SOLVED, int(count), TickReview)
        self.ticks += 1
        self.last, self._continued, self._began = (damped.x, state), state, begun
        return damped.damped_from(partial(self._without_damping, history.copy()))

    def _without_damping(self, history: StateArray, damped: Resolution) -> Resolution:
        """Resolve the declared problem of a damped answer from a history."""
        plan, problem, own = self._plan, damped.problem, self._own
        declared = Hierarchy.view(plan.layout, np.zeros(plan.layout.size), plan.hierarchy.norm)
        declared.A[:], declared.weight[:] = problem.A[own], problem.weight[own]
        declared.lower[:], declared.upper[:] = problem.lower[own], problem.upper[own]
        declared.label[:] = problem.label[own]
        view_box(declared.buffer, declared.n)[:] = view_box(problem.buffer, declared.n)
        found, _ = self._resolver(declared, _memory_of(history))
        of_plan = plan.hierarchy, found.answer, found.state
        undamped = Resolution(*of_plan, found.status, found.iterations, TickReview)
        return undamped.replaced(notes=found.notes, fallback=found.fallback)

    def _until_same(self, state: StateArray, x: Array) -> Resolution | None:
        """Solve, and damp what is free at the answer, until that is the same; None if nothing is damped.

        A joint that is held at the damped answer may be free at the undamped one, (`x`, `state`), which then
        needs the damping that the former does not: the damped answer stays.
        """
        self._began = memory = Memory(state)
        resolution, memory = self._resolver(self._hierarchy, memory)
        self._held[:] = _NO_CALL_BEFORE
        for _ in range(_SOLVES):
            if not resolution.claimed:
                return resolution
            found = self._damp_free(resolution.x, resolution.state, _ACTIVE_ONLY)
            if found == SAME:
                return resolution
            if not found:
                return resolution if self._damp_anew(x, state, _ACTIVE_ONLY) else None
            self._began = memory
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


def _memory_of(history: StateArray) -> Memory:
    """Return a history of the compiled entries as a memory."""
    return Memory(history[LAST], previous=history[PREVIOUS], alternates=bool(history[ALTERNATES, 0]))


def _numbers(hierarchy: Hierarchy) -> Numbers:
    """Return buffer, norm, offsets and columns of a hierarchy."""
    layout = hierarchy.layout
    return hierarchy.buffer, np.array(hierarchy.norm).ravel(), layout.offsets, layout.columns
