"""Runs that begin with other parameters than the stack declares, from Python and from the command line."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from taskopt import InvalidValue, JointTask, PositionTask, Scenario, Stack, UnknownName, load_scenario, run
from taskopt.cli import app
from taskopt.loop.variation import varied
from taskopt.recording.manifest import manifest
from taskopt.recording.run_info import RunInfo
from tests.helpers.robots import generic_q, robot


def scenario(gain: float, **options: object) -> Scenario:
    """A hand that goes to a point, with a gain."""
    hand = PositionTask("panda_hand", target=[0.5, 0.1, 0.4], gain=gain, name="hand")
    return Scenario(
        robot=robot("panda"),
        q0=generic_q(robot("panda"), 2),
        stack=Stack([[hand], [JointTask(name="rest")]]),
        duration=0.05,
        dt=0.01,
        **options,  # type: ignore[arg-type]
    )


def test_a_setting_is_the_declaration_from_the_first_tick_on() -> None:
    """Every step of a run with a setting is that of a stack declared with the value."""
    for mine, right in zip(run(scenario(1.0, settings={"hand.gain": 4.0})), run(scenario(4.0)), strict=True):
        np.testing.assert_allclose(mine.v, right.v, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(mine.closed_form, right.closed_form, rtol=1e-12, atol=1e-12)
    first = next(iter(run(scenario(1.0))))
    assert np.abs(first.v - next(iter(run(scenario(4.0)))).v).max() > 0.01


def test_wrong_settings_are_errors_of_the_scenario() -> None:
    """An unknown address and a wrong value are refused when the scenario is made."""
    with pytest.raises(UnknownName, match=r"did you mean hand\.gain"):
        scenario(1.0, settings={"hand.gian": 4.0})
    with pytest.raises(InvalidValue, match="weight of 'hand'"):
        scenario(1.0, settings={"hand.weight": -4.0})


def test_the_manifest_tells_the_settings() -> None:
    """A reader of the log sees which parameters were set, as plain data."""
    settings = {"hand.gain": 4.0, "hand.target": np.array([0.4, 0.2, 0.5]), "rest.enabled": False}
    found = manifest(RunInfo(scenario(1.0, settings=settings), ("active-set",)))
    told = json.loads(json.dumps(found))["scenario"]["settings"]
    assert told == {"hand.gain": 4.0, "hand.target": [0.4, 0.2, 0.5], "rest.enabled": False}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("hand.gain=4", 4.0),
        ("hand.weight=[1, 2, 3]", [1, 2, 3]),
        ("hand.axes=xy", "xy"),
        ("rest.enabled=False", False),
        ("rest.enabled=true", True),
        ("hand.target=(0.4, 0.2, 0.5)", (0.4, 0.2, 0.5)),
    ],
)
def test_texts_become_settings(text: str, value: object) -> None:
    """Numbers, lists, truth values and letters are read as a user writes them."""
    changed = varied(scenario(1.0), [text])
    assert dict(changed.settings) == {text.partition("=")[0]: value}
    assert len(list(run(changed))) == 5


def test_the_command_line_varies_a_run() -> None:
    """--set, --dt and --duration reach the run; resolvers may be separated by commas."""
    options = ["--no-record", "--duration", "0.02", "--dt", "0.01"]
    done = CliRunner().invoke(app, ["run", "demo", "--set", "hand.gain=2", *options])
    assert done.exit_code == 0
    assert "2 ticks of 10 ms" in done.output
    done = CliRunner().invoke(app, ["compare", "demo", "-r", "active-set,hqp/daqp", *options])
    assert done.exit_code == 0
    assert "hqp/daqp" in done.output
    done = CliRunner().invoke(app, ["run", "demo", "--set", "hand", *options])
    assert isinstance(done.exception, InvalidValue)
    assert "ADDRESS=VALUE" in str(done.exception)
    done = CliRunner().invoke(app, ["list", "panda"])
    assert "panda_collision" in done.output
    assert "ur5" not in done.output
    assert CliRunner().invoke(app, ["--version"]).output.startswith("taskopt ")


def test_the_demo_is_proven_and_keeps_its_limits() -> None:
    """The scenario of the package needs no extra; all its ticks are proven, and the ball is met."""
    demo = load_scenario("demo")
    steps = list(run(demo))
    assert all(step.resolution.kkt_met() for step in steps)
    assert max(np.abs(step.v).max() for step in steps) <= 1.5 + 1e-9
    assert any(active.name.startswith("obstacle") for step in steps for active in step.resolution.active)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("undefined_name", r"line 3: NameError: name 'undefined_name' is not defined"),
        ("1 / 0", r"line 3: ZeroDivisionError"),
        ("def f(: pass", r"not valid Python: line 3"),
    ],
)
def test_an_error_in_a_scenario_file_has_the_line_of_the_user(
    tmp_path: Path, line: str, message: str
) -> None:
    """Whatever a file does wrong is told in one line, with the file and the line in it."""
    file = tmp_path / "wrong.py"
    file.write_text(f"from taskopt import *\n\n{line}\n")
    with pytest.raises(InvalidValue, match=f"wrong.py.*{message}"):
        load_scenario(file)


def test_an_error_of_taskopt_in_a_scenario_file_keeps_its_class(tmp_path: Path) -> None:
    """An unknown name stays one, and a note has the line, which the command line puts before the message."""
    file = tmp_path / "wrong.py"
    file.write_text("from taskopt import *\n\nRobot.load('pandaa')\n")
    with pytest.raises(UnknownName, match="did you mean panda") as told:
        load_scenario(file)
    assert told.value.__notes__ == [f"{file}, line 3"]


def test_a_start_by_names() -> None:
    """q0 may name joints or a posture; what is not named is at neutral, moved into the limits."""
    arm = robot("panda")
    named = arm.checked_q({"panda_joint2": 0.3, "panda_joint4": -2.0})
    right = np.clip(arm.neutral, arm.position_lower, arm.position_upper)
    right[[1, 3]] = 0.3, -2.0
    np.testing.assert_array_equal(named, right)
    np.testing.assert_array_equal(arm.checked_q("default"), arm.posture("default"))
    wheel = robot("tiago").checked_q({"wheel_left_joint": 0.5})
    columns = robot("tiago").model.joints[robot("tiago").joint_id("wheel_left_joint")].idx_q
    np.testing.assert_allclose(wheel[columns : columns + 2], [np.cos(0.5), np.sin(0.5)])
    with pytest.raises(UnknownName, match="panda_joint2"):
        arm.checked_q({"panda_jiont2": 0.3})
    with pytest.raises(InvalidValue, match="root_joint has 7 coordinates"):
        robot("talos_reduced").checked_q({"root_joint": 0.3})
