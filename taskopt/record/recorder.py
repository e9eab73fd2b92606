"""Listeners of a run: what a recorder is, and the log that gathers steps for its sinks."""

from collections.abc import Generator, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from threading import Event, Lock, Thread
from time import monotonic
from types import TracebackType
from typing import Protocol, Self

from taskopt.kinematics.stack import Plan
from taskopt.loop.run import Step
from taskopt.loop.scenario import Scenario
from taskopt.record.batch import Batch

PERIOD = 0.6  # [s] of wall-clock between two flushes
_PATIENCE = 0.7  # [s] without a flush before the watchdog does it
_CAPACITY = 4000  # steps kept in memory at most


class Recorder(Protocol):
    """Listens to a run: opened as a context, shown every step, closed even if the run fails."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def write(self, step: Step) -> None:
        """Take note of a step; it and its arrays are never changed afterwards."""
        ...


@dataclass(frozen=True, eq=False)
class RunInfo:
    """What is known before the first step: scenario, names of the resolvers, file, seed."""

    scenario: Scenario
    resolvers: tuple[str, ...]
    source: Path | None = None
    seed: int | None = None

    @cached_property
    def plan(self) -> Plan:
        """The stack compiled for the robot, filled at the start: names, frames, units, kinds of rows."""
        plan = self.new_plan()
        plan.at(self.scenario.start, 0.0)
        return plan

    def new_plan(self) -> Plan:
        """A plan of one's own, to look at references without disturbing the run."""
        return self.scenario.stack.compile(self.scenario.robot, self.scenario.dt)


class Sink(Protocol):
    """Where batches of steps go; each sink owns its files."""

    def open(self, info: RunInfo) -> None: ...

    def take(self, batch: Batch) -> None:
        """Write a batch so that a kill right after the return loses nothing of it."""
        ...

    def close(self, status: str) -> None:
        """No more batches; `status` is 'finished', or 'interrupted' where the run failed."""
        ...


def record(steps: Iterable[Step], *recorders: Recorder) -> Generator[Step, None, None]:
    """Pass the steps through, showing each to every recorder."""
    with ExitStack() as opened:
        listeners = [opened.enter_context(recorder) for recorder in recorders]
        for step in steps:
            for listener in listeners:
                listener.write(step)
            yield step


class Gatherer:
    """Recorder that keeps steps for at most 0.7 s of wall-clock, then hands them to its sinks.

    Writing a step appends it to a list; everything else is done by the batch, in array code. A
    watchdog hands over what waits while a single tick takes long, so that a kill costs less than a
    second at any speed.
    """

    def __init__(self, info: RunInfo, sinks: Sequence[Sink]) -> None:
        self.info = info
        self._sinks = tuple(sinks)
        self._waiting: dict[str, list[Step]] = {}
        self._count = 0
        self._flushed = monotonic()
        self._lock, self._done = Lock(), Event()
        self._watchdog = Thread(target=self._watch, name="taskopt-record", daemon=True)
        self._failure: Exception | None = None

    def __enter__(self) -> Self:
        with ExitStack() as opened:
            for sink in self._sinks:
                sink.open(self.info)
                opened.callback(sink.close, "interrupted")
            opened.pop_all()
        self._flushed = monotonic()
        self._watchdog.start()
        return self

    def write(self, step: Step) -> None:
        if self._failure is not None:
            raise self._failure
        with self._lock:
            self._waiting.setdefault(step.resolver, []).append(step)
            self._count += 1
            if self._count >= _CAPACITY or monotonic() - self._flushed > PERIOD:
                self._flush()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._done.set()
        self._watchdog.join()
        status = "finished" if kind is None else "interrupted"
        with ExitStack() as closing:
            for sink in self._sinks:
                closing.callback(sink.close, status)
            self._flush()

    def _flush(self) -> None:
        waiting, self._waiting, self._count = self._waiting, {}, 0
        for steps in waiting.values():
            batch = Batch(tuple(steps))
            for sink in self._sinks:
                sink.take(batch)
        self._flushed = monotonic()

    def _watch(self) -> None:
        while not self._done.wait(0.1):
            with self._lock:
                if self._count and monotonic() - self._flushed > _PATIENCE:
                    try:
                        self._flush()
                    except Exception as error:  # noqa: BLE001  raised again by the next write
                        self._failure = error
                        return
