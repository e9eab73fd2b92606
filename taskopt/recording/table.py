"""The table of a run: an Arrow IPC stream with one row for each tick and resolver.

A stream is used because all complete batches of it can be read back after a kill, while a Parquet file
without its footer cannot be opened at all.
"""

from pathlib import Path

import numpy as np
import pyarrow as pa

from taskopt.arrays import Array
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.violation import LimitGauge

FILE = "steps.arrows"


class TableSink:
    """Write batches to an Arrow IPC stream, unbuffered.

    Columns, with one value in each row unless they are called lists:

    - tick; t [s]; resolver; status (`Status`); claimed: True if it claims an optimum; nothing_binds:
      True if the closed-form answer keeps every bound and inequality.
    - q, q_next: lists (nq,) [rad, m]; v: list (nv,) [rad/s, m/s]; at order 2 v is that after the step,
      and a: list (nv,) [rad/s², m/s²] is the answer.
    - error/<task>: list, e = x_d − x; residual/<task>: 2-norm of the residuals of the task's rows.
    - position_violation [rad, m], velocity_violation [rad/s, m/s]: largest excess over a limit.
    - active: list of names of active bounds and inequalities; multiplier: list, one number for each of them.
    - verdict: PROVEN, PROVEN_IF, REFUTED, REFUTED_IF or UNDECIDED; error_bound: list (nv,), bounds on the
      errors of v, at order 2 of a, inf where nothing is known; both are null at ticks that are not judged.
    - kkt_residual: the largest; iterations; seconds, build_seconds [s]: time of the resolver, and of
      kinematics and rows.
    - closed_form_distance: largest difference of v, at order 2 of a, to the closed-form answer; causes: list
      of the reasons for it.
    - ranks, damping: lists, the rank and the damping k² of each level, hard rows first.
    - distance/<limit> [m]: least distance of a distance limit; nearest/<limit>: the pair that has it.
    """

    def __init__(self, path: Path) -> None:
        """Prepare a table, whose file `open` makes.

        Args:
            path: The file to write.
        """
        self.path = path

    def open(self, info: RunInfo) -> None:
        """Make the file; the schema is written with the first batch.

        Args:
            info: The facts about the run.
        """
        self._gauge = LimitGauge(info)
        self._file = pa.OSFile(str(self.path), "wb")
        self._writer: pa.ipc.RecordBatchStreamWriter | None = None

    def take(self, batch: Batch) -> None:
        """Append a batch.

        Args:
            batch: Consecutive steps of one resolver.
        """
        columns = {
            **_answer_columns(batch),
            **_task_columns(batch),
            **self._limit_columns(batch),
            **_proof_columns(batch),
            **_distance_columns(batch),
        }
        rows = pa.RecordBatch.from_arrays(list(columns.values()), names=list(columns))
        if self._writer is None:
            self._writer = pa.ipc.new_stream(self._file, rows.schema)
        self._writer.write_batch(rows)

    def close(self, status: str) -> None:  # noqa: ARG002 (protocol)
        """Write the end mark and close the file.

        Args:
            status: Not used; the manifest states it.
        """
        if self._writer is not None:
            self._writer.close()
        self._file.close()

    def _limit_columns(self, batch: Batch) -> dict[str, pa.Array]:
        """Return violations and active limits."""
        active, multiplier = _active_columns(batch)
        return {
            "position_violation": pa.array(self._gauge.position_violation(batch)),
            "velocity_violation": pa.array(self._gauge.velocity_violation(batch)),
            "active": active,
            "multiplier": multiplier,
        }


def _answer_columns(batch: Batch) -> dict[str, pa.Array]:
    """Return the tick, the resolver's claim, and the motion."""
    answers = [step.resolution for step in batch.steps]
    accelerations = {"a": _lists(batch.x)} if batch.layout.is_of_accelerations else {}
    return {
        "tick": pa.array(batch.index),
        "t": pa.array(batch.t),
        "resolver": pa.array([batch.resolver] * len(answers)),
        "status": pa.array([answer.status.name for answer in answers]),
        "claimed": pa.array(batch.claimed),
        "nothing_binds": pa.array([step.nothing_binds for step in batch.steps]),
        "q": _lists(batch.q),
        "q_next": _lists(batch.q_next),
        "v": _lists(batch.v),
        **accelerations,
    }


def _task_columns(batch: Batch) -> dict[str, pa.Array]:
    """Return error and residual of each task."""
    errors = {f"error/{task}": _lists(batch.error(task)) for task in batch.task_names}
    tasks = [block.name for block in batch.layout.blocks if block.level > 0]
    return errors | {f"residual/{task}": pa.array(batch.residual(task)) for task in tasks}


def _proof_columns(batch: Batch) -> dict[str, pa.Array]:
    """Return verdict, error bound, effort, and the comparison with the closed-form answer."""
    answers = [step.resolution for step in batch.steps]
    words, ranks, numbers = pa.list_(pa.string()), pa.list_(pa.int64()), pa.list_(pa.float64())
    verdicts = [None if verdict is None else verdict.name for verdict in batch.verdicts]
    pairs = zip(batch.judged, batch.error_bound, strict=True)
    return {
        "verdict": pa.array(verdicts, pa.string()),
        "error_bound": pa.array([bound if judged else None for judged, bound in pairs], numbers),
        "kkt_residual": pa.array(batch.kkt_residual),
        "iterations": pa.array([answer.iterations for answer in answers], pa.int64()),
        "seconds": pa.array(batch.seconds),
        "build_seconds": pa.array(batch.build_seconds),
        "closed_form_distance": pa.array(batch.closed_form_distance),
        "causes": pa.array([list(map(str, tick)) for tick in batch.causes], words),
        "ranks": pa.array([[level.rank for level in tick] for tick in batch.levels], ranks),
        "damping": pa.array([[level.damping for level in tick] for tick in batch.levels], numbers),
    }


def _distance_columns(batch: Batch) -> dict[str, pa.Array]:
    """Return the least distance [m] of each distance limit, and the pair that has it."""
    columns = {}
    for limit in batch.distance_limits:
        distance = batch.distance(limit)
        columns[f"distance/{limit}"] = pa.array(distance.min(axis=1))
        columns[f"nearest/{limit}"] = pa.array(np.array(batch.pairs(limit))[distance.argmin(axis=1)])
    return columns


def _lists(rows: Array) -> pa.Array:
    """Turn an array (k, m) into a column of k lists."""
    offsets = np.arange(len(rows) + 1, dtype=np.int32) * rows.shape[1]
    return pa.ListArray.from_arrays(offsets, np.ascontiguousarray(rows).ravel())


def _active_columns(batch: Batch) -> tuple[pa.Array, pa.Array]:
    """Return the names of the active bounds and inequalities of each tick, and their multipliers."""
    code = batch.active_code
    ticks, rows = np.nonzero(code)
    offsets = np.searchsorted(ticks, np.arange(len(code) + 1)).astype(np.int32)
    codes = list(zip(rows.tolist(), code[ticks, rows].tolist(), strict=True))
    name_of = {pair: batch.active_name(*pair) for pair in set(codes)}
    names = pa.array([name_of[pair] for pair in codes], pa.string())
    return (
        pa.ListArray.from_arrays(offsets, names),
        pa.ListArray.from_arrays(offsets, batch.multiplier[ticks, rows]),
    )
