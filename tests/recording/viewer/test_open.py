"""Finding and opening recordings: the newest by default, and a clear word where nothing can be shown."""

import os
from pathlib import Path

import pytest

from taskopt.errors import InvalidValue, MissingFile
from taskopt.recording.reading import find_recording
from taskopt.recording.viewer import open as viewing


def test_a_path_means_its_recording(folder, tmp_path):
    """A file is itself, a log its recording, a folder of logs the newest."""
    file = folder / "run.rrd"
    assert find_recording(file) == file
    assert find_recording(folder) == file
    assert find_recording(folder.parent) == file
    with pytest.raises(MissingFile, match="no recording or log folder"):
        find_recording(tmp_path / "nowhere")
    with pytest.raises(MissingFile, match="make one with"):
        find_recording(tmp_path)


def test_without_a_display_the_message_has_the_way_out(folder, monkeypatch):
    """Both ways: a picture, or the file on another machine."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InvalidValue, match=r"--picture out\.png"):
        viewing.show(folder / "run.rrd")
    monkeypatch.setattr(viewing, "listens", lambda port: False)
    with pytest.raises(InvalidValue, match="leave out --live"):
        viewing.live_viewer()


def test_a_running_viewer_is_used_without_a_display(monkeypatch):
    """Its address is all that a run needs."""
    monkeypatch.setattr(viewing, "listens", lambda port: True)
    assert viewing.live_viewer(4321) == "rerun+http://127.0.0.1:4321/proxy"


def test_the_viewer_is_found_without_an_activated_environment(monkeypatch):
    """It comes with the package, whatever PATH says."""
    monkeypatch.setenv("PATH", "")
    program = Path(viewing.viewer_program())
    assert os.access(program, os.X_OK)
