"""The process that writes a log: it takes slots from a ring and appends them to an Arrow IPC file.

    python -c "…; from taskopt.log.writer import main; main()" RING PROCESS < instructions

It ends when the loop closes the log, or when its standard input ends, which the system sees to if the loop's
process dies. In both cases everything that the ring still has is written, so that a loop that is killed loses
nothing. If the writer itself is killed, what is missing is what the last `PERIOD` has brought.
"""

import json
import os
import select
import signal
import sys
from time import monotonic

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from taskopt.log.instructions import Instructions
from taskopt.log.ring import Counter, End, Ring
from taskopt.log.slots import NANOSECONDS, NUMBERS, PERIOD, Column

LOOK = 0.02  # [s] between two looks at the ring
NICENESS = 5  # the loop comes first where both want the same core


def schema_of(columns: list[Column], metadata: dict[str, str]) -> pa.Schema:
    """Return the schema of a log.

    Args:
        columns: Its columns.
        metadata: Text by key.

    Returns:
        The schema, with unit, names and description of each column as its metadata.
    """
    fields = []
    for column in columns:
        about = {"unit": column.unit, "about": column.about, "names": json.dumps(column.names)}
        fields.append(
            pa.field(
                column.name, _type(column), nullable=bool(column.when) or _is_text(column)
            ).with_metadata(about)
        )
    return pa.schema(fields, metadata=metadata)


def _is_text(column: Column) -> bool:
    """Return True for a column that is read from the text of a slot."""
    return column.field == "text"


def _type(column: Column) -> pa.DataType:
    """Return the type of a column."""
    if _is_text(column):
        return pa.list_(pa.string()) if column.listed else pa.string()
    if column.words:
        return pa.string()
    kinds = {"float": pa.float64(), "number": pa.int64(), "flag": pa.bool_(), "state": pa.int8()}
    kind = kinds[_kind(column)]
    if not column.listed:
        return kind
    return pa.list_(kind) if column.when else pa.list_(kind, column.stop - column.start)


def _kind(column: Column) -> str:
    """Return the kind of the values of a column."""
    if column.field in ("state", "memory", "damped_state", "damped_memory"):
        return "state"
    if column.field in ("numbers", "ranks"):
        return "flag" if column.unit == "flag" else "number"
    return "float"


class Rows:
    """Turns slots into record batches.

    Args:
        instructions: Fields and columns.
        schema: Schema of the file.
    """

    def __init__(self, instructions: Instructions, schema: pa.Schema) -> None:
        self._instructions, self._schema = instructions, schema

    def batch(self, slots: dict[str, NDArray[np.generic]]) -> pa.RecordBatch:
        """Return slots as a batch of rows.

        Args:
            slots: Copies of the fields, (k, size) each, by name.

        Returns:
            k rows.
        """
        numbers, text = slots["numbers"], slots["text"]
        lengths = numbers[:, NUMBERS.index("text")].astype(np.int64).tolist()
        told = [
            json.loads(row[:length].tobytes()) if length else {}
            for row, length in zip(text, lengths, strict=True)
        ]
        arrays = []
        for column, field in zip(self._instructions.columns, self._schema, strict=True):
            if _is_text(column):
                arrays.append(pa.array([row.get(column.name) for row in told], field.type))
            else:
                values = slots[column.field][:, column.start : column.stop]
                valid = numbers[:, NUMBERS.index(column.when)] != 0 if column.when else None
                arrays.append(_array(column, values, valid, field.type))
        return pa.RecordBatch.from_arrays(arrays, schema=self._schema)


def _array(
    column: Column, values: NDArray[np.generic], valid: NDArray[np.bool_] | None, kind: pa.DataType
) -> pa.Array:
    """Return the values (k, m) of a column as an Arrow array."""
    if column.words:
        chosen = np.array(column.words, dtype=object)[values[:, 0].astype(np.int64)]
        return pa.array(chosen, pa.string())
    if not column.listed:
        flat = values[:, 0] != 0 if pa.types.is_boolean(kind) else values[:, 0]
        return pa.array(np.ascontiguousarray(flat), kind, mask=None if valid is None else ~valid)
    if valid is None:
        flat = pa.array(np.ascontiguousarray(values).ravel(), kind.value_type)
        return pa.FixedSizeListArray.from_arrays(flat, type=kind)
    lengths = np.where(valid, values.shape[1], 0)
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
    flat = pa.array(np.ascontiguousarray(values[valid]).ravel(), kind.value_type)
    return pa.ListArray.from_arrays(pa.array(offsets), flat, type=kind, mask=pa.array(~valid))


