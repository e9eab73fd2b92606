"""Recordings read back, row by row: the oracle of what was written."""

import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from taskopt.loop.run import Step
from taskopt.recording.recorder import BufferedRecorder
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.sink import RecordingSink


def batches(file: Path, path: str = "/**") -> Iterator[Any]:
    """Arrow batches of the entities that a path pattern names."""
    from rerun.chunk import RrdReader

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a file whose run was killed, or goes on, has no footer
        reader = RrdReader(str(file))
    for chunk in reader.stream().filter(content=path):
        yield chunk.to_record_batch()


def rows_of(file: Path, path: str) -> dict[str, list[Any]]:
    """Rows of one entity in order of ticks, a list for each component and timeline; static ones left out."""
    columns: dict[str, list[Any]] = {}
    for batch in batches(file, path):
        if "tick" not in batch.schema.names:
            continue
        for name in batch.schema.names[1:]:
            values = batch.column(name)
            numbers = values.cast("int64").to_pylist() if name in ("sim_time", "tick") else values.to_pylist()
            columns.setdefault(name.split(":")[-1], []).extend(numbers)
    order = np.argsort(columns.get("tick", []), kind="stable")
    return {name: [column[i] for i in order] for name, column in columns.items()}


def entities(file: Path) -> set[str]:
    """Paths of all entities."""
    key = b"rerun:entity_path"
    return {batch.schema.metadata[key].decode() for batch in batches(file)}


def layout_words(file: Path) -> set[str]:
    """Every text of the layout that stands in a recording: names of views among them."""
    from rerun.chunk import RrdReader

    reader = RrdReader(str(file))
    words: set[str] = set()
    for store in reader.blueprints():
        for chunk in reader.stream(store=store):
            batch = chunk.to_record_batch()
            for column in batch.columns:
                if str(column.type) == "list<item: string>":
                    words |= {word for row in column.to_pylist() for word in row or ()}
    return words


def written_in_pieces(info: RunInfo, steps: Sequence[Step], folder: Path) -> list[Path]:
    """The same run recorded in batches of 7 ticks, and in one."""
    files = []
    for size in (7, 1000):
        file = folder / str(size) / "run.rrd"
        file.parent.mkdir()
        log = BufferedRecorder(info, [RecordingSink(file)])
        with log:
            for k, step in enumerate(steps):
                log.write(step)
                if k % size == size - 1:
                    log.flush()
        files.append(file)
    return files
