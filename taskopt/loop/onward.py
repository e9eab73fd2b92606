"""`LogStart`, a moment of a log at which a run begins: what would have happened onwards.

    start of the log ─▶ rows of each tick, with its logged answer ─▶ the moment ─▶ ticks that are resolved

The ticks before the moment are not resolved again. Their rows are filled at the logged postures, so that
every target, task and limit remembers what it remembered then. Those rows must be the logged ones, which
shows that the scenario is that of the log.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray, StateArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.tolerances import SAME_ROWS
from taskopt.kinematics.parameter import Setting
from taskopt.log.description import PROBLEM
from taskopt.log.provenance import Json, plain
from taskopt.log.reading import Log, open_log
from taskopt.loop.loop import Loop
from taskopt.loop.scenario import Scenario


class Moment(NamedTuple):
    """What a run begins with.

    Attributes:
        index: Number of its first tick.
        q: Posture of that tick, (nq,) [rad, m].
        delay: Time of that tick minus its number times Δt [s].
    """

    index: int
    q: Array
    delay: float


class LogStart:
    """A moment of a log, at which `run` begins instead of at the start of its scenario.

    The run has the posture and the velocity of that moment, targets that began where those of the log did,
    and the memory of the resolver, if the log has ticks of that resolver. Unchanged, it gives the velocities
    of the log to the last bit, with the same version on the same machine.

    Args:
        log: The log, or its file. It must begin where its targets began.
        t: The moment [s]; its tick, the last one at or before it, is the first one that is resolved.
        changes: Parameters that change at that tick, by address, such as {"hand.weight": 0.1}; see
            `Controller.set`.

    Attributes:
        log: The log.
        t: Time of the first tick [s].
        index: Its number.
        changes: The changes.

    Raises:
        InvalidValue: The time is not within the log, or the log itself begins at a moment of another one.
        MissingFile: There is no such file.
        BadLog: The file is no log.
    """

    def __init__(self, log: Log | str | Path, t: float, changes: Mapping[str, Setting] | None = None) -> None:
        self.log = log if isinstance(log, Log) else open_log(log)
        if "from" in self.log.facts:
            told = self.log.facts["from"]
            raise InvalidValue(
                f"{self.log.path} itself begins at {told['t_s']:g} s of {told['log']}, and does not say "
                "where its targets began; begin from that log"
            )
        self.changes = dict(changes or {})
        self._asked = t
        row = self.log.at(t)
        self.t, self.index = float(self.log.t[row]), int(self.log.array("tick")[row])

    def of(self, scenario: Scenario) -> Scenario:
        """Return the scenario as it was run into the log: with its period and its settings.

        Args:
            scenario: The scenario of the log.

        Returns:
            The same with the period and the settings of the log.

        Raises:
            InvalidValue: The scenario has ended by then, or a change is not possible.
            UnknownName: There is no parameter of the address of a change.
        """
        if scenario.duration <= self.t:
            raise InvalidValue(
                f"the scenario ends at {scenario.duration:g} s, and the run is to begin at {self.t:g} s; "
                "give a longer duration"
            )
        own, told = scenario.settings, self.log.facts.get("scenario", {}).get("settings", {})
        same = {name: own[name] for name in told if name in own and plain(own[name]) == told[name]}
        found = replace(scenario, settings=dict(told) | same, dt=float(self.log.facts["dt_s"]))
        replace(
            found, settings=dict(found.settings) | self.changes
        )  # a wrong address is refused before a run
        return found

    @property
    def facts(self) -> dict[str, Json]:
        """What a log of the run says about its beginning."""
        changes = {name: plain(value) for name, value in self.changes.items()}
        return {"log": str(self.log.path), "t_s": self.t, "changes": changes}

    def begin(self, loop: Loop) -> Moment:
        """Bring a loop of the scenario to the moment.

        Args:
            loop: The loop; all that it had before is forgotten.

        Returns:
            Its first tick.

        Raises:
            InvalidValue: The loop fills other rows than the log has, so that it is that of another scenario.
            UnknownName: There is no parameter of the address of a change.
        """
        log, name = self.log, loop.resolver.name
        if loop.plan.layout != log.layout or "q" not in log.columns:
            raise self._refused(f"it has {_parts(loop.plan.layout)}, and the log {_parts(log.layout)}")
        rows = self._rows(name)
        q, times = log.array("q")[rows].astype(np.float64), log.t[rows]
        loop.start(q[0], float(times[0]))
        self._retrace(loop, rows, q, times)
        if name in log.resolvers:
            loop.remember((log.tick(int(rows[-1])).memory, self._damped_before(rows)))
        if self.changes:
            loop.plan.set(self.changes)
        index = int(log.array("tick")[rows[-1]])
        return Moment(index, q[-1], float(times[-1]) - index * loop.plan.dt)

    def _rows(self, resolver: str) -> IntArray:
        """Return the rows of a resolver up to the moment; of the first one, if it has none."""
        name = resolver if resolver in self.log.resolvers else self.log.resolvers[0]
        rows = self.log.rows(name)
        return rows[rows <= self.log.at(self._asked, name)]

    def _retrace(self, loop: Loop, rows: IntArray, q: Array, times: Array) -> None:
        """Fill the rows of the ticks before the moment, and check that they are those of the log."""
        log, failed = self.log, self.log.array("failed")[rows]
        logged = np.hstack([log.array(name)[rows].astype(np.float64) for name in PROBLEM])
        x, before = log.array("x")[rows].astype(np.float64), log.array("v_before")[rows]
        for k in range(len(rows)):
            if before[k] is not None:
                loop.plan.moved(np.array(before[k], dtype=np.float64))
            if k == len(rows) - 1:
                return
            hierarchy = loop.plan.at(q[k], float(times[k]))
            if not np.allclose(hierarchy.buffer, logged[k], rtol=SAME_ROWS, atol=SAME_ROWS):
                what = _apart(log, hierarchy.buffer, logged[k])
                raise self._refused(f"at {times[k]:.6g} s it differs in {what}")
            if not failed[k]:
                loop.plan.answered(x[k])

    def _damped_before(self, rows: IntArray) -> tuple[Array, StateArray] | None:
        """Return answer and active set of the tick before, if it was damped."""
        if len(rows) == 1:
            return None
        tick = self.log.tick(int(rows[-2]))
        if tick.problem_with_damping is None:
            return None
        return tick.x, np.array(tick.values["damped_state"], dtype=np.int8)

    def _refused(self, reason: str) -> InvalidValue:
        """Return the error that the scenario is not that of the log."""
        return InvalidValue(
            f"the scenario is not the one of {self.log.path}: {reason}; take the scenario as it was, whose "
            "text is in the log, and change parameters by `changes` (--set)"
        )


def _parts(layout: Layout) -> str:
    """Return what a hierarchy consists of, in words."""
    names = [*dict.fromkeys([*layout.owners[1:], *(block.name for block in layout.blocks)])]
    return f"{layout.n} unknowns and {', '.join(names)}"


def _apart(log: Log, buffer: Array, logged: Array) -> str:
    """Return the column, and the place in it, at which two hierarchies differ most."""
    size = np.where(buffer == logged, 0.0, np.abs(buffer - logged))
    place = int(np.argmax(np.nan_to_num(size, nan=np.inf)))
    for column in PROBLEM:
        width = log.array(column).shape[1]
        if place < width:
            names = log.names(column)
            return f"{column} of {names[place]}" if names else column
        place -= width
    raise AssertionError("unreachable: the columns make up the buffer")
