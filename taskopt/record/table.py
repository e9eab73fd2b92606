"""The steps of a run as a table: an Arrow IPC stream, one row per tick and resolver.

A stream, because every batch in it can be read back after a kill; a Parquet file without its footer
cannot be opened at all.
"""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from taskopt.arrays import Array
from taskopt.record.batch import Batch
from taskopt.record.recorder import RunInfo
from taskopt.record.violation import LimitGauge

if TYPE_CHECKING:
    import pyarrow as pa

FILE = "steps.arrows"


class TableSink:
    """Writes batches to an Arrow IPC stream, unbuffered.

    Columns: tick, t [s], resolver, status, claimed, certified, free (no row binds), q, q_next, v,
    error/<task>, residual/<task>, position_violation, velocity_violation, active (names),
    multiplier (one an active row), certificate, iterations, seconds, build_seconds, twin_distance,
    accurate, causes (of that distance), ranks and damping (k², one a level, the hard rows first),
    distance/<limit> (the least, [m]), nearest/<limit> (of which pair).
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def open(self, info: RunInfo) -> None:
        import pyarrow as pa

        self._gauge = LimitGauge(info)
        self._file = pa.OSFile(str(self.path), "wb")
        self._writer: pa.ipc.RecordBatchStreamWriter | None = None

    def take(self, batch: Batch) -> None:
        import pyarrow as pa

        columns = self._columns(batch)
        rows = pa.RecordBatch.from_arrays(list(columns.values()), names=list(columns))
        writer = self._writer = self._writer or pa.ipc.new_stream(self._file, rows.schema)
        writer.write_batch(rows)

    def close(self, status: str) -> None:  # noqa: ARG002 (protocol)
        if self._writer is not None:
            self._writer.close()
        self._file.close()

    def _columns(self, batch: Batch) -> dict[str, "pa.Array"]:
        import pyarrow as pa

        active, multiplier = _active(batch)
        answers = [step.resolution for step in batch.steps]
        errors = {f"error/{task}": _lists(batch.error(task)) for task in batch.task_names}
        residuals = {
            f"residual/{block.name}": pa.array(batch.residual(block.name))
            for block in batch.layout.blocks
            if block.level > 0
        }
        return {
            "tick": pa.array(batch.index),
            "t": pa.array(batch.t),
            "resolver": pa.array([batch.resolver] * len(answers)),
            "status": pa.array([answer.status.name for answer in answers]),
            "claimed": pa.array(batch.claimed),
            "certified": pa.array(batch.certified),
            "free": pa.array([step.nothing_binds for step in batch.steps]),
            "q": _lists(batch.q),
            "q_next": _lists(batch.q_next),
            "v": _lists(batch.v),
            **errors,
            **residuals,
            "position_violation": pa.array(self._gauge.position_violation(batch)),
            "velocity_violation": pa.array(self._gauge.velocity_violation(batch)),
            "active": active,
            "multiplier": multiplier,
            "certificate": pa.array(batch.worst),
            "iterations": pa.array([answer.iterations for answer in answers], pa.int64()),
            "seconds": pa.array(batch.seconds),
            "build_seconds": pa.array(batch.build_seconds),
            "twin_distance": pa.array(batch.twin_distance),
            **_second_look(batch),
            **_nearness(batch),
        }


def _second_look(batch: Batch) -> dict[str, "pa.Array"]:
    """How accurate the answers are, what was decided on the way, and why they are not the closed form."""
    import pyarrow as pa

    words, ranks, damping = pa.list_(pa.string()), pa.list_(pa.int64()), pa.list_(pa.float64())
    return {
        "accurate": pa.array(batch.accurate),
        "causes": pa.array([list(map(str, tick)) for tick in batch.causes], words),
        "ranks": pa.array([[level.rank for level in tick] for tick in batch.levels], ranks),
        "damping": pa.array([[level.damping for level in tick] for tick in batch.levels], damping),
    }


def _nearness(batch: Batch) -> dict[str, "pa.Array"]:
    """The least distance of each limit that keeps any [m], and the pair that it is between."""
    import pyarrow as pa

    columns = {}
    for limit in batch.distance_limits:
        distance = batch.distance(limit)
        columns[f"distance/{limit}"] = pa.array(distance.min(axis=1))
        columns[f"nearest/{limit}"] = pa.array(np.array(batch.pairs(limit))[distance.argmin(axis=1)])
    return columns


def _lists(rows: Array) -> "pa.Array":
    """(k, m) as a column of k lists."""
    import pyarrow as pa

    offsets = np.arange(len(rows) + 1, dtype=np.int32) * rows.shape[1]
    return pa.ListArray.from_arrays(offsets, np.ascontiguousarray(rows).ravel())


def _active(batch: Batch) -> tuple["pa.Array", "pa.Array"]:
    """Names of the active limits and inequalities of each tick, and their multipliers."""
    import pyarrow as pa

    code = batch.active_code
    ticks, rows = np.nonzero(code)
    offsets = np.searchsorted(ticks, np.arange(len(code) + 1)).astype(np.int32)
    known: dict[tuple[int, int], str] = {}
    pairs = list(zip(rows.tolist(), code[ticks, rows].tolist(), strict=True))
    for pair in set(pairs):
        known[pair] = batch.active_name(*pair)
    names = pa.array([known[pair] for pair in pairs], pa.string())
    return (
        pa.ListArray.from_arrays(offsets, names),
        pa.ListArray.from_arrays(offsets, batch.price[ticks, rows]),
    )
