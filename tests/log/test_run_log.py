"""Runs and comparisons that are logged: every tick of every resolver, with the text of the scenario."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from taskopt import Scenario, open_log, run, solve_again
from taskopt.cli import app
from taskopt.compare import Comparison
from taskopt.errors import Infeasible
from taskopt.loop.run_log import RunLog
from taskopt.loop.scenario import load_scenario
from taskopt.resolver.registry import resolver
from tests.log.conftest import ARM, DT, START, stack

NAMES = ("active-set", "pinv", "hqp/daqp")


def scenario(**changes) -> Scenario:
    return Scenario(robot=ARM, q0=START, duration=60 * DT, dt=DT, **{"stack": stack(), **changes})


@pytest.mark.slow
def test_a_run_is_in_its_log(tmp_path):
    """Postures, velocities, errors, poses and times of each row are those of the step."""
    steps = list(run(scenario(), log=tmp_path / "a.arrow"))
    log = open_log(tmp_path / "a.arrow")
    assert log.end.end == "finished"
    assert len(steps) == len(log) == 60
    for k, step in enumerate(steps):
        tick = log.tick(k)
        assert np.array_equal(tick.values["q"], step.q)
        assert np.array_equal(tick.x, step.v)
        assert np.array_equal(tick.resolution.answer, step.resolution.answer)
        assert np.array_equal(tick.values["error/hand"], step.errors["hand"])
        assert np.array_equal(np.reshape(tick.values["desired/hand"], (4, 4)), step.desired["hand"])
        assert (tick.values["seconds"], tick.values["build_seconds"]) == (step.seconds, step.build_seconds)
        assert solve_again(tick).distance == 0.0


@pytest.mark.slow
def test_a_comparison_has_the_ticks_of_all_resolvers(tmp_path):
    """One file has the rows of each resolver, and each is solved again to the last bit."""
    resolvers = [resolver(name) for name in NAMES]
    with RunLog(scenario(), resolvers, tmp_path / "a.arrow") as raw:
        steps = list(Comparison(scenario(), resolvers, log=raw))
    log = open_log(tmp_path / "a.arrow")
    assert log.resolvers == NAMES
    for name in NAMES:
        own, rows = [step for step in steps if step.resolver == name], log.rows(name)
        assert np.array_equal(log.array("x")[rows], [step.v for step in own])
        assert log.array("tick")[rows].tolist() == list(range(60))
        assert [solve_again(log.tick(int(row))).distance for row in rows[::7]] == [0.0] * 9


def failed(path):
    """Run into a log, until the caller raises an error at tick 20."""
    with RunLog(scenario(), [resolver("pinv")], path) as raw:
        for step in run(scenario(), "pinv", log=raw):
            if step.index == 20:
                raise Infeasible("told by a test")


@pytest.mark.slow
def test_the_error_that_ends_a_run_is_in_its_log(tmp_path):
    """The log has the ticks until the error, and says what ended the run."""
    with pytest.raises(Infeasible):
        failed(tmp_path / "a.arrow")
    log = open_log(tmp_path / "a.arrow")
    assert (len(log), log.end.end, log.end.why) == (21, "interrupted", "told by a test")
    halted = run(scenario(), log=tmp_path / "b.arrow")
    next(halted)
    halted.close()
    log = open_log(tmp_path / "b.arrow")
    assert (len(log), log.end.why) == (1, "GeneratorExit")


@pytest.mark.slow
def test_commands_write_the_log_with_the_text_of_the_scenario(tmp_path):
    """`run` and `compare` write the file that --log names; its text is that of the scenario's file."""
    words = ["tasks/planar_circle.py", "--no-record", "--duration", "0.05"]
    for command, named in (("run", ["active-set"]), ("compare", ["active-set", "pinv"])):
        path = tmp_path / f"{command}.arrow"
        done = CliRunner().invoke(app, [command, *words, "-r", ",".join(named), "--log", str(path)])
        assert done.exit_code == 0, done.output
        assert "taskopt show" in done.output
        log, expected = open_log(path), load_scenario(words[0])
        assert list(log.resolvers) == named
        assert len(log) == len(named) * round(0.05 / expected.dt)
        assert log.facts["scenario"]["text"] == Path(words[0]).read_text(encoding="utf-8")
        assert log.facts["scenario"]["name"] == expected.name
