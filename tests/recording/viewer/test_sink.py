"""The recording: what it shows is what happened, on clocks that join, with its layout inside."""

import numpy as np
import pytest

from taskopt.recording.batch import Batch
from taskopt.recording.viewer import blueprint as layout
from taskopt.recording.viewer.paths import closed_form_path, data_path
from taskopt.recording.viewer.plots import multiplier_lines
from taskopt.recording.viewer.sink import RecordingSink
from tests.helpers.rrd import batches, entities, layout_words, rows_of, written_in_pieces

NAMES = ("active-set", "wqp/daqp", "pinv")


@pytest.mark.parametrize("name", NAMES)
def test_q_and_v_are_recorded_at_every_tick_to_the_last_bit(folder, steps, name):
    """The series of the recording equal the steps, and their times are whole nanoseconds."""
    for key in ("q", "v"):
        rows = rows_of(folder / "run.rrd", data_path(name, key))
        assert rows["tick"] == [step.index for step in steps[name]]
        assert rows["sim_time"] == [round(step.t * 1e9) for step in steps[name]]
        np.testing.assert_array_equal(np.array(rows["scalars"]), [getattr(step, key) for step in steps[name]])


def test_errors_multipliers_and_distances_are_those_of_the_steps(folder, steps, info):
    """Task error, multipliers, KKT residual, error bound, distance to the closed form: each from its step."""
    file, own = folder / "run.rrd", steps["active-set"]
    batch = Batch(tuple(own))
    error = rows_of(file, data_path("active-set", "task", "tip position", "m"))["scalars"]
    np.testing.assert_allclose(
        np.ravel(error), [np.linalg.norm(step.errors["tip position"]) for step in own], rtol=1e-14
    )
    multiplier = np.array(rows_of(file, data_path("active-set", "multiplier"))["scalars"])
    np.testing.assert_array_equal(multiplier[:, :3], batch.multiplier[:, :3])
    assert list(multiplier_lines(info)) == ["joint1", "joint2", "joint3"]
    residual = np.ravel(rows_of(file, data_path("active-set", "kkt_residual"))["scalars"])
    np.testing.assert_allclose(10**residual, np.maximum(batch.kkt_residual, 1e-17), rtol=1e-12)
    proof = np.ravel(rows_of(file, data_path("active-set", "error_bound"))["scalars"])
    bound = (batch.error_bound / np.maximum(1.0, np.abs(batch.v))).max(axis=1)
    np.testing.assert_allclose(10**proof, np.maximum(bound, 1e-17), rtol=1e-12)
    distance = np.ravel(rows_of(file, closed_form_path("active-set"))["scalars"])
    np.testing.assert_allclose(10**distance, np.maximum(batch.closed_form_distance, 1e-17), rtol=1e-12)


def test_normalised_series_reach_one_exactly_at_a_limit(folder, steps):
    """v / 0.9 of the optimiser touches ±1 and never exceeds it; the closed form does."""
    largest = {
        name: np.abs(np.array(rows_of(folder / "run.rrd", data_path(name, "v_normalised"))["scalars"])).max()
        for name in ("active-set", "pinv")
    }
    assert largest["active-set"] == pytest.approx(1.0, abs=1e-9)
    assert largest["pinv"] > 1.05
    q = np.array(rows_of(folder / "run.rrd", data_path("pinv", "q_normalised"))["scalars"])
    np.testing.assert_allclose(q, [step.q / 3.0 for step in steps["pinv"]], atol=1e-15)


def test_the_timeline_replayed_give_the_active_set_of_every_tick(folder, steps):
    """From the changes alone, the state of each row at each tick is that of the resolution."""
    batch = Batch(tuple(steps["active-set"]))
    for row, joint in enumerate(("joint1", "joint2", "joint3")):
        rows = rows_of(folder / "run.rrd", data_path("active-set", "active", joint))
        changes = dict(zip(rows.get("tick", []), (state[0] for state in rows.get("state", [])), strict=True))
        state = "free"
        for k in batch.index.tolist():
            state = changes.get(k, state)
            assert state == batch.code_words(row, int(batch.active_code[k, row]))


def test_a_closed_form_that_breaks_a_limit_has_a_row_that_says_so(folder):
    """The rows of `pinv` show where it is over its velocity limit."""
    states = {
        state[0]
        for joint in ("joint1", "joint2", "joint3")
        for state in rows_of(folder / "run.rrd", data_path("pinv", "active", joint)).get("state", [])
    }
    assert any(state.startswith("over joint_velocity") for state in states)


def test_events_name_what_binds_and_what_breaks(folder):
    """The log has the limit that binds, by resolver, and the closed form's excess."""
    texts = [text[0] for text in rows_of(folder / "run.rrd", "/run/events")["text"]]
    assert any(text.startswith("active-set: joint_velocity/joint") and "is active" in text for text in texts)
    assert any(text == "pinv: a joint is over its velocity limit" for text in texts)
    assert not any(text.startswith("active-set: a joint") for text in texts)


def test_only_the_run_s_own_clocks_are_recorded(folder):
    """No wall-clock timeline, so that equal runs compare equal."""
    clocks = {
        name
        for batch in batches(folder / "run.rrd")
        for name in batch.schema.names
        if name.startswith(("log_", "sim", "tick"))
    }
    assert clocks == {"sim_time", "tick"}


def test_the_layout_shows_only_what_exists(folder, info, monkeypatch):
    """Every path that a plot asks for is an entity of the recording, or one that opens when it is needed."""
    asked: list[str] = []
    plain = layout.plot_view
    monkeypatch.setattr(
        layout, "plot_view", lambda name, paths, axis=None: (asked.extend(paths), plain(name, paths))[1]
    )
    sink = RecordingSink(folder / "unused.rrd")
    sink.open(info)
    sink.close("finished")
    assert len(asked) > 10
    assert set(asked) <= entities(folder / "run.rrd")


def test_the_layout_stands_in_the_file(folder):
    """Opening the file needs nothing else: it carries a blueprint with the views by name."""
    views = layout_words(folder / "run.rrd")
    assert {"Robots, one a resolver", "Summary", "Task error [m]", "Active set: active-set"} <= views


def test_the_summary_panel_ends_with_the_figures(folder, steps):
    """The last summary panel says finished, and how often a limit held the arm."""
    texts = [
        batch.column("TextDocument:text").to_pylist()[0][0]
        for batch in batches(folder / "run.rrd", "/run/summary")
        if "TextDocument:text" in batch.schema.names
    ]
    last = texts[-1]
    assert "finished" in last
    assert "**active-set**: joint_velocity/joint" in last
    assert "A short run." in last


@pytest.mark.slow
def test_batches_of_any_size_make_the_same_recording(info, steps, tmp_path):
    """Cutting a run into pieces changes neither a row nor a path segment."""
    files = written_in_pieces(info, steps["active-set"], tmp_path)
    for path in (
        data_path("active-set", "q"),
        data_path("active-set", "multiplier"),
        "/world/active-set/task/tip\\ position/actual",
        "/world/active-set/ellipsoid/force",
        "/world/active-set/ellipsoid/velocity",
        data_path("active-set", "active", "joint1"),
    ):
        one, other = (rows_of(file, path) for file in files)
        assert one.keys() == other.keys(), path
        assert one, path
        for component in one:
            assert one[component] == other[component], (path, component)
