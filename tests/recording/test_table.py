"""The table: what was written comes back, whole or cut off; damage is named."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.errors import BadLog, MissingFile
from taskopt.recording.reading import newest_log, read_manifest, read_table
from taskopt.recording.recorder import BufferedRecorder
from taskopt.recording.table import TableSink


@pytest.fixture(scope="module")
def table_file(tmp_path_factory, info, steps):
    """A table of several batches."""
    file = tmp_path_factory.mktemp("table") / "steps.arrows"
    log = BufferedRecorder(info, [TableSink(file)])
    with log:
        for i, step in enumerate(steps["active-set"]):
            log.write(step)
            if i % 40 == 39:
                log.flush()
    return file


def test_the_table_is_the_run(folder, steps):
    """Every row equals its step, to the last bit."""
    rows = read_table(folder).to_pylist()
    assert len(rows) == sum(map(len, steps.values()))
    for row in rows:
        step = steps[row["resolver"]][row["tick"]]
        assert row["t"] == step.t
        assert row["q"] == step.q.tolist()
        assert row["q_next"] == step.q_next.tolist()
        assert row["v"] == step.v.tolist()
        assert row["error/tip position"] == step.errors["tip position"].tolist()
        assert row["claimed"] == step.resolution.claimed
        assert row["verdict"] == step.resolution.certificate.verdict.name
        assert row["error_bound"] == step.resolution.certificate.error_bound.tolist()
        assert row["kkt_residual"] == step.resolution.certificate.worst
        assert row["nothing_binds"] == step.nothing_binds
        assert row["status"] == step.resolution.status.name
        assert row["causes"] == [str(cause) for cause in step.resolution.review.causes]
        assert row["ranks"] == [level.rank for level in step.resolution.review.levels]
        assert row["seconds"] == step.seconds
        assert len(row["active"]) == len(row["multiplier"])


def test_the_table_has_the_limits_that_bind_and_that_break(folder):
    """The optimiser is held by its velocity limit and keeps it; the closed form is not, and does not."""
    table = read_table(folder).to_pylist()
    bound = {name for row in table if row["resolver"] == "active-set" for name in row["active"]}
    assert any("joint_velocity" in name for name in bound)
    worst = {
        name: max(row["velocity_violation"] for row in table if row["resolver"] == name)
        for name in ("active-set", "pinv")
    }
    assert worst["active-set"] <= 1e-9 < 0.05 < worst["pinv"]


@given(share=st.floats(0.0, 1.0))
def test_a_table_cut_off_anywhere_gives_back_its_whole_batches(table_file, tmp_path_factory, share):
    """Whatever a kill leaves: a prefix of the rows, or the message that not one batch is whole."""
    whole = read_table(table_file)
    data = table_file.read_bytes()
    cut = tmp_path_factory.mktemp("cut") / "steps.arrows"
    cut.write_bytes(data[: int(share * len(data))])
    first_batch = data.index(b"\xff\xff\xff\xff", len(data) // 3)  # about 40 of 150 rows
    rows = whole.slice(0, 0)
    try:
        rows = read_table(cut)
    except BadLog:
        assert cut.stat().st_size < first_batch
    assert rows.equals(whole.slice(0, rows.num_rows))


def test_losing_the_last_byte_of_a_batch_loses_that_batch_only(table_file, tmp_path):
    """All batches but the torn one are there."""
    import pyarrow as pa

    data = table_file.read_bytes()
    with pa.OSFile(str(table_file)) as source:
        batches = list(pa.ipc.open_stream(source))
    torn = tmp_path / "steps.arrows"
    torn.write_bytes(data[:-9])  # the end mark has 8 bytes
    assert read_table(torn).num_rows == sum(batch.num_rows for batch in batches[:-1])


def test_damage_before_the_end_is_named(table_file, tmp_path):
    """Overwritten bytes in the middle are an error that says how much is whole."""
    data = bytearray(table_file.read_bytes())
    middle = len(data) // 2
    start = data.find(b"\xff\xff\xff\xff", middle)
    data[start : start + 400] = b"\x13" * 400
    bad = tmp_path / "steps.arrows"
    bad.write_bytes(bytes(data))
    with pytest.raises(BadLog, match="damaged after"):
        read_table(bad)


@pytest.mark.parametrize("content", [b"", b"PAR1 something else entirely" * 20])
def test_what_is_no_table_is_refused(tmp_path, content):
    """Empty files and other files are a BadLog, not a crash."""
    file = tmp_path / "steps.arrows"
    file.write_bytes(content)
    with pytest.raises(BadLog):
        read_table(file)


def test_missing_logs_say_what_to_do(tmp_path):
    """A missing table, manifest or log folder names the place."""
    with pytest.raises(MissingFile, match=r"steps\.arrows"):
        read_table(tmp_path)
    with pytest.raises(MissingFile, match=r"manifest\.json"):
        read_manifest(tmp_path)
    with pytest.raises(MissingFile, match="taskopt run"):
        newest_log(tmp_path)
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(BadLog, match="not a manifest"):
        read_manifest(tmp_path)


def test_the_newest_log_is_the_last_one_written(tmp_path):
    """By time of its manifest, at any depth."""
    import os

    for i, name in enumerate(["b/2", "a/1", "c/3"]):
        place = tmp_path / name
        place.mkdir(parents=True)
        (place / "manifest.json").write_text(json.dumps({}))
        os.utime(place / "manifest.json", ns=(0, [10, 30, 20][i]))
    assert newest_log(tmp_path) == tmp_path / "a/1"
    assert newest_log(tmp_path / "c") == tmp_path / "c/3"


def test_lists_keep_their_lengths(folder, scenario):
    """q and v have nq and nv numbers in each row."""
    table = read_table(folder)
    lengths = {len(row) for row in table.column("q").to_pylist()}
    assert lengths == {scenario.robot.nq}
    np.testing.assert_array_equal(np.sort(np.unique(table.column("tick"))), np.arange(scenario.ticks))
