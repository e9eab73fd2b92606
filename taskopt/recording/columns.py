"""Plain tables as Parquet files."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq


def write_parquet(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Write a table of columns of words, numbers or truth values.

    Args:
        path: The file.
        columns: Columns by name, each (rows,).
    """
    pq.write_table(pa.table({name: pa.array(column.tolist()) for name, column in columns.items()}), path)


def read_parquet(path: Path) -> dict[str, np.ndarray]:
    """Read a table that `write_parquet` wrote.

    Args:
        path: The file.

    Returns:
        Columns by name, each (rows,); words as objects.
    """
    table = pq.read_table(path)
    return {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}
