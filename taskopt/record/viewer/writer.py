"""One recording, sent to a file and perhaps to a viewer: static data and columns over time."""

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import Any

from taskopt.arrays import IntArray
from taskopt.errors import InvalidValue

TIME, TICK = "sim_time", "tick"
_BACKLOG = 200  # sends that may wait for a viewer; beyond it they are dropped
_GOODBYE = 2.0  # [s] that a viewer has to take the rest when a run ends

Send = Callable[[Any], None]  # does something with a rerun.RecordingStream


class Stage:
    """Where drawing goes. `path` is the file; `live` the address of a viewer that also gets it all.

    The viewer has a stream and a thread of its own, so that one that hangs or goes away neither stops
    nor slows a run: what it cannot take is dropped, and the file stays complete.
    """

    def __init__(self, path: Path, name: str, blueprint: Any, live: str | None = None) -> None:
        import rerun as rr

        self._file = _stream(name, f"{name}-{path.parent.name}")
        try:
            self._file.set_sinks(rr.FileSink(path), default_blueprint=blueprint)
        except RuntimeError as error:
            raise InvalidValue(
                f"cannot write the recording {path}: {error}; choose another folder"
            ) from error
        self._viewer = None if live is None else Viewer(live, name, f"{name}-{path.parent.name}", blueprint)

    def static(self, path: str, *archetypes: Any) -> None:
        """Log data that holds for the whole run."""
        self._send(lambda stream: stream.log(path, *archetypes, static=True))

    def columns(self, path: str, tick: IntArray, time: Any, columns: Iterable[Any]) -> None:
        """Send rows at `tick` and `time` (whole nanoseconds, timedelta64[ns])."""
        import rerun as rr

        if len(tick) == 0:
            return
        index = [rr.TimeColumn(TICK, sequence=tick), rr.TimeColumn(TIME, duration=time)]
        columns = list(columns)
        self._send(lambda stream: stream.send_columns(path, index, columns))

    def properties(self, name: str, content: dict[str, Any]) -> None:
        """Note facts about the run that a program can read: nested values as JSON."""
        import rerun as rr

        known = {k: v for k, v in content.items() if v is not None}
        plain = {k: v if isinstance(v, str | int | float) else json.dumps(v) for k, v in known.items()}
        self._send(lambda stream: stream.send_property(name, rr.AnyValues(drop_untyped_nones=True, **plain)))

    def flush(self) -> None:
        """Bring all of it to the file; what was sent before survives a kill."""
        self._file.flush()

    def close(self) -> None:
        self._file.flush()
        self._file.disconnect()
        if self._viewer is not None:
            self._viewer.close()

    def _send(self, send: Send) -> None:
        send(self._file)
        if self._viewer is not None:
            self._viewer.put(send)


class Viewer:
    """A running viewer that is fed from a thread of its own."""

    def __init__(self, address: str, name: str, recording: str, blueprint: Any) -> None:
        self._stream = _stream(name, recording)
        self._queue: Queue[Send] = Queue(_BACKLOG)
        self._done = Event()
        self._thread = Thread(target=self._feed, args=(address, blueprint), daemon=True)
        self._thread.start()

    def put(self, send: Send) -> None:
        try:
            self._queue.put_nowait(send)
        except Full:
            self._done.set()  # it hangs: a gap in a recording would mislead, so it gets no more

    def close(self) -> None:
        """Let the viewer take the rest; one that hangs is left behind, also when Python ends."""
        import rerun as rr

        self._done.set()
        self._thread.join(_GOODBYE)
        if self._thread.is_alive():
            rr.unregister_shutdown()

    def _feed(self, address: str, blueprint: Any) -> None:
        import rerun as rr

        self._stream.set_sinks(rr.GrpcSink(address), default_blueprint=blueprint)
        while True:
            try:
                send = self._queue.get(timeout=0.1)
            except Empty:
                if self._done.is_set():
                    break
            else:
                send(self._stream)
        self._stream.disconnect()


def _stream(name: str, recording: str) -> Any:
    import rerun as rr

    stream = rr.RecordingStream("taskopt", recording_id=recording)
    stream.set_log_time_enabled(False)
    stream.send_recording_name(name)
    return stream
