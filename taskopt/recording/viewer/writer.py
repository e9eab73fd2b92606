"""Writing of a Rerun recording to a file and, if requested, to a running viewer."""

import json
import subprocess
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from queue import Empty, Full, Queue
from shutil import disk_usage
from threading import Event, Thread

import rerun as rr
import rerun.blueprint as rrb

from taskopt.arrays import IntArray
from taskopt.errors import InvalidValue, LogFailed, NotInstalled
from taskopt.log.provenance import Json
from taskopt.recording.batch import Nanoseconds
from taskopt.recording.viewer.open import viewer_program

TIME, TICK = "sim_time", "tick"
_BACKLOG = 200  # largest number of sends that wait for a viewer; beyond it the viewer gets no more
_SMALL = 1 << 20  # bytes; Rerun does not say why it gave up, and with less than this it is no riddle
_GOODBYE = 2.0  # [s] of wall-clock time that a viewer has to take the rest when a run ends

_MERGING = 60.0  # [s] of wall-clock time after which a file stays in pieces

Send = Callable[[rr.RecordingStream], None]  # sends something on a stream


class RecordingWriter:
    """Send static data and columns over time to a recording.

    The viewer has a stream and a thread of its own. If it hangs or is closed, it gets no more data, while the
    run is neither stopped nor slowed, and the file stays complete.
    """

    def __init__(
        self,
        path: Path,
        name: str,
        blueprint: rrb.Blueprint | None,
        live: str | None = None,
        layout: str = "run",
    ) -> None:
        """Open the file, and connect to the viewer.

        Args:
            path: The file to write, in an existing folder.
            name: The name of the recording in the viewer.
            blueprint: The layout that the recording opens with; None: that which `send_layout` sends.
            live: The address of a running viewer, such as rerun+http://127.0.0.1:9876/proxy, if any, which
                needs the layout at once.
            layout: The name of the layout. A viewer keeps one layout for each application, which is therefore
                named by recording and layout.

        Raises:
            InvalidValue: If the file cannot be written.
        """
        recording = f"{name}-{path.parent.name}-{path.stem}"
        self._path, application = path, f"taskopt {name} {layout}"
        self._file = _new_stream(application, name, recording)
        try:
            self._file.set_sinks(rr.FileSink(path), default_blueprint=blueprint)
        except RuntimeError as error:
            raise InvalidValue(
                f"cannot write the recording {path}: {error}; choose another folder"
            ) from error
        self._viewer = None
        if live is not None and blueprint is not None:
            self._viewer = LiveViewer(live, _new_stream(application, name, recording), blueprint)

    def log_static(self, path: str, *archetypes: rr.AsComponents) -> None:
        """Send data that hold for the whole run.

        Args:
            path: The entity path.
            *archetypes: The data, as Rerun's archetypes.
        """
        self._send(lambda stream: stream.log(path, *archetypes, static=True))

    def send_columns(
        self, path: str, tick: IntArray, time: Nanoseconds, columns: Iterable[rr.ComponentColumn]
    ) -> None:
        """Send data that change over time; nothing is sent for no rows.

        Args:
            path: The entity path.
            tick: The number of the tick of each row, (k,).
            time: The time of each row in whole nanoseconds, (k,).
            columns: Rerun's component columns, of k rows each.
        """
        if len(tick) == 0:
            return
        index = [rr.TimeColumn(TICK, sequence=tick), rr.TimeColumn(TIME, duration=time)]
        rows = list(columns)
        self._send(lambda stream: stream.send_columns(path, index, rows))

    def send_layout(self, blueprint: rrb.Blueprint) -> None:
        """Send the layout that the recording opens with, once everything that it shows is known.

        Args:
            blueprint: The layout.
        """
        self._send(lambda stream: stream.send_blueprint(blueprint, make_active=True, make_default=True))

    def set_properties(self, name: str, facts: Mapping[str, Json]) -> None:
        """Attach facts about the run that a program can read.

        Args:
            name: The name of the group of facts.
            facts: The facts; lists and dictionaries are written as JSON, and None is left out.
        """
        known = {key: value for key, value in facts.items() if value is not None}
        plain = {
            key: value if isinstance(value, str | int | float) else json.dumps(value)
            for key, value in known.items()
        }
        self._send(lambda stream: stream.send_property(name, rr.AnyValues(drop_untyped_nones=True, **plain)))

    def flush(self) -> None:
        """Write everything that was sent to the file, so that it is kept if the process is killed.

        Raises:
            LogFailed: The file cannot be written, as on a full disk.
        """
        try:
            self._file.flush()
        except RuntimeError as error:
            full = "no space is left on the disk; " if disk_usage(self._path.parent).free < _SMALL else ""
            raise LogFailed(f"{full}Rerun says of {self._path.name}: {error}") from error

    def close(self) -> None:
        """Complete the file in its shortest form, and send the rest to the viewer for at most 2 s.

        Raises:
            LogFailed: The file cannot be written, as on a full disk.
        """
        try:
            self.flush()
            self._file.disconnect()
            optimise(self._path)
        finally:
            if self._viewer is not None:
                self._viewer.close()

    def _send(self, send: Send) -> None:
        """Send to the file now, and to the viewer from its own thread."""
        send(self._file)
        if self._viewer is not None:
            self._viewer.put(send)


class LiveViewer:
    """Feed a running viewer from a thread of its own."""

    def __init__(self, address: str, stream: rr.RecordingStream, blueprint: rrb.Blueprint) -> None:
        """Start the thread, which connects to the viewer.

        Args:
            address: The address of the viewer.
            stream: A stream that nobody else uses.
            blueprint: The layout that the viewer shows.
        """
        self._stream = stream
        self._queue: Queue[Send] = Queue(_BACKLOG)
        self._done = Event()
        self._thread = Thread(target=self._feed, args=(address, blueprint), daemon=True)
        self._thread.start()

    def put(self, send: Send) -> None:
        """Queue data for the viewer; if it lags behind, it gets no more data, since a gap would mislead.

        Args:
            send: The function that sends the data on a stream.
        """
        try:
            self._queue.put_nowait(send)
        except Full:
            self._done.set()

    def close(self) -> None:
        """Send the remaining data for at most 2 s; Python does not wait for the viewer after that."""
        self._done.set()
        self._thread.join(_GOODBYE)
        if self._thread.is_alive():
            rr.unregister_shutdown()

    def _feed(self, address: str, blueprint: rrb.Blueprint) -> None:
        """Connect, then send what is queued until the run ends and the queue is empty."""
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


def optimise(path: Path) -> None:
    """Merge the small pieces of a recording, which makes it smaller and quicker to open.

    If Rerun's program is missing or cannot do it, the file stays as it is, which is complete, too.

    Args:
        path: A complete recording.
    """
    merged = path.with_suffix(".part")
    try:
        words = [viewer_program(), "rrd", "optimize", str(path), "-o", str(merged)]
        done = subprocess.run(words, capture_output=True, check=False, timeout=_MERGING)
    except (NotInstalled, OSError, subprocess.TimeoutExpired):
        done = None
    if done is not None and done.returncode == 0 and merged.is_file():
        merged.replace(path)
    else:
        merged.unlink(missing_ok=True)


def _new_stream(application: str, name: str, recording: str) -> rr.RecordingStream:
    """Make a stream without wall-clock times, so that equal runs make equal recordings."""
    stream = rr.RecordingStream(application, recording_id=recording)
    stream.set_log_time_enabled(False)
    stream.send_recording_name(name)
    return stream
