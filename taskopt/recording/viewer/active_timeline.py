"""The active-set timeline: one row for each limit that is ever active, coloured by its side."""

import numpy as np
import rerun as rr

from taskopt.arrays import IntArray, Mask
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.drawable_text import drawable
from taskopt.recording.viewer.events import Event, Watcher, send_events
from taskopt.recording.viewer.palette import FREE, LOWER, UPPER, VIOLATED, colours
from taskopt.recording.viewer.paths import data_path, plain_part
from taskopt.recording.viewer.rows import limit_rows, pair_rows
from taskopt.recording.viewer.writer import RecordingWriter
from taskopt.recording.violation import LimitGauge

_VIOLATED = 1_000_000  # added to the magnitude of the code of a bound that is violated instead of active
_ANY, _ANY_WORDS = "any_limit", ("none active", "active")
_PAIR_LABELS = {"lower": "held off", "over lower": "too fast"}  # of the hard rows of a distance limit


class ActiveTimeline:
    """Draw a row for each limit or inequality that is ever active, and log its changes as events."""

    def __init__(self, info: RunInfo, gauge: LimitGauge) -> None:
        """Begin a run, whose hierarchy has n + M bounds and rows.

        Args:
            info: The facts about the run.
            gauge: The limits of the run.
        """
        self._rows = np.flatnonzero(limit_rows(info))
        self._pairs = pair_rows(info)
        self._last: dict[str, IntArray] = {}  # the codes at the last tick, by resolver
        self._opened: set[tuple[str, int]] = set()  # resolvers and rows that have a row in the timeline
        self._watcher = Watcher(info, gauge)

    def draw(self, writer: RecordingWriter) -> None:
        """Send nothing, since a row is opened when its limit is first active.

        Args:
            writer: The recording.
        """

    def send(self, writer: RecordingWriter, batch: Batch) -> None:
        """Send the changes of the active set, and the events.

        Args:
            writer: The recording.
            batch: The steps that follow those of the last call for the same resolver.
        """
        events = [*self._send_changes(writer, batch), *self._watcher.events(batch)]
        send_events(writer, batch, events)

    def _send_changes(self, writer: RecordingWriter, batch: Batch) -> list[Event]:
        """Send the changes of all rows, and return them as events."""
        code = self._codes(batch)
        first = batch.resolver not in self._last
        previous = self._last.get(batch.resolver, np.zeros(code.shape[1], dtype=np.int64))
        self._last[batch.resolver] = code[-1]
        if code.size:
            any_active = np.asarray(code.any(axis=1))
            self._send_any(writer, batch, None if first else bool(previous.any()), any_active)
        steps = np.vstack([previous, code])
        events = []
        for column in np.flatnonzero((steps[1:] != steps[:-1]).any(axis=0)):
            changed = np.flatnonzero(steps[1:, column] != steps[:-1, column])
            row = int(self._rows[column])
            self._send_row(writer, batch, row, changed, steps[1:, column])
            events += [_event(batch, row, k, steps[k : k + 2, column]) for k in changed.tolist()]
        return events

    def _codes(self, batch: Batch) -> IntArray:
        """Return the codes of the watched rows, (k, rows): active, else violated ones with an offset."""
        active, violated = batch.active_code[:, self._rows], batch.violated_code[:, self._rows]
        return np.where((active == 0) & (violated != 0), violated + np.sign(violated) * _VIOLATED, active)

    def _send_any(self, writer: RecordingWriter, batch: Batch, previous: bool | None, active: Mask) -> None:
        """Send one row for all limits together, so that the timeline is never empty."""
        path = data_path(batch.resolver, "active", _ANY)
        before = not active[0] if previous is None else previous
        changed = np.flatnonzero(active != np.concatenate([[before], active[:-1]]))
        if previous is None:
            look = rr.StateConfiguration(values=[*_ANY_WORDS], colors=colours(FREE, UPPER))
            writer.log_static(path, look)
        if len(changed):
            words = [_ANY_WORDS[int(active[k])] for k in changed]
            states = rr.StateChange.columns(state=words)
            writer.send_columns(path, batch.index[changed], batch.time[changed], states)

    def _send_row(
        self, writer: RecordingWriter, batch: Batch, row: int, changed: IntArray, code: IntArray
    ) -> None:
        """Send the changes of one row, after opening it with "free" from the start of the run."""
        path = self._path(batch, row)
        if (batch.resolver, row) not in self._opened:
            self._opened.add((batch.resolver, row))
            writer.log_static(path, self._look(batch, row))
            if changed[0] > 0 or batch.index[0] > 0:
                start = np.zeros(1, dtype=np.int64)
                free = rr.StateChange.columns(state=["free"])
                writer.send_columns(path, start, start.astype("timedelta64[ns]"), free)
        words = [_words(batch, row, int(value)) for value in code[changed]]
        states = rr.StateChange.columns(state=words)
        writer.send_columns(path, batch.index[changed], batch.time[changed], states)

    def _path(self, batch: Batch, row: int) -> str:
        """Return the entity path of a row, without escapes, since it is also the title in the viewer."""
        parts = (batch.row_names[row],) if row < batch.layout.n else batch.row_names[row].split("/", 1)
        return data_path(batch.resolver, "active", *map(plain_part, parts))

    def _look(self, batch: Batch, row: int) -> rr.StateConfiguration:
        """Return the colours and labels of the states that a row can have."""
        sides = {"upper": UPPER, "lower": UPPER if row in self._pairs else LOWER}
        owners = batch.layout.owners if row < batch.layout.n else ("",)
        if row >= batch.layout.n and batch.layout.block_of(row - batch.layout.n).choices:
            owners = ()  # thousands of pairs, whose colours are left to the viewer
        states = {f"{owner} {side}".strip(): colour for owner in owners for side, colour in sides.items()}
        states |= {f"over {state}": VIOLATED for state in states}
        states["free"] = FREE
        labels = [_PAIR_LABELS.get(state, state) if row in self._pairs else _label(state) for state in states]
        return rr.StateConfiguration(
            values=[*states], labels=[*map(drawable, labels)], colors=colours(*states.values())
        )


def _words(batch: Batch, row: int, code: int) -> str:
    """Describe a code of the timeline, with "over" before a bound that is violated."""
    if abs(code) > _VIOLATED:
        return "over " + batch.code_words(row, code - int(np.sign(code)) * _VIOLATED)
    return batch.code_words(row, code)


def _event(batch: Batch, row: int, position: int, codes: IntArray) -> Event:
    """Describe the change of one row between two ticks, from codes[0] to codes[1]."""
    old, new = codes.tolist()
    told = new or old
    violated = abs(told) > _VIOLATED
    name = batch.active_name(row, told - int(np.sign(told)) * _VIOLATED if violated else told)
    if new == 0:
        return Event(position, "DEBUG", f"{name} is kept again" if violated else f"{name} is free again")
    return Event(position, *(("WARN", f"{name} is violated") if violated else ("INFO", f"{name} is active")))


def _label(state: str) -> str:
    """Shorten a state for the timeline: "joint_velocity upper" becomes "velocity +"."""
    words = state.replace("joint_", "").replace("_", " ")
    return words.removesuffix(" upper") + " +" if words.endswith(" upper") else words.replace(" lower", " −")
