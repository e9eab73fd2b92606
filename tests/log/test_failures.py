"""How a log ends if something is killed, a disk is full, or a folder cannot be written."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from taskopt import Controller, open_log, solve_again
from taskopt.errors import BadLog, InvalidValue, LogFailed
from tests.log.conftest import ARM, DT, START, run, stack

LOOP = """
import sys, time
from taskopt import Controller
from tests.log.conftest import ARM, DT, START, stack
control = Controller(ARM, stack(), dt=DT, log=sys.argv[1])
control.start(START)
q, k = START, 0
while True:
    q = ARM.integrate(q, control.step(q, k * DT).v, DT)
    print(k, flush=True)
    k += 1
    time.sleep(0.001)
"""


def started(path: Path) -> "subprocess.Popen[str]":
    """Start a program with a loop that is logged, and wait until it runs."""
    root = str(Path(__file__).parents[2])
    words = [sys.executable, "-c", LOOP, str(path)]
    program = subprocess.Popen(
        words, stdout=subprocess.PIPE, cwd=root, env=os.environ | {"PYTHONPATH": root}, text=True
    )
    for _ in range(50):
        program.stdout.readline()
    return program


def steps(control: Controller, count: int) -> None:
    """Take many steps."""
    for k in range(count):
        control.step(START, k * DT)


def writer_of(process: int) -> int:
    """Return the number of the process that writes the log of another one."""
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    return next(int(child) for child in children if "writer" in Path(f"/proc/{child}/cmdline").read_text())


def closed(path: Path) -> None:
    """Wait until the writer of a program that has ended is done."""
    for _ in range(200):
        try:
            if open_log(path).end.end == "cut off" and "all ticks" in open_log(path).missing:
                return
        except BadLog:
            pass
        time.sleep(0.05)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_program_loses_nothing(tmp_path, number):
    """Every tick that the program has taken is in the log, which says that nobody closed it."""
    path = tmp_path / "a.arrow"
    with started(path) as program:
        program.send_signal(number)
        last = int((["49", *program.stdout.read().split()])[-1])
    closed(path)
    log = open_log(path)
    assert len(log) in (last + 1, last + 2)  # the last one may not have been printed
    assert "without closing" in log.missing
    assert log.array("tick").tolist() == list(range(len(log)))
    assert solve_again(log.tick(-1)).distance == 0.0


@pytest.mark.slow
def test_a_killed_writer_is_noticed(tmp_path):
    """If the writer is killed, a step says so with its answer, and the steps after it go on without a log."""
    path = tmp_path / "a.arrow"
    control = Controller(ARM, stack(), dt=DT, log=path)
    for k in range(30):
        control.step(START, k * DT)
    time.sleep(0.5)  # until a batch is in the file
    os.kill(writer_of(os.getpid()), signal.SIGKILL)
    with pytest.raises(LogFailed, match="code -9") as failed:
        steps(control, 20_000)
    assert np.isfinite(failed.value.resolution.x).all()
    assert np.isfinite(control.step(START, 9.0).x).all()
    log = open_log(path)
    assert len(log) == 30
    assert "cut off" in log.missing
    assert solve_again(log.tick(29)).distance == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.02, 0.3, 0.5, 0.77, 0.9, 0.999])
def test_a_file_that_is_cut_anywhere_opens_as_far_as_it_goes(tmp_path, share):
    """Whole batches before the cut are there, to the last bit, and the log says that something is missing."""
    path, cut = tmp_path / "a.arrow", tmp_path / "cut.arrow"

    def slowly(control: Controller, k: int) -> None:
        if k % 20 == 0:
            time.sleep(0.25)  # a batch of its own

    ran = run(path, stack(), ticks=60, on_tick=slowly)
    content = path.read_bytes()
    cut.write_bytes(content[: int(share * len(content))])
    if share < 0.1:
        with pytest.raises(BadLog, match="before its first batch"):
            open_log(cut)
        return
    log = open_log(cut)
    assert "cut off" in log.missing or len(log) == 60
    assert log.array("tick").tolist() == list(range(len(log))) if len(log) else share < 0.5
    assert share < 0.8 or len(log) >= 40
    for k in range(len(log)):
        assert np.array_equal(log.tick(k).resolution.answer, ran.answers[k].answer)


@pytest.mark.parametrize("place", ["/proc/a.arrow", "/no/such/folder/a.arrow", "full.arrow"])
def test_a_file_that_cannot_be_written_is_refused_at_once(tmp_path, monkeypatch, place):
    """A folder that does not exist or refuses files, and a full disk, are said in one line with the path."""
    monkeypatch.chdir(tmp_path)
    Path("full.arrow").symlink_to("/dev/full")
    begin = time.monotonic()
    with pytest.raises((InvalidValue, LogFailed), match=place):
        steps(Controller(ARM, stack(), dt=DT, log=place), 100_000)
    assert time.monotonic() - begin < 60.0  # it ends; how soon is measured elsewhere


@pytest.mark.slow
def test_a_log_is_closed_when_the_program_ends(tmp_path):
    """A program that never closes its log has a complete one after its end."""
    root = str(Path(__file__).parents[2])
    text = LOOP.replace("while True:", "while k < 40:")
    done = subprocess.run(
        [sys.executable, "-c", text, str(tmp_path / "a.arrow")],
        cwd=root,
        env=os.environ | {"PYTHONPATH": root},
        check=False,
    )
    log = open_log(tmp_path / "a.arrow")
    assert done.returncode == 0
    assert (len(log), log.missing, log.end.end) == (40, "", "finished")


def test_a_closed_log_takes_no_more(tmp_path):
    """Steps after the log was closed go on without it; closing twice does nothing."""
    control = Controller(ARM, stack(), dt=DT, log=tmp_path / "a.arrow")
    control.step(START, 0.0)
    control.log.close()
    control.log.close()
    assert np.isfinite(control.step(START, DT).x).all()
    assert len(open_log(tmp_path / "a.arrow")) == 1
