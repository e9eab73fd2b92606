"""`RawLog`, into which a control loop copies its ticks."""

import os
import subprocess
import sys
import weakref
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter_ns, sleep
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.errors import InvalidValue, LogFailed
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.kinematics.changes import Applied
from taskopt.log.description import Description
from taskopt.log.instructions import Instructions
from taskopt.log.ring import Counter, End, Ring
from taskopt.log.slots import NANOSECONDS, NUMBERS
from taskopt.log.words import words
from taskopt.resolver.base import Memory

_OPENING = 30.0  # [s] that the writer may take until it has opened the file
_CLOSING = 60.0  # [s] that it may take to write what is left
_PAUSE = 0.001  # [s] between two looks at a full ring
STATUS_NUMBERS = {status: number for number, status in enumerate(Status)}
_PROGRAM = "import sys; sys.path[:] = {path!r}; from taskopt.log.writer import main; main()"


class Tick(NamedTuple):
    """What a loop knows about a tick besides its answer.

    Attributes:
        index: Number of the tick, from 0.
        t: Time [s].
        dt: Time until the next tick [s].
        q: Posture, (nq,); None if it is not logged.
        v_before: Velocity before the tick, (n,); None if it is what the tick before sent, or unknown.
        memory: Memory that the resolver began with; as `Memory`, or as the history (3, n + M) of a compiled
            loop; None for none.
        base_box: Bounds that do not depend on the posture, (4, n).
        seconds: Times of resolver and rows [s]; None if they were not measured.
        resolver: Number of the resolver.
        damped_memory: Memory with which the last solution of a damped tick began.
        errors: Error of each task that has one.
        desired: Desired pose of each task that has one, (4, 4).
        actual: Actual pose of the same tasks.
        moving: Pose of each obstacle that moves.
        changes: Changes of parameters that the tick has applied.
    """

    index: int
    t: float
    dt: float
    q: Array | None
    v_before: Array | None
    memory: "Memory | StateArray | None"
    base_box: Array
    seconds: tuple[float, float] | None = None
    resolver: int = 0
    damped_memory: Memory | None = None
    errors: Sequence[Array] = ()
    desired: Sequence[Array] = ()
    actual: Sequence[Array] = ()
    moving: Sequence[Array] = ()
    changes: Sequence[Applied] = ()


def checked_path(path: str | Path) -> Path:
    """Check that a file may be a log by its name.

    Args:
        path: The file.

    Returns:
        The same as a path.

    Raises:
        InvalidValue: It does not end in .arrow.
    """
    if Path(path).suffix != ".arrow":
        raise InvalidValue(f"the name of a log must end in .arrow, got '{path}'")
    return Path(path)


