"""The log of a run: a folder with recording, table and manifest."""

from datetime import datetime
from itertools import count
from pathlib import Path

from taskopt.errors import InvalidValue
from taskopt.record.manifest import FILE as MANIFEST
from taskopt.record.manifest import ManifestSink
from taskopt.record.reading import LOGS, RECORDING
from taskopt.record.recorder import Gatherer, RunInfo
from taskopt.record.table import FILE as TABLE
from taskopt.record.table import TableSink
from taskopt.record.viewer.sink import StreamSink


class Log(Gatherer):
    """Recorder of a run into its `folder`; use it as a context, and `write` every step."""

    def __init__(self, info: RunInfo, folder: Path, live: str | None = None) -> None:
        self.folder = folder
        sinks = (
            ManifestSink(folder / MANIFEST),
            TableSink(folder / TABLE),
            StreamSink(folder / RECORDING, live),
        )
        super().__init__(info, sinks)


def open_log(info: RunInfo, root: str | Path = LOGS, live: str | None = None) -> Log:
    """A log in a new folder root/<scenario>/<YYYYmmdd-HHMMSS>/; `live`: address of a viewer as well.

    Raises `InvalidValue` if the folder cannot be made or written to.
    """
    return Log(info, new_folder(Path(root) / (info.scenario.name or "run")), live)


def new_folder(parent: Path) -> Path:
    """A folder named by the time, that nobody else has."""
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
