"""Recordings derived from raw logs: they show what the log has, in every layout, whatever its batches."""

import subprocess
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from typer.testing import CliRunner

from taskopt import open_log, run
from taskopt.cli import app
from taskopt.errors import InvalidValue, UnknownName
from taskopt.loop.run_log import RunLog
from taskopt.loop.scenario import Scenario
from taskopt.recording.derived.answers import Answers
from taskopt.recording.derived.events import events
from taskopt.recording.derived.lanes import lanes
from taskopt.recording.viewer.open import viewer_program
from taskopt.recording.viewer.paths import data_path
from taskopt.recording.viewer.picture import NoGraphics, drawn, headless
from taskopt.recording.viewer.review.layouts import LAYOUTS
from taskopt.recording.viewer.review.recording import record_logs
from taskopt.resolver.registry import resolver
from tests.helpers.rrd import batches, entities, layout_words, rows_of

NAMES = ("active-set", "pinv")
_INTERNAL = ("rerun.controls.RowId",)


@pytest.fixture(scope="module")
def raw(tmp_path_factory: pytest.TempPathFactory, scenario: Scenario) -> Path:
    """The log of two resolvers: the velocity limit binds the one, and the other one breaks it."""
    path = tmp_path_factory.mktemp("raw") / "short.arrow"
    with RunLog(scenario, [resolver(name) for name in NAMES], path) as log:
        for name in NAMES:
            for _ in run(scenario, name, log=log):
                pass
    return path


@pytest.fixture(scope="module")
def derived(raw: Path) -> Path:
    return record_logs([open_log(raw)], "overview", raw.with_suffix(".rrd"))


def in_batches(path: Path, size: int, folder: Path) -> Path:
    """Copy a log into a file of the same name whose batches have another size."""
    folder.mkdir()
    out = folder / path.name
    with pa.OSFile(str(path)) as source:
        reader = pa.ipc.open_file(source)
        table = reader.read_all()
        last, told = reader.get_batch_with_custom_metadata(reader.num_record_batches - 1)
        with pa.ipc.new_file(str(out), table.schema) as writer:
            for batch in table.to_batches(max_chunksize=size):
                writer.write_batch(batch)
            writer.write_batch(last.slice(0, 0), custom_metadata=told)
    return out


def content(file: Path) -> dict[str, Any]:
    """All rows of all entities, however the file is cut into pieces."""
    found: dict[str, Any] = {}
    for batch in batches(file):
        path = batch.schema.metadata[b"rerun:entity_path"].decode()
        for name in set(batch.schema.names) - set(_INTERNAL):
            found.setdefault(f"{path} {name}", []).extend(batch.column(name).to_pylist())
    return found


def verified(file: Path) -> bool:
    """Rerun's own check of a file."""
    words = [viewer_program(), "rrd", "verify", str(file)]
    return subprocess.run(words, capture_output=True, check=False).returncode == 0


@pytest.mark.parametrize("name", NAMES)
def test_plots_have_the_numbers_of_the_log(raw, derived, name):
    """Velocities and iterations to the last bit, and the norm of the error of the first task."""
    log = open_log(raw)
    rows = log.rows(name)
    for key, column in (("v", "x"), ("iterations", "iterations")):
        told = np.array(rows_of(derived, data_path(name, key))["scalars"])
        np.testing.assert_array_equal(told, log.array(column)[rows].reshape(told.shape))
    told = rows_of(derived, data_path(name, "error", "tip position", "m"))
    np.testing.assert_array_equal(told["sim_time"], np.rint(1e9 * log.t[rows]).astype(np.int64))
    norms = [[float(np.linalg.norm(row))] for row in log.array("error/tip position")[rows]]
    np.testing.assert_allclose(told["scalars"], norms, rtol=1e-14)


