"""The batches of rows of an Arrow file, of one that was cut off as far as they go."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from taskopt.errors import BadLog

_MAGIC = b"ARROW1\0\0"  # the first bytes of an Arrow file; what follows is a stream
END = b"taskopt.end"  # key of the metadata of the last batch


class Batches:
    """The batches of a file, read when they are needed; those of a file without footer are kept in memory.

    Args:
        path: The file.

    Attributes:
        schema: Schema of the file.
        sizes: Number of rows of each batch.
        end: How the log ended, as the last batch says it, as JSON; None if it does not say it.
        cut: Number of bytes after the last whole batch, if the file was cut off; None if it is whole.

    Raises:
        BadLog: The file is not an Arrow file, or was cut off before its schema.
    """

    def __init__(self, path: Path) -> None:
        self._path, self.end, self.cut = path, None, None
        self._kept: list[pa.RecordBatch] = []
        self._source = pa.memory_map(str(path)) if path.stat().st_size else pa.BufferReader(b"")
        if self._source.read_at(len(_MAGIC), 0) != _MAGIC:
            raise BadLog(f"{path} is no log: it does not begin as an Arrow file does")
        try:
            self._reader: pa.RecordBatchFileReader | None = self._open()
        except pa.ArrowInvalid:  # without its footer
            self._reader = None
            self._salvage()
        else:
            self.schema: pa.Schema = self._reader.schema
            count = self._reader.num_record_batches
            self.sizes = [len(batch) for batch in self._each("tick")]
            if count:
                self.end = (self._reader.get_batch_with_custom_metadata(count - 1)[1] or {}).get(END)

    def batch(self, index: int) -> pa.RecordBatch:
        """Return one batch.

        Args:
            index: Its number.

        Returns:
            The batch with all columns.
        """
        return self._kept[index] if self._reader is None else self._reader.get_batch(index)

    def column(self, name: str) -> NDArray[Any]:
        """Return a column of all batches as an array.

        Args:
            name: Name of the column.

        Returns:
            (k,), or (k, m) for a column of lists of one length; objects where rows may have no value.
        """
        parts = [_values(batch.column(0)) for batch in self._each(name)]
        return np.concatenate(parts) if parts else np.zeros(0)

    def table(self) -> pa.Table:
        """Return all rows as a table."""
        batches = [self.batch(index) for index in range(len(self.sizes))]
        return pa.Table.from_batches(batches, self.schema)

    def _open(self, column: int | None = None) -> pa.RecordBatchFileReader:
        """Open the file, for all columns or for one."""
        options = pa.ipc.IpcReadOptions(included_fields=None if column is None else [column])
        return pa.ipc.open_file(self._source, options=options)

    def _each(self, name: str) -> Iterator[pa.RecordBatch]:
        """Yield one column of each batch."""
        if self._reader is None:
            yield from (batch.select([name]) for batch in self._kept)
            return
        reader = self._open(self._reader.schema.get_field_index(name))
        yield from (reader.get_batch(index) for index in range(reader.num_record_batches))

    def _salvage(self) -> None:
        """Read the batches of a file without footer until the first one that is not whole."""
        whole = start = len(_MAGIC)
        self._source.seek(start)
        try:
            reader = pa.ipc.open_stream(self._source)
        except (pa.ArrowInvalid, OSError, EOFError) as error:
            raise BadLog(f"{self._path} was cut off before its first batch: {error}") from error
        self.schema, whole = reader.schema, self._source.tell()
        try:
            while True:
                batch, told = reader.read_next_batch_with_custom_metadata()
                batch.validate(full=True)
                self._kept.append(batch)
                self.end = (told or {}).get(END)
                whole = self._source.tell()
        except StopIteration:
            pass
        except (pa.ArrowInvalid, OSError, EOFError):
            pass  # the last batch is not whole; `cut` says so
        self.sizes = [len(batch) for batch in self._kept]
        self.cut = self._source.size() - whole


def _values(column: pa.Array) -> NDArray[Any]:
    """Return a column of one batch as an array."""
    if pa.types.is_fixed_size_list(column.type):
        size = column.type.list_size
        values = column.values.slice(column.offset * size, len(column) * size)
        return values.to_numpy(zero_copy_only=False).reshape(-1, size)
    if pa.types.is_list(column.type):
        values = np.empty(len(column), dtype=object)
        for i, value in enumerate(column):
            values[i] = value.as_py()
        return values
    return column.to_numpy(zero_copy_only=False)
