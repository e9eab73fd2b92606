"""Logs read back: data only, nothing in them is ever executed."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taskopt.errors import BadLog, MissingFile
from taskopt.record.manifest import FILE as MANIFEST
from taskopt.record.table import FILE as TABLE

if TYPE_CHECKING:
    import pyarrow as pa

LOGS = Path("logs")
RECORDING = "run.rrd"
_MESSAGE = b"\xff\xff\xff\xff"  # what each message of an Arrow stream begins with


def read_table(path: str | Path) -> "pa.Table":
    """The steps of a run: every whole batch of the file, also where the run was killed.

    `path` is a log folder or its table. Raises `MissingFile`, and `BadLog` for a file that is not a
    table or is damaged before its end.
    """
    import pyarrow as pa

    file = Path(path) / TABLE if Path(path).is_dir() else Path(path)
    if not file.is_file():
        raise MissingFile(f"no table at {file}; a log folder holds {TABLE}")
    if file.stat().st_size == 0:
        raise BadLog(f"{file} is empty: the run ended before its first batch")
    batches: list[pa.RecordBatch] = []
    with pa.OSFile(str(file)) as source:
        start = 0
        try:
            reader = pa.ipc.open_stream(source)
            start = source.tell()
            for batch in reader:
                batch.validate(full=True)
                batches.append(batch)
                start = source.tell()
        except (pa.ArrowInvalid, OSError) as error:
            if not batches or not _cut_off(source, start):
                rows = sum(batch.num_rows for batch in batches)
                raise BadLog(
                    f"{file} is damaged after {rows} whole rows ({start} of {source.size()} bytes): {error}"
                ) from error
        return pa.Table.from_batches(batches, reader.schema)


def _cut_off(source: "pa.NativeFile", start: int) -> bool:
    """Whether the message at `start` is a sound one that the end of the file cuts short."""
    tried = source.tell()
    mark = source.read_at(4, start)
    return tried >= source.size() and mark == _MESSAGE[: len(mark)]


def read_manifest(folder: str | Path) -> dict[str, Any]:
    """The manifest of a log folder. Raises `MissingFile`, and `BadLog` if it is not JSON."""
    file = Path(folder) / MANIFEST
    if not file.is_file():
        raise MissingFile(f"no manifest at {file}; a log folder holds {MANIFEST}")
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise BadLog(f"{file} is not a manifest: {error}") from error


def newest_log(folder: str | Path = LOGS) -> Path:
    """The newest log folder under `folder`, which may be logs/, one scenario's, or a log itself.

    Raises `MissingFile` if there is none.
    """
    place = Path(folder)
    found = [file.parent for file in place.rglob(MANIFEST)]
    if not found:
        raise MissingFile(f"no log under {place}; make one with: taskopt run tasks/planar_circle.py")
    return max(found, key=lambda log: (log / MANIFEST).stat().st_mtime_ns)


def recording(log: str | Path) -> Path:
    """The Rerun recording of a log folder, or the path itself if it is a recording."""
    file = Path(log) / RECORDING if Path(log).is_dir() else Path(log)
    if not file.is_file():
        raise MissingFile(f"no recording at {file}; a log folder holds {RECORDING}")
    return file