def test_lanes_are_the_ticks_at_which_the_log_says_so(raw):
    """Row by row from the columns: the velocity limit of each joint, and what `pinv` breaks."""
    log = open_log(raw)
    for name in NAMES:
        answers, found = Answers(log, name), {}
        for tick in (log.tick(int(row)) for row in log.rows(name)):
            for i, joint in enumerate(log.layout.unknowns):
                h, v = tick.hierarchy, tick.x[i]
                over = v > h.box_upper[i] + 1e-9 or v < h.box_lower[i] - 1e-9
                found.setdefault(joint, []).append(over if name == "pinv" else bool(tick.resolution.state[i]))
        told = {lane.name: lane for lane in lanes(answers)}
        for joint, flags in found.items():
            lane = told.get(f"joint_velocity/{joint}")
            assert (lane.ticks if lane else 0) == sum(flags)
            runs = [len([*group]) for flag, group in groupby(flags) if flag]
            assert [s.last + 1 - s.first for s in (lane.stretches if lane else ())] == runs
        assert any(any(flags) for flags in found.values())


def test_lanes_are_sorted_by_level_and_duration(raw):
    """And named in words; their paths keep the order."""
    found = lanes(Answers(open_log(raw), "active-set"))
    assert [(lane.level, -lane.ticks) for lane in found] == sorted(
        (lane.level, -lane.ticks) for lane in found
    )
    assert {lane.words for lane in found} <= {f"joint{i} velocity" for i in (1, 2, 3)}


def test_events_tell_each_beginning_and_end_once(raw):
    """As many as there are stretches, in the order of time, and the first one is named."""
    answers = Answers(open_log(raw), "pinv")
    found = lanes(answers)
    told = events(answers, found)
    assert [event.place for event in told] == sorted(event.place for event in told)
    broken = [event for event in told if event.severity == "WARN"]
    assert len(broken) == sum(len(lane.stretches) for lane in found) > 0
    assert "beyond its" in broken[0].text


def test_equal_ticks_give_equal_data_in_batches_of_any_size(raw, derived, tmp_path):
    """1, 40, 600 and 4,000 ticks a batch; one changed number would be seen."""
    expected = content(derived)
    for size in (1, 40, 600, 4000):
        again = in_batches(raw, size, tmp_path / str(size))
        told = content(record_logs([open_log(again)], "overview", again.with_suffix(".rrd")))
        assert told.keys() == expected.keys()
        assert all(told[key] == expected[key] for key in expected), size
    velocities = expected[f"{data_path('pinv', 'v')} Scalars:scalars"]
    assert velocities[0] != velocities[1]


@pytest.mark.parametrize("layout", LAYOUTS)
def test_each_layout_is_a_whole_file_of_its_own_application(raw, tmp_path, layout):
    """Rerun's check passes, and fails for a file that is cut; views end with the run; names are in words."""
    file = record_logs([open_log(raw)], layout, tmp_path / "run.rrd")
    assert verified(file)
    cut = tmp_path / "cut.rrd"
    cut.write_bytes(file.read_bytes()[:-2000])
    assert not verified(cut)
    assert application(file) == f"taskopt short {layout}"
    shown = ranges(file)
    assert all(span == (0, 750_000_000) for span in shown)
    assert bool(shown) == (layout != "figure")
    assert ("Limits over time: pinv" in layout_words(file)) == (layout not in ("figure", "hierarchy"))


def application(file: Path) -> str:
    from rerun.chunk import RrdReader

    return RrdReader(str(file)).recordings()[0].application_id


def ranges(file: Path) -> list[tuple[int, int]]:
    """The time ranges that views of the layout open with [ns]."""
    from rerun.chunk import RrdReader

    reader, found = RrdReader(str(file)), []
    for store in reader.blueprints():
        for chunk in reader.stream(store=store):
            batch = chunk.to_record_batch()
            for name in batch.schema.names:
                if name.endswith("TimeAxis:view_range"):
                    for row in batch.column(name).to_pylist():
                        found += [(int(one["start"]), int(one["end"])) for one in row or ()]
    return found


