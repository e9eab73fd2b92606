"""Reading of logs as data; nothing in a log is ever executed."""

import json
from pathlib import Path

import pyarrow as pa

from taskopt.errors import BadLog, MissingFile
from taskopt.log.provenance import Json
from taskopt.recording.manifest import FILE as MANIFEST
from taskopt.recording.table import FILE as TABLE

LOGS = Path("logs")
RECORDING = "run.rrd"
_MESSAGE = b"\xff\xff\xff\xff"  # the first bytes of each message of an Arrow stream


def read_table(path: str | Path) -> pa.Table:
    """Read the steps of a run; if the run was killed, all complete batches of the file are returned.

    Args:
        path: A log folder, or the table in it.

    Returns:
        One row for each tick and resolver; `TableSink` describes the columns.

    Raises:
        MissingFile: If there is no table at the path.
        BadLog: If the file is not a table, has no whole batch, or is damaged before its end.
    """
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
            if not batches or not _is_cut_off(source, start):
                rows = sum(batch.num_rows for batch in batches)
                raise BadLog(
                    f"{file} is damaged after {rows} whole rows ({start} of {source.size()} bytes): {error}"
                ) from error
        return pa.Table.from_batches(batches, reader.schema)


def _is_cut_off(source: pa.NativeFile, start: int) -> bool:
    """Return True if the file ends within the message at byte `start`, which is intact up to there."""
    reached = source.tell()
    mark = source.read_at(4, start)
    return reached >= source.size() and mark == _MESSAGE[: len(mark)]


def read_manifest(folder: str | Path) -> dict[str, Json]:
    """Read the manifest of a log.

    Args:
        folder: The log folder.

    Returns:
        The content as `manifest` made it, with "status" and "ticks" of each resolver.

    Raises:
        MissingFile: If the folder has no manifest.
        BadLog: If the manifest is not JSON.
    """
    file = Path(folder) / MANIFEST
    if not file.is_file():
        raise MissingFile(f"no manifest at {file}; a log folder holds {MANIFEST}")
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise BadLog(f"{file} is not a manifest: {error}") from error


def newest_log(folder: str | Path = LOGS) -> Path:
    """Find the log folder that was written last.

    Args:
        folder: The folder of all logs, of one scenario's logs, or a log itself.

    Returns:
        The log folder with the newest manifest, at any depth.

    Raises:
        MissingFile: If there is no log.
    """
    logs = [file.parent for file in Path(folder).rglob(MANIFEST)]
    if not logs:
        raise MissingFile(f"no log under {folder}; make one with: taskopt run tasks/planar_circle.py")
    return max(logs, key=lambda log: (log / MANIFEST).stat().st_mtime_ns)


def find_recording(path: str | Path = LOGS) -> Path:
    """Find the Rerun recording at a path.

    Args:
        path: A recording, the folder of a log, or a folder of logs, of which the newest is taken.

    Returns:
        The recording.

    Raises:
        MissingFile: If the path does not exist, holds no log, or its newest log has no recording.
    """
    given = Path(path)
    if given.is_file():
        return given
    if not given.exists():
        raise MissingFile(f"no recording or log folder at {given}; make one with: taskopt run SCENARIO")
    file = newest_log(given) / RECORDING
    if not file.is_file():
        raise MissingFile(f"the log {file.parent} has no {RECORDING}: its run ended before the first step")
    return file
