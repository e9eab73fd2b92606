"""Ticks of a loop that are copied into a log."""

from collections.abc import Sequence

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.errors import Infeasible, InvalidValue, LogFailed, NotSolved
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.view import answer_of
from taskopt.kinematics.changes import Applied
from taskopt.log.description import Description
from taskopt.log.of_plan import PlanTicks, description_of
from taskopt.log.provenance import Json
from taskopt.log.quick import QuickCopy
from taskopt.log.raw import RawLog
from taskopt.loop.loop import Loop
from taskopt.resolver.base import Memory


def described(loop: Loop, **facts: Json) -> Description:
    """Describe the ticks of a loop.

    Args:
        loop: The loop.
        facts: More facts for the metadata of the log.

    Returns:
        The description.
    """
    damped = None if loop.rest is None else loop.rest.layout
    return description_of(loop.plan, [loop.resolver], damped, facts)


class LoggedLoop:
    """Resolve a stack tick by tick, and copy each tick into a log.

    A tick that raises an error is copied, too, with the reason and the hierarchy as far as it was filled.

    Args:
        loop: The loop.
        log: The log, which was made with a description of this loop.
        description: That description.
        number: Number of the resolver, if the log has the ticks of several loops.
        first: Number of the first tick, for loops that are not resolved in one compiled call.
    """

    def __init__(
        self, loop: Loop, log: RawLog, description: Description, number: int = 0, first: int = 0
    ) -> None:
        self._loop, self._log, self._number, self._index = loop, log, number, first
        self._ticks = PlanTicks(loop.plan, description)
        self._changes = loop.plan.changes
        self._changes.applied = []
        history = loop.history
        self._quick = None if history is None else QuickCopy(log, self._ticks, history)
        self._restarts = -1  # of the loop since which the quick copy has its memory; −1 if it must take it

    def tick(self, q: Array, t: float) -> Resolution:
        """Resolve the stack at one posture and time.

        Args:
            q: Posture, (nq,) [rad, m].
            t: Time [s].

        Returns:
            As `Loop.tick`.

        Raises:
            LogFailed: The log cannot be written any more; the error has the resolution, and later ticks are
                not logged.
            TaskoptError: As `Loop.tick`.
        """
        loop, quick = self._loop, self._quick
        before = loop.plan.velocity
        if loop.plan.motion is not None:  # the answer changes it in place
            before = before.copy()
        if quick is None:
            memory: Memory | StateArray | None = loop.memory
        else:
            memory = quick.memory if self._restarts == loop.restarts else quick.begin()
        self._restarts = -1
        try:
            resolution = loop.tick(q, t)
        except (Infeasible, NotSolved, InvalidValue) as error:
            if self._log.open:
                self._add_failed(q, t, before, memory, error)
            raise
        changes = self._taken() if self._changes.applied else ()
        if quick is not None and quick.add(t, before, resolution, changes):
            self._restarts = loop.restarts
            return resolution
        if not self._log.open:
            return resolution
        try:
            self._add(q, t, before, memory, resolution, changes)
        except LogFailed as failed:
            failed.resolution = resolution
            raise
        return resolution

    def _taken(self) -> Sequence[Applied]:
        """Return the changes of parameters that were applied since the last tick."""
        taken, self._changes.applied = self._changes.applied or (), []
        return taken

    def _add(
        self,
        q: Array,
        t: float,
        before: Array,
        memory: Memory | StateArray | None,
        answer: Resolution,
        changes: Sequence[Applied],
        error: str = "",
    ) -> None:
        """Copy a tick."""
        loop = self._loop
        index = self._index if self._quick is None else self._log.count
        tick = self._ticks.tick(index, t, q, before, memory)
        tick = tick._replace(resolver=self._number, changes=changes)
        if self._quick is None and not error:
            tick = tick._replace(seconds=(loop.seconds.resolver, loop.seconds.rows))
        if answer.is_damped and loop.rest is not None:
            tick = tick._replace(damped_memory=loop.rest.memory)
        self._index += 1
        self._log.add(tick, answer, loop.plan.hierarchy, error)

    def _add_failed(
        self, q: Array, t: float, before: Array, memory: Memory | StateArray | None, error: Exception
    ) -> None:
        """Copy a tick that raised an error; a log that fails now leaves that error in front."""
        hierarchy, robot = self._loop.plan.hierarchy, self._loop.plan.robot
        answer = error.resolution if isinstance(error, NotSolved) else None
        if not isinstance(answer, Resolution):
            status = Status.INFEASIBLE if isinstance(error, Infeasible) else Status.FAILED
            answer = _without_answer(hierarchy, status)
        q = np.asarray(q) if np.shape(q) == (robot.nq,) else np.full(robot.nq, np.nan)
        try:
            self._add(q, t, before, memory, answer, self._taken(), str(error))
        except LogFailed as failed:
            error.add_note(str(failed))


def _without_answer(hierarchy: Hierarchy, status: Status) -> Resolution:
    """Return an answer of NaN, as of a tick whose problem could not be resolved."""
    layout = hierarchy.layout
    answer = np.full(layout.answer_size, np.nan)
    parts = answer_of(answer, layout.n, layout.row_count, layout.level_count)
    parts.multipliers[:], parts.problem[:] = 0.0, hierarchy.buffer
    return Resolution(hierarchy, answer, np.zeros(layout.width, dtype=np.int8), status)
