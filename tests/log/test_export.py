"""A log as a table: what other programs read is what the log has."""

import json

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest

from taskopt.errors import InvalidValue, UnknownName
from taskopt.log.export import export
from tests.log.test_story import command


@pytest.mark.slow
def test_parquet_is_the_same_table(logged, tmp_path):
    """A Parquet file has every value, and the metadata with names and units."""
    log = logged("damped").log
    command("export", log.path, tmp_path / "a.parquet")
    table = pyarrow.parquet.read_table(tmp_path / "a.parquet")
    assert table.equals(log.table())
    assert json.loads(table.schema.metadata[b"taskopt"]) == log.facts
    assert table.schema.field("q").metadata[b"unit"] == b"rad"


def test_text_has_a_column_for_each_number(logged, tmp_path):
    """A CSV file has named columns with the same numbers to the last bit, and empty fields for no value."""
    log = logged("damped").log
    table = pyarrow.csv.read_csv(export(log, tmp_path / "a.csv"))
    assert {"t", "q/joint1", "x/joint3", "state/hand/x", "A/0"} <= set(table.column_names)
    x = np.column_stack([table[f"x/joint{i}"].to_numpy() for i in (1, 2, 3)])
    assert np.array_equal(x, log.array("x"))
    damped = np.array([value is not None for value in log.array("damped")])
    assert table["damped/0"].is_valid().to_pylist() == damped.tolist()
    assert 0 < damped.sum() < len(damped)


def test_columns_can_be_chosen(logged, tmp_path):
    """Only the columns that are asked for are written, and unknown ones are refused by name."""
    log = logged("active-set").log
    command("export", log.path, tmp_path / "a.csv", "--columns", "t,error/hand")
    assert pyarrow.csv.read_csv(tmp_path / "a.csv").column_names == ["t", "error/hand/x", "error/hand/y"]
    with pytest.raises(UnknownName, match="error/hand"):
        export(log, tmp_path / "a.csv", ["error/hnd"])
    with pytest.raises(InvalidValue, match=r"\.csv or \.parquet"):
        export(log, tmp_path / "a.xlsx")
    with pytest.raises(InvalidValue, match="cannot write"):
        export(log, tmp_path / "no folder" / "a.csv")


def test_pandas_opens_a_log(logged):
    """pandas reads the closed file by its ordinary reader."""
    pandas = pytest.importorskip("pandas")
    log = logged("damped").log
    frame = pandas.read_feather(log.path)
    assert np.array_equal(np.stack(frame["x"].to_list()), log.array("x"))
    assert frame["t"].tolist() == log.t.tolist()


def test_polars_opens_a_log(logged):
    """polars reads the closed file by its ordinary reader."""
    polars = pytest.importorskip("polars")
    log = logged("damped").log
    frame = polars.read_ipc(log.path)
    assert np.array_equal(frame["x"].to_numpy(), log.array("x"))
    assert frame["resolver"].to_list() == log.array("resolver").tolist()


def test_duckdb_reads_a_log_through_arrow_and_as_parquet(logged, tmp_path):
    """DuckDB answers a question about a log from an Arrow table, and from an exported file."""
    duckdb = pytest.importorskip("duckdb")
    log = logged("active-set").log
    held = log.table()  # DuckDB finds it by its name
    asked = "SELECT count(*), max(x[1]) FROM {} WHERE t > 0.1"
    expected = (int((log.t > 0.1).sum()), log.array("x")[log.t > 0.1, 0].max())
    assert held.num_rows == len(log)
    assert duckdb.sql(asked.format("held")).fetchall() == [expected]
    path = export(log, tmp_path / "a.parquet")
    assert duckdb.sql(asked.format(f"'{path}'")).fetchall() == [expected]