class RawLog:
    """A log that is being written: a ring of ticks, and the process that writes them to a file.

    Args:
        path: The file; one that exists is replaced.
        description: What all ticks have in common.

    Attributes:
        path: The file.
        ring: The ring.
        begin: When the log was opened, by the clock of `perf_counter_ns` [ns].
        sent: The last answer of each resolver by its number, as the array itself.

    Raises:
        InvalidValue: The file cannot be written, or does not end in .arrow; the message says why.
    """

    def __init__(self, path: str | Path, description: Description) -> None:
        self.path = checked_path(path)
        self.ring = Ring(description.fields)
        self._counters, self._fields = self.ring.counters, self.ring.fields
        self._slots, self.begin = self.ring.slots, perf_counter_ns()
        self.sent: dict[int, Array] = {}
        self._shared: dict[Layout, list[tuple[int, int]]] = {}
        self._plain = description.layout.answer_size
        self._buffer = self._plain - description.layout.size
        instructions = Instructions(
            str(self.path), description.fields, description.columns, description.metadata
        )
        self._process = _started(self.ring, instructions)
        os.close(self.ring.file)  # the mapping stays
        self._end = weakref.finalize(self, _close, self.ring, self._process, os.getpid(), End.FINISHED, "")
        self._wait_for_file()

    @property
    def count(self) -> int:
        """Number of ticks that are in the log, or on their way."""
        return int(self._counters[Counter.WRITTEN])

    @property
    def waits(self) -> tuple[int, float]:
        """Number of ticks that had to wait for the writer, and the time that they waited [s]."""
        return int(self._counters[Counter.WAITS]), int(self._counters[Counter.WAITED]) / NANOSECONDS

    @property
    def open(self) -> bool:
        """True until the log is closed, or has failed."""
        return self._end.alive

    def add(self, tick: Tick, answer: Resolution, declared: Hierarchy, error: str = "") -> None:
        """Copy a tick into the ring.

        Args:
            tick: The tick.
            answer: What was sent; or what was refused, if there is an error.
            declared: The hierarchy of the tick, as the stack declares it.
            error: The error that the tick raised; "" for none.

        Raises:
            LogFailed: The writer cannot go on, as on a full disk; the log is closed.
        """
        place, fields = self._free_slot(), self._fields
        plain = answer if answer.undamped is None else answer.undamped
        foreign = plain.source.layout is not declared.layout and plain.answer.size != self._plain
        changed = not foreign and plain.source is not declared
        if foreign:
            self._copy_foreign(place, plain, declared)
        else:
            fields["answer"][place], fields["state"][place] = plain.answer, plain.state
        if changed:
            fields["changed"][place] = fields["answer"][place, self._buffer :]
            fields["answer"][place, self._buffer :] = declared.buffer
        fields["x"][place] = answer.x
        given = tick.v_before is not None and tick.v_before is not self.sent.get(tick.resolver)
        if tick.v_before is not None:
            fields["v_before"][place] = tick.v_before
        self.sent[tick.resolver] = answer.x
        fields["base"][place] = tick.base_box.ravel()
        self._copy_state(place, tick)
        flags = self._remember("memory", place, tick.memory)
        damped = answer.is_damped
        later = self._copy_damped(place, answer, tick.damped_memory) if damped else (0, 0, 0)
        text = words(error, answer.notes, answer.fallback, tick.changes)
        if text:
            fields["text"][place, : len(text)] = np.frombuffer(text, dtype=np.uint8)
        ranks = tick.memory.ranks if isinstance(tick.memory, Memory) else ()
        if ranks:
            fields["ranks"][place, : len(ranks)] = ranks
        seconds = tick.seconds or (0.0, 0.0)
        fields["times"][place] = tick.t, tick.dt, *seconds
        fields["numbers"][place] = (
            tick.index, perf_counter_ns() - self.begin, tick.resolver, STATUS_NUMBERS[answer.status],
            answer.iterations, bool(error), tick.seconds is not None, *flags, len(ranks), damped,
            STATUS_NUMBERS[plain.status], plain.iterations, *later, changed, given, foreign, len(text),
        )  # fmt: skip
        self._counters[Counter.WRITTEN] += 1

    def close(self, end: End = End.FINISHED, why: str = "") -> None:
        """Wait until everything is in the file, and close it; closing twice does nothing.

        Args:
            end: How the loop ended.
            why: The error or the signal that interrupted it.

        Raises:
            LogFailed: Not everything could be written.
        """
        if self._end.detach() is not None:
            _close(self.ring, self._process, os.getpid(), end, why)
            self._raise_if_failed()

    def _copy_foreign(self, place: int, answer: Resolution, declared: Hierarchy) -> None:
        """Copy an answer to a problem of another layout, such as that of one weighted program.

        Its multipliers do not belong to the declared levels, and are left out.
        """
        layout, source = declared.layout, answer.source.layout
        if source not in self._shared:
            found = {name: i for i, name in enumerate([*source.unknowns, *source.row_names])}
            names = [*layout.unknowns, *layout.row_names]
            self._shared[source] = [(i, found[name]) for i, name in enumerate(names) if name in found]
        row, state = self._fields["answer"][place], self._fields["state"][place]
        row[:], state[:] = np.nan, 0
        row[: declared.n], row[self._buffer :] = answer.x, declared.buffer
        for own, other in self._shared[source]:
            state[own] = answer.state[other]

    def _copy_state(self, place: int, tick: Tick) -> None:
        """Copy posture, errors and poses."""
        fields = self._fields
        if tick.q is not None:
            fields["q"][place] = tick.q
        start = 0
        errors = fields["errors"][place]
        for error in tick.errors:
            errors[start : start + error.size] = error
            start += error.size
        for i, pose in enumerate(tick.desired):
            fields["desired"][place, 16 * i : 16 * i + 16].reshape(4, 4)[:] = pose
        for i, pose in enumerate(tick.actual):
            fields["actual"][place, 3 * i : 3 * i + 3] = pose[:3, 3]
        for i, pose in enumerate(tick.moving):
            fields["moving"][place, 16 * i : 16 * i + 16].reshape(4, 4)[:] = pose

    def _remember(
        self, name: str, place: int, memory: "Memory | StateArray | None"
    ) -> tuple[bool, bool, bool]:
        """Copy a memory; return if there is one, if it has a set before, and if the two alternate."""
        width = self._fields[name].shape[1] // 3
        if memory is None or (isinstance(memory, Memory) and memory.state.size != width):
            return False, False, False  # a memory of another layout is that of a resolver that starts cold
        into = self._fields[name][place]
        if isinstance(memory, Memory):
            into[:width] = memory.state
            if memory.previous is not None:
                into[width : 2 * width] = memory.previous
            return True, memory.previous is not None, memory.alternates
        into[:] = memory.ravel()
        return True, True, bool(memory[2, 0])

    def _copy_damped(self, place: int, answer: Resolution, memory: Memory | None) -> tuple[bool, bool, bool]:
        """Copy the answer of a damped tick; return the same as `_remember`."""
        self._fields["damped"][place] = answer.answer
        self._fields["damped_state"][place] = answer.state
        return self._remember("damped_memory", place, memory)

    def _free_slot(self) -> int:
        """Return the place of the next slot, as soon as it is free."""
        if self._counters[Counter.FAILED] or not self._end.alive:
            self._raise_if_failed()
            raise LogFailed(f"{self.path} is closed; a closed log takes no more ticks")
        count = self.count
        if count - self._counters[Counter.CONSUMED] >= self._slots:
            begin = perf_counter_ns()
            while count - self._counters[Counter.CONSUMED] >= self._slots:
                self._raise_if_failed()
                sleep(_PAUSE)
            self._counters[Counter.WAITS] += 1
            self._counters[Counter.WAITED] += perf_counter_ns() - begin
        return count % self._slots

    def _raise_if_failed(self) -> None:
        """Raise an error if the writer has given up or has died."""
        code = self._process.poll()
        if not self._counters[Counter.FAILED] and code in (None, 0):
            return
        self._end.detach()
        reason = self.ring.message if self._counters[Counter.FAILED] else f"its writer ended with code {code}"
        written = int(self._counters[Counter.CONSUMED])
        raise LogFailed(
            f"the log {self.path} cannot be written: {reason}; {written} of {self.count} ticks are in it"
        )

    def _wait_for_file(self) -> None:
        """Wait until the writer has opened the file."""
        for _ in range(int(_OPENING / 0.005)):
            if self._counters[Counter.READY]:
                return
            if self._process.poll() is not None or self._counters[Counter.FAILED]:
                break
            sleep(0.005)
        self._process.kill()
        self._process.wait()
        self._end.detach()
        reason = self.ring.message or "its writer did not start"
        raise InvalidValue(f"cannot write the log {self.path}: {reason}; choose another file")


def _started(ring: Ring, instructions: Instructions) -> "subprocess.Popen[bytes]":
    """Start the writer."""
    program = _PROGRAM.format(path=[str(place) for place in sys.path])
    words = [sys.executable, "-c", program, str(ring.file), str(os.getpid())]
    process = subprocess.Popen(  # in a session of its own, so that Ctrl-C in a terminal does not reach it
        words, stdin=subprocess.PIPE, pass_fds=(ring.file,), start_new_session=True
    )
    assert process.stdin is not None
    process.stdin.write(instructions.line().encode())
    process.stdin.flush()
    return process


def _close(ring: Ring, process: "subprocess.Popen[bytes]", owner: int, end: End, why: str) -> None:
    """Tell the writer that the last tick is in the ring, and wait until it has written all."""
    if os.getpid() != owner:  # a fork of the loop ends; the log is not its own
        return
    if not ring.counters[Counter.FAILED]:
        ring.tell(Counter.CLOSED, int(end), why)
    try:
        process.wait(_CLOSING)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    if process.stdin is not None:
        process.stdin.close()


assert NUMBERS[-1] == "text"
