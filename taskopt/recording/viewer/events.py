"""The log of events, which lists the moments at which a run leaves its limits or its proof."""

from typing import NamedTuple

import numpy as np
import rerun as rr

from taskopt.arrays import Mask
from taskopt.hierarchy.proof import UNDECIDED, Verdict
from taskopt.hierarchy.tolerances import SHOWN_VIOLATION
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.drawable_text import drawable
from taskopt.recording.viewer.paths import EVENTS
from taskopt.recording.viewer.writer import RecordingWriter
from taskopt.recording.violation import LimitGauge

_MOST = 12  # largest number of events of one resolver in one batch; the others are only counted
_CAUSES = {  # limits are left out, since the active-set timeline shows them
    "rank": "a rank that may go either way keeps it apart from its closed form",
    "damping": "damping keeps it apart from its closed form",
    "formula": "its formula does not solve the problem",
    "accuracy": "its accuracy is less than was asked for",
}
_VERDICTS = {"refuted": ("ERROR", (Verdict.REFUTED,)), "undecided": ("WARN", UNDECIDED)}


class Event(NamedTuple):
    """An event of a run.

    Attributes:
        position: The position of the tick in its batch.
        level: Its severity in Rerun's terms: "ERROR", "WARN", "INFO" or "DEBUG".
        text: One sentence without the name of the resolver.
    """

    position: int
    level: str
    text: str


class Watcher:
    """Find the ticks at which a run leaves its limits or its proof, and those at which it returns."""

    def __init__(self, info: RunInfo, gauge: LimitGauge) -> None:
        """Begin a run.

        Args:
            info: The facts about the run.
            gauge: The limits of the run.
        """
        self._info, self._gauge = info, gauge
        self._last: dict[tuple[str, str], bool] = {}  # by resolver and text, at the last tick

    def events(self, batch: Batch) -> list[Event]:
        """Find the beginnings and ends of all watched conditions.

        Args:
            batch: The steps that follow those of the last call for the same resolver.

        Returns:
            The events, in the order of the conditions.
        """
        events = []
        for text, (level, flag) in self._conditions(batch).items():
            previous = self._last.get((batch.resolver, text), False)
            self._last[batch.resolver, text] = bool(flag[-1])
            for k in np.flatnonzero(flag != np.concatenate([[previous], flag[:-1]])).tolist():
                begins = bool(flag[k])
                events.append(Event(k, level if begins else "DEBUG", text if begins else f"over: {text}"))
        return events

    def _conditions(self, batch: Batch) -> dict[str, tuple[str, Mask]]:
        """Map the text of each condition to its severity and its mask (k,)."""
        conditions: dict[str, tuple[str, Mask]] = {}
        for name, limit in self._info.plan.distance_limits.items():
            room = batch.distance(name) - limit.margins
            too_near = np.asarray(room.min(axis=1) < -SHOWN_VIOLATION)
            conditions[f"nearer than the margin of {name}"] = "WARN", too_near
        outside = self._gauge.position_violation(batch) > SHOWN_VIOLATION
        conditions["a joint is outside its position limits"] = "WARN", outside
        too_fast = self._gauge.velocity_violation(batch) > SHOWN_VIOLATION
        conditions["a joint is over its velocity limit"] = "WARN", too_fast
        for words, (level, verdicts) in _VERDICTS.items():
            found = [verdict in verdicts for verdict in batch.verdicts]
            text = f"the resolver claims an optimum that is {words}"
            last = self._last.get((batch.resolver, text), False)
            conditions[text] = level, _kept(batch.claimed & found, batch.judged, last)
        for kind, text in _CAUSES.items():
            caused = np.array([any(cause.kind == kind for cause in tick) for tick in batch.causes])
            conditions[text] = "INFO", caused
        return conditions


def _kept(flag: Mask, judged: Mask, last: bool) -> Mask:
    """Return a flag that keeps its last judged value where an answer is not judged, (k,)."""
    place = np.maximum.accumulate(np.where(judged, np.arange(len(flag)), -1))
    return np.where(place >= 0, flag[place], last)


def send_events(writer: RecordingWriter, batch: Batch, events: list[Event]) -> None:
    """Send the events of a batch to the log in the order of time; beyond twelve they are only counted.

    Args:
        writer: The recording.
        batch: The steps at which they happened.
        events: The events, in any order.
    """
    if not events:
        return
    kept = sorted(events)[:_MOST]
    texts = [f"{batch.resolver}: {event.text}" for event in kept]
    if len(events) > _MOST:
        texts[-1] += f" (and {len(events) - _MOST} more changes by {batch.t[-1]:.3f} s)"
    ticks = np.array([event.position for event in kept])
    lines = rr.TextLog.columns(text=[drawable(text) for text in texts], level=[event.level for event in kept])
    writer.send_columns(EVENTS, batch.index[ticks], batch.time[ticks], lines)
