"""How a recorded run ends on a disk that becomes full, on a small file system in memory."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from taskopt import open_log

ROOT = Path(__file__).parents[2]
PROGRAM = "from taskopt.cli import main; main()"


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 2 MB; skipped where the user may not mount one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(folder)]
    try:
        mounted = subprocess.run(words, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        mounted = False
    if not mounted:
        pytest.skip("no file system can be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def ended(*words: str) -> list[str]:
    """Run a command that must fail, and return its own lines of errors, without those of Rerun's logger."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    words = (sys.executable, "-c", PROGRAM, "run", str(ROOT / "tasks/planar_circle.py"), *words)
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False, env=environment)
    assert done.returncode == 2, done.stderr
    return [
        line for line in done.stderr.splitlines() if "re_log_encoding" not in line and "re_sdk" not in line
    ]


@pytest.mark.slow
@pytest.mark.parametrize("logged", [False, True])
def test_a_recorded_run_ends_with_one_line_and_a_true_manifest(disk, logged):
    """The line names folder and reason, and the manifest, for which there is room, says "interrupted"."""
    log = ["--log", str(disk / "a.arrow")] if logged else []
    (line,) = ended("--duration", "600", "--logs", str(disk), *log)
    (manifest,) = disk.rglob("manifest.json")
    assert "No space left on device" in line or "no space is left" in line
    assert str(disk) in line
    assert json.loads(manifest.read_text())["status"] == "interrupted"
    assert not list(disk.rglob("*.part"))
    if logged:
        kept = open_log(disk / "a.arrow")
        assert kept.array("tick").tolist() == list(range(len(kept)))
        assert len(kept) > 0


@pytest.mark.slow
def test_a_raw_log_ends_with_one_line(disk):
    """The log has what fitted, and says that its end is missing."""
    path = disk / "a.arrow"
    (line,) = ended("--duration", "600", "--no-record", "--log", str(path))
    kept = open_log(path)
    assert line.startswith(
        f"taskopt: the log {path} cannot be written: No space left on device; {len(kept)} of "
    )
    assert "cut off" in kept.missing
