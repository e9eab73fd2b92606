"""The log folder: where it is, what stands in it, and what happens where it cannot be."""

import hashlib
from pathlib import Path

import pytest

from taskopt.errors import InvalidValue
from taskopt.recording import record
from taskopt.recording.log import new_folder, open_log
from taskopt.recording.reading import read_manifest


def test_a_log_has_recording_table_and_manifest(folder):
    """Nothing else, and nothing is missing."""
    assert {file.name for file in folder.iterdir()} >= {"run.rrd", "steps.arrows", "manifest.json"}


def test_the_manifest_says_how_to_repeat_the_run(folder, info, scenario):
    """Versions, machine, seed, scenario with its text and hash, resolvers, ticks, status."""
    content = read_manifest(folder)
    assert content["status"] == "finished"
    assert content["resolvers"] == list(info.resolvers)
    assert content["ticks"] == dict.fromkeys(info.resolvers, scenario.ticks)
    assert content["seed"] == 7
    assert content["q0"] == scenario.start.tolist()
    assert content["scenario"]["dt_s"] == scenario.dt
    own = Path(__file__).with_name("conftest.py")
    assert content["scenario"]["sha256"] == hashlib.sha256(own.read_bytes()).hexdigest()
    assert content["scenario"]["text"] == own.read_text(encoding="utf-8")
    assert {"numpy", "pin", "numba", "rerun-sdk", "daqp"} <= content["versions"].keys()
    assert content["machine"]["cores"] >= 1


def test_an_interrupted_run_is_marked(info, steps, tmp_path):
    """A failure on the way leaves its mark in the manifest, and the steps before it."""
    log = open_log(info, tmp_path)

    def failing():
        yield steps["pinv"][0]
        raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        list(record(failing(), log))
    content = read_manifest(log.folder)
    assert content["status"] == "interrupted"
    assert content["ticks"]["pinv"] == 1


def test_folders_are_named_by_time_and_never_shared(tmp_path):
    """Two logs within a second get two folders."""
    folders = {new_folder(tmp_path / "short") for _ in range(4)}
    assert len(folders) == 4
    assert all(folder.name[8] == "-" and folder.parent.name == "short" for folder in folders)


@pytest.mark.parametrize("place", ["a file", "a file/below it"])
def test_a_folder_that_cannot_be_made_is_one_clear_error(tmp_path, info, place):
    """The message has the place and the reason."""
    (tmp_path / "a file").write_text("")
    with pytest.raises(InvalidValue, match="a file"):
        open_log(info, tmp_path / place)


def test_a_folder_that_may_not_be_written_is_one_clear_error(tmp_path, info, monkeypatch):
    """Permission denied comes as `InvalidValue`, with the way out."""

    def denied(self, *args, **kwargs):
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "mkdir", denied)
    with pytest.raises(InvalidValue, match="Permission denied; choose another"):
        open_log(info, tmp_path)
