"""A log as a table that other programs read: Parquet, or text with one column for each number."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from taskopt.errors import InvalidValue, UnknownName
from taskopt.log.reading import Log

FORMATS = (".csv", ".parquet")


def export(log: Log, path: str | Path, columns: Sequence[str] = ()) -> Path:
    """Write a log as a table, in the format that the name of the file ends with.

    Parquet keeps lists as they are, and the metadata of the log. CSV has a column for each entry of a list,
    such as "q/joint1" or, where entries have no names, "A/0"; a row without a value has an empty field.

    Args:
        log: The log.
        path: The file, which ends in .csv or .parquet; one that exists is replaced.
        columns: Names of the columns to write; empty for all.

    Returns:
        The file.

    Raises:
        InvalidValue: The name ends in something else, or the file cannot be written.
        UnknownName: There is no such column.
    """
    place = Path(path)
    if place.suffix not in FORMATS:
        raise InvalidValue(f"the name of a table must end in {' or '.join(FORMATS)}, got {place.name!r}")
    for name in columns:
        if name not in log.columns:
            raise UnknownName("column", name, log.columns)
    table = log.table().select(list(columns)) if columns else log.table()
    try:
        if place.suffix == ".parquet":
            pyarrow.parquet.write_table(table, place, compression="zstd")
        else:
            pyarrow.csv.write_csv(_flat(log, table), place)
    except OSError as error:
        raise InvalidValue(f"cannot write {place}: {error.strerror or error}; choose another file") from error
    return place


def _flat(log: Log, table: pa.Table) -> pa.Table:
    """Return a table whose lists are spread over columns, and whose sentences are one text."""
    parts = [part for name in table.column_names for part in _spread(log, name, table.column(name))]
    return pa.table([values for _, values in parts], names=[name for name, _ in parts])


def _spread(log: Log, name: str, values: pa.ChunkedArray) -> Iterator[tuple[str, pa.Array]]:
    """Yield the columns of one column."""
    kind = values.type
    if not (pa.types.is_list(kind) or pa.types.is_fixed_size_list(kind)):
        yield name, values
        return
    rows = values.to_pylist()
    if pa.types.is_string(kind.value_type):
        texts = [None if row is None else json.dumps(row, ensure_ascii=False) for row in rows]
        yield name, pa.array(texts, pa.string())
        return
    size = max((len(row) for row in rows if row is not None), default=0)
    names = log.names(name) if len(log.names(name)) == size else tuple(map(str, range(size)))
    for i, entry in enumerate(names):
        yield f"{name}/{entry}", pa.array([None if row is None else row[i] for row in rows], kind.value_type)