def test_what_cannot_be_shown_is_named(raw, tmp_path):
    """A layout that is not there, a file of another kind, and a log without a robot."""
    log = open_log(raw)
    with pytest.raises(UnknownName, match="overview"):
        record_logs([log], "overveiw", tmp_path / "run.rrd")
    with pytest.raises(InvalidValue, match=r"\*\.rrd"):
        record_logs([log], "overview", tmp_path / "run.png")
    log.facts = {**log.facts, "robot": {}}
    with pytest.raises(InvalidValue, match="no robot to draw"):
        record_logs([log], "overview", tmp_path / "run.rrd")


def listening(pid: int) -> set[str]:
    """Local addresses, in hexadecimal, that a process listens on."""
    sockets = set()
    for link in Path(f"/proc/{pid}/fd").iterdir():
        try:
            sockets.add(str(link.readlink()))
        except FileNotFoundError:
            continue
    found = set()
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]:
            words = line.split()
            if words[3] == "0A" and f"socket:[{words[9]}]" in sockets:
                found.add(words[1].partition(":")[0])
    return found


@pytest.mark.slow
def test_a_viewer_listens_to_this_machine_only():
    """127.0.0.1 in the byte order of the kernel's table; all viewers are started by one function."""
    from taskopt.recording.viewer import open as viewing

    started = []
    launch = viewing.launch
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "taskopt.recording.viewer.picture.launch",
            lambda *words, **named: started.append(launch(*words, **named)) or started[-1],
        )
        try:
            with headless():
                assert listening(started[0].pid) == {"0100007F"}
        except NoGraphics as error:
            pytest.skip(str(error))
    sources = Path(viewing.__file__).parent.rglob("*.py")
    assert [file.name for file in sources if "subprocess.Popen(" in file.read_text("utf-8")] == ["open.py"]


def test_several_logs_are_one_recording(raw, tmp_path):
    """With a robot for each arm of each log, and the differences from the first one, which has none."""
    other = in_batches(raw, 40, tmp_path / "other")
    file = record_logs([open_log(raw), open_log(other)], "comparison", tmp_path / "both.rrd")
    apart = {path for path in entities(file) if path.endswith("/apart/v")}
    assert len(apart) == 2 * len(NAMES) - 1
    largest = {path: np.max(rows_of(file, path)["scalars"]) for path in apart}
    assert sorted(value > 0.0 for value in largest.values()) == [False, True, True]  # two are equal


@pytest.mark.slow
def test_one_log_after_another_opens_in_its_own_layout(raw, tmp_path):
    """In one viewer: application and views are those of the second; without its own, a layout would stay."""
    files = [record_logs([open_log(raw)], name, tmp_path / f"{name}.rrd") for name in ("overview", "limits")]
    try:
        with headless() as viewer:
            shown = []
            for file in (*files, files[0]):
                drawn(viewer, file, 0.3)
                shown.append(sorted(view.name for view in viewer.get_state().views))
    except NoGraphics as error:
        pytest.skip(str(error))
    assert shown[0] == shown[2] != shown[1]


def test_the_command_derives_a_recording(raw, tmp_path):
    """--save writes it; what cannot go together is named."""
    out = tmp_path / "seen.rrd"
    done = CliRunner().invoke(app, ["view", str(raw), "--layout", "limits", "--save", str(out)])
    assert done.exit_code == 0, done.exception
    assert application(out) == "taskopt short limits"
    for words, expected in (
        (["run.rrd", "--layout", "limits"], "raw logs"),
        (["a.rrd", "b.rrd"], "side by side"),
        (["a.rrd", str(raw)], "either recordings or raw logs"),
    ):
        refused = CliRunner().invoke(app, ["view", *words])
        assert isinstance(refused.exception, InvalidValue)
        assert expected in str(refused.exception)


def test_names_of_entities_do_not_collide(derived):
    """Both arms have their robot, their lanes and their events."""
    paths = entities(derived)
    for name in NAMES:
        assert any(path.startswith(f"/world/{name}/robot") for path in paths)
        assert any(path.startswith(f"/{name}/01_joint") for path in paths)
        assert f"/run/events/{name}" in paths