class Writer:
    """Writes the slots of a ring to a file until the ring is closed or its loop has died.

    Args:
        ring: The ring.
        instructions: What to write, and where.
        parent: Number of the process of the loop.
    """

    def __init__(self, ring: Ring, instructions: Instructions, parent: int) -> None:
        self._ring, self._instructions, self._parent = ring, instructions, parent
        schema = schema_of(instructions.columns, instructions.metadata)
        self._rows = Rows(instructions, schema)
        self._file = pa.OSFile(instructions.path, "wb")
        options = pa.ipc.IpcWriteOptions(compression="zstd")
        self._writer = pa.ipc.new_file(self._file, schema, options=options)
        # Arrow writes the schema with the first batch; the file is to be readable from now on.
        self._writer.write_batch(pa.RecordBatch.from_pylist([], schema=schema))
        self._seen = 0  # slots that were counted at the look before
        self._schema = schema

    def follow(self) -> None:
        """Append slots as they come, and close the file."""
        counters, due = self._ring.counters, monotonic() + PERIOD
        while self._loop_lives() and not counters[Counter.CLOSED]:
            seen, full = self._seen, self._pending() > self._ring.slots // 4
            self._seen = int(counters[Counter.WRITTEN])
            if monotonic() >= due or full:
                self._append(seen)
                due = monotonic() + PERIOD
        self._append(int(counters[Counter.WRITTEN]))
        self._close()

    def _loop_lives(self) -> bool:
        """Wait for `LOOK`, and return False if the process of the loop has ended."""
        ended = select.select([sys.stdin], [], [], LOOK)[0] and not os.read(sys.stdin.fileno(), 1)
        return not ended and os.getppid() == self._parent  # a fork of the loop may hold the pipe open

    def _pending(self) -> int:
        """Return how many slots may be written."""
        return self._seen - int(self._ring.counters[Counter.CONSUMED])

    def _append(self, stop: int) -> None:
        """Write the slots up to a count as one batch, and free them."""
        ring, start = self._ring, int(self._ring.counters[Counter.CONSUMED])
        if stop > start:
            places = np.arange(start, stop) % ring.slots
            batch = self._rows.batch({name: field[places] for name, field in ring.fields.items()})
            self._writer.write_batch(batch)
            ring.counters[Counter.CONSUMED] = stop

    def _close(self) -> None:
        """Write an empty batch that says how the log ended, then the footer."""
        counters = self._ring.counters
        told = {
            "end": End(int(counters[Counter.CLOSED])).name.lower(),
            "rows": int(counters[Counter.CONSUMED]),
            "waits": int(counters[Counter.WAITS]),
            "waited_s": int(counters[Counter.WAITED]) / NANOSECONDS,
            "message": self._ring.message,
        }
        empty = pa.RecordBatch.from_pylist([], schema=self._schema)
        self._writer.write_batch(empty, custom_metadata={"taskopt.end": json.dumps(told)})
        self._writer.close()
        self._file.close()


def main() -> None:
    """Write the log of the ring whose descriptor is the first argument; the second is the loop's process."""
    for number in (
        signal.SIGINT,
        signal.SIGTERM,
        signal.SIGHUP,
    ):  # they are for the loop, which closes the log
        signal.signal(number, signal.SIG_IGN)
    os.nice(NICENESS)
    instructions = Instructions.read(sys.stdin.readline())
    ring = Ring(instructions.fields, int(sys.argv[1]))
    try:
        writer = Writer(ring, instructions, int(sys.argv[2]))
        ring.counters[Counter.READY] = 1
        writer.follow()
    except OSError as error:
        ring.tell(Counter.FAILED, 1, os.strerror(error.errno) if error.errno else str(error))
        os._exit(1)  # closing the file would only fail again, with a traceback
