"""Files and viewers: a viewer that is absent, hangs or dies neither stops a run nor slows it."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from taskopt.errors import InvalidValue
from taskopt.recording.viewer.open import listens, viewer_program
from taskopt.recording.viewer.writer import RecordingWriter
from tests.helpers.rrd import rows_of

TICKS = 60


def recorded(file: Path, live: str | None, between=None) -> float:
    """Send rows with a viewer listening or not; the longest that a send or flush took [s]."""
    import rerun as rr
    import rerun.blueprint as rrb

    writer = RecordingWriter(file, "test", rrb.Blueprint(), live)
    longest = 0.0
    for k in range(TICKS):
        begin = time.perf_counter()
        row = np.array([k])
        writer.send_columns("/x", row, row.astype("timedelta64[ns]"), rr.Scalars.columns(scalars=[float(k)]))
        writer.flush()
        longest = max(longest, time.perf_counter() - begin) if k else 0.0
        if between is not None:
            between(k)
        time.sleep(0.01)
    writer.close()
    return longest


def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def whole(file: Path) -> bool:
    return np.ravel(rows_of(file, "/x")["scalars"]).tolist() == list(map(float, range(TICKS)))


def test_what_was_flushed_can_be_read_while_the_run_goes_on(tmp_path):
    """After a flush the rows are in the file, before it is closed."""
    file = tmp_path / "run.rrd"
    seen = []
    recorded(file, None, lambda k: seen.append(len(rows_of(file, "/x")["tick"])) if k in (10, 30) else None)
    assert seen == [11, 31]
    assert whole(file)


@pytest.mark.slow
def test_an_absent_viewer_does_not_slow_a_run(tmp_path):
    """Nobody listens: the file is complete and no send takes longer than a fraction of a second."""
    file = tmp_path / "run.rrd"
    assert recorded(file, f"rerun+http://127.0.0.1:{port()}/proxy") < 0.5
    assert whole(file)


@pytest.mark.slow
def test_a_viewer_that_hangs_does_not_slow_a_run(tmp_path):
    """It accepts the connection and never answers: as if it were not there."""
    file = tmp_path / "run.rrd"
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        address = f"rerun+http://127.0.0.1:{deaf.getsockname()[1]}/proxy"
        begin = time.perf_counter()
        assert recorded(file, address) < 0.5
        assert time.perf_counter() - begin < 6.0
    assert whole(file)


@pytest.mark.slow
@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGSTOP])
def test_a_viewer_that_goes_away_does_not_stop_a_run(tmp_path, blow):
    """Killed or frozen in the middle of a run: the run ends in time, its file is whole, Python can leave."""
    free = port()
    words = [viewer_program(), "--serve-grpc", "--port", str(free), "--bind", "127.0.0.1"]
    viewer = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for _ in range(100):
            if listens(free):
                break
            time.sleep(0.1)
        file = tmp_path / "run.rrd"
        code = (
            "import os; from tests.recording.viewer.test_writer import recorded; from pathlib import Path\n"
            f"print(recorded(Path({str(file)!r}), 'rerun+http://127.0.0.1:{free}/proxy',"
            f" lambda k: os.kill({viewer.pid}, {int(blow)}) if k == 20 else None))"
        )
        done = subprocess.run(
            [sys.executable, "-c", code],
            check=False,
            cwd=Path(__file__).parents[3],
            capture_output=True,
            text=True,
            timeout=30,
        )
        assert done.returncode == 0, done.stderr
        assert float(done.stdout) < 0.5
        assert whole(file)
    finally:
        os.kill(viewer.pid, signal.SIGKILL)
        viewer.wait()


def test_a_recording_that_cannot_be_written_is_one_clear_error(tmp_path):
    """The message has the file."""
    with pytest.raises(InvalidValue, match=r"run\.rrd"):
        recorded(tmp_path / "nowhere" / "run.rrd", None)
