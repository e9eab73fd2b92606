"""How `taskopt run --log` ends if its disk is full, its folder refuses files, or it is killed."""

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from taskopt import Controller, open_log, solve_again
from tests.log.conftest import ARM, DT, START, stack
from tests.log.test_failures import closed, writer_of

ROOT = Path(__file__).parents[2]
MAIN = "from taskopt.cli import main; main()"
LEAST = 200_000  # bytes of a disk on which a log begins, and does not end
RUN = ("run", str(ROOT / "tasks/planar_circle.py"), "--no-record", "--log")


def started(*words: str) -> "subprocess.Popen[str]":
    """Start the program."""
    return subprocess.Popen(
        [sys.executable, "-c", MAIN, *words],
        env=os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def begun(path: Path, size: int) -> None:
    """Wait until a log has a size [bytes]."""
    for _ in range(2400):
        if path.exists() and path.stat().st_size >= size:
            return
        time.sleep(0.05)


def said(program: "subprocess.Popen[str]") -> str:
    """Wait for the end of a program, which must be an error of one line, and return that line."""
    _, told = program.communicate(timeout=120)
    assert program.returncode == 2, told
    (line,) = told.splitlines()
    return line


@pytest.mark.slow
def test_a_disk_that_becomes_full_ends_a_run_with_one_line(tmp_path):
    """The run ends with exit code 2 and a line that says why; what fitted is in the log, and says so."""
    path = tmp_path / "a.arrow"
    program = started(*RUN, str(path), "--duration", "600")
    begun(path, 1)
    resource.prlimit(writer_of(program.pid), resource.RLIMIT_FSIZE, (LEAST, LEAST))
    line = said(program)
    assert line.startswith(f"taskopt: the log {path} cannot be written: File too large; ")
    assert path.stat().st_size <= LEAST
    log = open_log(path)
    assert len(log) > 0
    assert "cut off" in log.missing
    assert f"{len(log)} of " in line
    assert log.array("tick").tolist() == list(range(len(log))) == log.table()["tick"].to_pylist()
    assert solve_again(log.tick(-1)).distance == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("place", ["/proc/a.arrow", "/no/such/folder/a.arrow", "a.txt"])
def test_a_place_that_takes_no_log_is_refused_before_the_run(place):
    """A folder that refuses files, one that does not exist, and another ending are said in one line."""
    line = said(started(*RUN, place, "--duration", "600"))
    assert place in line
    assert "must end in .arrow" in line if place == "a.txt" else "choose another file" in line


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL, signal.SIGINT])
def test_a_run_that_is_stopped_has_its_ticks_in_the_log(tmp_path, number):
    """The exit code is that of the signal; the log says how it ended, and every tick is solved again."""
    path = tmp_path / "a.arrow"
    going = started(*RUN, str(path), "--duration", "600")
    begun(path, LEAST)
    going.send_signal(number)
    going.communicate(timeout=60)
    assert going.returncode == (130 if number == signal.SIGINT else -number)
    if number != signal.SIGINT:
        closed(path)
    log = open_log(path)
    expected = ("interrupted", "") if number == signal.SIGINT else ("cut off", "without closing")
    assert log.end.end == expected[0]
    assert expected[1] in log.missing
    assert log.end.why == ("the user interrupted it" if number == signal.SIGINT else "")
    assert log.array("tick").tolist() == list(range(len(log)))
    assert [solve_again(log.tick(k)).distance for k in (0, len(log) // 2, -1)] == [0.0, 0.0, 0.0]


def loop(path: Path, told: int) -> None:
    """Run a loop that is logged, and tell the number and the time of each tick, until it is killed."""
    control, q, k = Controller(ARM, stack(), dt=DT, log=path), START, 0
    while True:
        q = ARM.integrate(q, control.step(q, k * DT).v, DT)
        os.write(told, np.array([k, time.monotonic()]).tobytes())
        k += 1
        time.sleep(0.001)


def killed(path: Path, after: float, kind: str) -> np.ndarray:
    """Kill a loop, its writer or both some time after its first tick; return number and time of its ticks."""
    heard, told = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(heard)
            loop(path, told)
        finally:
            os._exit(1)
    os.close(told)
    first = os.read(heard, 16)
    time.sleep(after)
    if kind != "loop":
        os.kill(writer_of(child), signal.SIGKILL)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    with os.fdopen(heard, "rb") as rest:
        return np.frombuffer(first + rest.read()).reshape(-1, 2)


@pytest.mark.slow
@pytest.mark.thorough
def test_a_kill_at_any_of_50_moments_leaves_a_log_that_lacks_half_a_second_at_most(tmp_path):
    """Every log opens; a killed loop alone loses nothing; table, arrays and ticks agree."""
    random = np.random.default_rng(4)
    for i, after in enumerate(random.uniform(0.0, 1.5, 50)):
        kind, path = ("loop", "both")[i % 2], tmp_path / f"{i}.arrow"
        ticks = killed(path, after, kind)
        if kind == "loop":
            closed(path)
        log = open_log(path)
        assert log.missing
        count = len(log)
        assert log.array("tick").tolist() == list(range(count)) == log.table()["tick"].to_pylist()
        for k in {0, count // 2, count - 1} if count else ():
            tick = log.tick(k)
            assert tick.index == k
            assert solve_again(tick).distance == 0.0
        lost = ticks[-1, 1] - ticks[min(max(0, count - 1), len(ticks) - 1), 1]
        assert lost < (1e-9 if kind == "loop" else 0.5), (i, kind, after)
