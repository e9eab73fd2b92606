"""Recorders, which receive the steps of a run, and sinks, which receive them in batches."""

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import ExitStack
from threading import Event, Lock, Thread
from time import monotonic
from types import TracebackType
from typing import Protocol, Self

from taskopt.loop.run import Step
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo

PERIOD = 0.6  # [s] of wall-clock time between two flushes
_PATIENCE = 0.7  # [s] of wall-clock time without a flush after which the watchdog flushes
_CAPACITY = 4000  # largest number of steps that are kept in memory


class Recorder(Protocol):
    """A listener of a run: a context manager that gets every step, and is closed even if the run fails."""

    def __enter__(self) -> Self:
        """Open everything that the recorder writes to.

        Returns:
            The recorder itself.
        """
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the remaining data and close everything.

        Args:
            kind: The type of the exception that ended the run; None if the run finished.
            error: That exception.
            trace: Its traceback.
        """
        ...

    def write(self, step: Step) -> None:
        """Record a step.

        Args:
            step: The step; neither it nor its arrays are changed afterwards, so it may be kept.
        """
        ...


class Sink(Protocol):
    """A destination of batches, such as a table; each sink owns its files."""

    def open(self, info: RunInfo) -> None:
        """Open the files, before the first batch.

        Args:
            info: The facts about the run.
        """
        ...

    def take(self, batch: Batch) -> None:
        """Write a batch so that a kill right after the return loses nothing of it.

        Args:
            batch: Consecutive steps of one resolver.
        """
        ...

    def close(self, status: str) -> None:
        """Close the files, after the last batch.

        Args:
            status: "finished", or "interrupted" if the run ended early.
        """
        ...


def record(steps: Iterable[Step], *recorders: Recorder) -> Generator[Step, None, None]:
    """Yield the steps of a run again, and pass each to every recorder.

    The recorders are opened before the first step. They are closed after the last one, if the run raises
    an exception, and if the consumer stops early.

    Args:
        steps: The steps of one resolver, or of several that take turns.
        recorders: The listeners, in the order in which they receive a step.

    Returns:
        A generator of the same steps.
    """
    with ExitStack() as opened:
        listeners = [opened.enter_context(recorder) for recorder in recorders]
        for step in steps:
            for listener in listeners:
                listener.write(step)
            yield step


class BufferedRecorder:
    """Collect steps for at most 0.7 s of wall-clock time, then pass them to the sinks in one batch.

    Writing a step only appends it to a list; all other work is done on whole batches, in array code. A
    watchdog thread flushes the waiting steps while a single tick takes long, so that a kill loses less
    than a second at any speed of the run.
    """

    def __init__(self, info: RunInfo, sinks: Sequence[Sink]) -> None:
        """Prepare a recorder; entering its context opens the sinks.

        Args:
            info: The facts about the run.
            sinks: The destinations of the batches.
        """
        self.info = info
        self._sinks = tuple(sinks)
        self._waiting: dict[str, list[Step]] = {}
        self._count = 0
        self._flushed = monotonic()
        self._lock, self._done = Lock(), Event()
        self._watchdog = Thread(target=self._watch, name="taskopt-record", daemon=True)
        self._failure: Exception | None = None

    def __enter__(self) -> Self:
        """Open all sinks; if one of them cannot open, those before it are closed.

        Returns:
            The recorder itself.
        """
        with ExitStack() as opened:
            for sink in self._sinks:
                sink.open(self.info)
                opened.callback(sink.close, "interrupted")
            opened.pop_all()
        self._flushed = monotonic()
        self._watchdog.start()
        return self

    def write(self, step: Step) -> None:
        """Keep a step, and flush if the buffer is full or 0.6 s have passed since the last flush.

        Args:
            step: The step to record.

        Raises:
            Exception: The error that a sink raised while the watchdog flushed.
        """
        if self._failure is not None:
            raise self._failure
        with self._lock:
            self._waiting.setdefault(step.resolver, []).append(step)
            self._count += 1
            if self._count >= _CAPACITY or monotonic() - self._flushed > PERIOD:
                self._flush()

    def flush(self) -> None:
        """Pass all waiting steps to the sinks now."""
        with self._lock:
            self._flush()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Flush the remaining steps and close all sinks, even if one of them fails.

        Args:
            kind: The type of the exception that ended the run; None if the run finished.
            error: That exception.
            trace: Its traceback.

        Raises:
            Exception: The error that a sink raised while the watchdog flushed, unless an exception ended the
                run, which then gets a note about it.
        """
        self._done.set()
        self._watchdog.join()
        failure = self._failure
        status = "finished" if kind is None and failure is None else "interrupted"
        with ExitStack() as closing:
            for sink in self._sinks:
                closing.push(_closing(sink, status))
            self._flush()
        if failure is not None and error is None:
            raise failure
        if failure is not None and error is not None and error is not failure:
            error.add_note(f"the log lacks steps, since a recorder failed: {failure}")

    def _flush(self) -> None:
        """Pass the waiting steps to the sinks; the caller holds the lock, or is the only remaining thread."""
        waiting, self._waiting, self._count = self._waiting, {}, 0
        for steps in waiting.values():
            batch = Batch(tuple(steps))
            for sink in self._sinks:
                sink.take(batch)
        self._flushed = monotonic()

    def _watch(self) -> None:
        """Flush whenever steps have waited too long, until the recorder is closed."""
        while not self._done.wait(0.1):
            with self._lock:
                if self._count and monotonic() - self._flushed > _PATIENCE:
                    try:
                        self._flush()
                    except Exception as error:  # noqa: BLE001
                        # A sink may raise anything, and a thread has no caller, so that the next
                        # `write` raises it, or `__exit__`.
                        self._failure = error
                        return


def _closing(sink: Sink, status: str) -> Callable[[object, object, object], bool]:
    """Return a function that closes a sink, as interrupted if something failed before."""

    def close(kind: object, error: object, trace: object) -> bool:  # noqa: ARG001 (an exit has three arguments)
        """Close the sink, and let the error pass."""
        sink.close(status if kind is None else "interrupted")
        return False

    return close
