"""SIGKILL in the middle of a run: recording and table open, and at most one second is lost."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from taskopt.recording.reading import newest_log, read_manifest, read_table
from taskopt.recording.viewer.paths import data_path
from tests.helpers.rrd import rows_of

PROGRAM = """
import sys, time
from pathlib import Path
sys.path.insert(0, {root!r})
from dataclasses import replace
from taskopt.recording import RunInfo
from taskopt.recording.log import open_log
from taskopt.resolver.registry import resolver
from taskopt.loop.run import run
from taskopt.loop.scenario import load_scenario

scenario = replace(load_scenario({root!r} + "/tasks/planar_circle.py"), duration=600.0)
info = RunInfo(scenario, ("active-set",))
with open_log(info, {logs!r}) as log:
    for step in run(scenario, resolver("active-set")):
        log.write(step)
        if step.index % 10 == 0:
            print(step.index, time.time(), flush=True)
        time.sleep(0.002)
"""


@pytest.mark.slow
@pytest.mark.parametrize("pause", [0.0, 0.4])
def test_a_killed_run_loses_at_most_a_second(tmp_path, pause):
    """Every step that was written more than a second before the kill is in the table and in the recording."""
    root = str(Path(__file__).parents[2])
    output = tmp_path / "steps.txt"
    with output.open("w") as pipe:
        program = PROGRAM.format(root=root, logs=str(tmp_path / "logs"))
        run = subprocess.Popen([sys.executable, "-c", program], stdout=pipe)
        while len(output.read_text().splitlines()) < 60 and run.poll() is None:
            time.sleep(0.1)
        time.sleep(pause)
        os.kill(run.pid, signal.SIGKILL)
        killed = time.time()
        run.wait()
    lines = [line.split() for line in output.read_text().splitlines()]
    due = max(
        int(index)
        for index, *when in filter(lambda line: len(line) == 2, lines)
        if float(when[0]) < killed - 1.0
    )
    log = newest_log(tmp_path / "logs")
    ticks = read_table(log).column("tick").to_pylist()
    assert ticks == list(range(len(ticks)))
    assert len(ticks) > due
    recorded = rows_of(log / "run.rrd", data_path("active-set", "q"))["tick"]
    assert recorded == list(range(len(recorded)))
    assert len(recorded) > due
    assert read_manifest(log)["status"] == "running"
