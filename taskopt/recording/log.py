"""The log of a run: a folder with a Rerun recording, a table and a manifest.

This is the only module of `recording` that imports its `viewer`, and with it Rerun. A program that only needs
data imports the other modules and does not wait for Rerun.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Self

from taskopt.errors import InvalidValue, LogFailed
from taskopt.loop.run import Step
from taskopt.recording.manifest import FILE as MANIFEST
from taskopt.recording.manifest import ManifestSink
from taskopt.recording.reading import LOGS, RECORDING
from taskopt.recording.recorder import BufferedRecorder
from taskopt.recording.run_info import RunInfo
from taskopt.recording.table import FILE as TABLE
from taskopt.recording.table import TableSink
from taskopt.recording.viewer.sink import RecordingSink


class Log(BufferedRecorder):
    """Record a run into a folder: use the log as a context and `write` every step.

    Attributes:
        folder: The folder that holds the recording, the table and the manifest.
    """

    def __init__(self, info: RunInfo, folder: Path, live: str | None = None) -> None:
        """Prepare a log; entering its context opens the files.

        Args:
            info: The facts about the run.
            folder: An existing folder that can be written to.
            live: The address of a running viewer that gets the recording as well, if any.
        """
        self.folder = folder
        sinks = (
            ManifestSink(folder / MANIFEST),
            TableSink(folder / TABLE),
            RecordingSink(folder / RECORDING, live),
        )
        super().__init__(info, sinks)

    def __enter__(self) -> Self:
        """Open all files.

        Returns:
            The log itself.

        Raises:
            LogFailed: A file cannot be written, as on a full disk.
        """
        with self._failing():
            return super().__enter__()

    def write(self, step: Step) -> None:
        """Keep a step, and write what has waited long enough.

        Args:
            step: The step to record.

        Raises:
            LogFailed: A file cannot be written any more, as on a full disk.
        """
        try:
            super().write(step)
        except OSError as error:
            raise self._failed(error) from error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the remaining steps and close all files; the manifest says if that failed.

        Args:
            kind: The type of the exception that ended the run; None if the run finished.
            error: That exception.
            trace: Its traceback.

        Raises:
            LogFailed: A file cannot be written any more, as on a full disk.
        """
        with self._failing():
            super().__exit__(kind, error, trace)

    @contextmanager
    def _failing(self) -> Iterator[None]:
        """Turn errors of the system into one that names the folder."""
        try:
            yield
        except OSError as error:
            raise self._failed(error) from error

    def _failed(self, error: OSError) -> LogFailed:
        """Return an error that names the folder and its reason in one line."""
        reason = os.strerror(error.errno) if error.errno else str(error)
        return LogFailed(f"the recording {self.folder} cannot be written: {reason}; what was written is kept")


def open_log(info: RunInfo, root: str | Path = LOGS, live: str | None = None) -> Log:
    """Make a log in a new folder root/<scenario>/<YYYYmmdd-HHMMSS>/.

    Args:
        info: The facts about the run.
        root: The folder of all logs; it is made if it does not exist.
        live: The address of a running viewer that gets the recording as well, if any.

    Returns:
        The log, to be entered as a context.

    Raises:
        InvalidValue: If the folder cannot be made or written to.
    """
    return Log(info, new_folder(Path(root) / (info.scenario.name or "run")), live)


def new_folder(parent: Path) -> Path:
    """Make a folder that is named by the present time, with an empty manifest in it.

    Args:
        parent: The folder to make it in; it is made if it does not exist.

    Returns:
        The new folder.

    Raises:
        InvalidValue: If the folder cannot be made or written to.
    """
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    for i in count(1):
        folder = parent / (stamp if i == 1 else f"{stamp}-{i}")
        try:
            folder.mkdir(parents=True)
            (folder / MANIFEST).touch()
        except FileExistsError as error:
            if folder.is_dir():
                continue
            raise InvalidValue(f"cannot make {folder}: {error.filename or parent} is a file") from error
        except OSError as error:
            raise InvalidValue(
                f"cannot write to the log folder {folder}: {error.strerror}; choose another one"
            ) from error
        return folder
    raise AssertionError("unreachable: the numbers do not end")
