"""Scenarios: what is checked when one is made, and how files are loaded."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from taskopt import JointTask, Scenario, Stack
from taskopt.errors import InvalidValue, MissingFile, TaskoptError, UnknownName
from taskopt.kinematics.robot import planar_arm
from taskopt.loop.scenario import load_scenario, scenario_files

ROOT = Path(__file__).parents[2]
ARM = planar_arm([0.5, 0.5], lower=-1.0, upper=1.0)


def scenario(**changes: Any) -> Scenario:
    given = {"robot": ARM, "q0": [0.1, 0.2], "stack": Stack([[JointTask()]]), "duration": 1.0}
    return Scenario(**(given | changes))


def written(folder: Path, text: str) -> Path:
    file = folder / "mine.py"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"dt": 0.0}, ["dt must be > 0", "got 0"]),
        ({"dt": -1e-3}, ["dt must be > 0"]),
        ({"dt": np.nan}, ["dt"]),
        ({"duration": 0.0}, ["duration must be > 0"]),
        ({"duration": 1e-5}, ["duration 1e-05 s is less than a step of 0.001 s"]),
        ({"q0": [0.1]}, ["shape 2", "got 1"]),
        ({"q0": [0.1, np.nan]}, ["NaN at index 1"]),
        ({"q0": [0.1, 1.5]}, ["joint2 at 1.5 rad", "allowed -1 to 1", "move q0 inside"]),
    ],
)
def test_what_cannot_run_is_refused_with_the_way_out(changes: dict[str, Any], words: list[str]) -> None:
    """Step, duration and start are checked before anything runs, and the message names joint and range."""
    with pytest.raises(InvalidValue) as caught:
        scenario(**changes)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_the_start_is_the_scenarios_own() -> None:
    """Changing the array that was handed over does not move the start."""
    q0 = np.array([0.1, 0.2])
    made = scenario(q0=q0)
    q0[:] = 9.0
    np.testing.assert_array_equal(made.start, [0.1, 0.2])


@pytest.mark.parametrize("file", scenario_files(ROOT / "tasks"), ids=lambda file: file.stem)
def test_shipped_scenarios_load_and_compile(file: Path) -> None:
    """Every file in tasks/ has a scenario with its name and description, whose stack fits its robot."""
    loaded = load_scenario(file)
    assert loaded.name == file.stem
    assert loaded.description
    plan = loaded.stack.compile(loaded.robot, loaded.dt)
    assert plan.at(loaded.start, 0.0).n == loaded.robot.nv


@pytest.mark.parametrize(
    ("text", "kind", "words"),
    [
        ("x = 1\n", InvalidValue, ["has no name `scenario`", "scenario = Scenario("]),
        ("scenario = 3\n", InvalidValue, ["int", "scenario = Scenario("]),
        ("x = (\n", InvalidValue, ["not valid Python", "line 1"]),
        ("from taskopt import Robot\nscenario = Robot.load('pandaa')\n", UnknownName, ["panda"]),
    ],
)
def test_a_file_that_is_no_scenario_is_refused(
    tmp_path: Path, text: str, kind: type[TaskoptError], words: list[str]
) -> None:
    """The message says what is missing and how it should read; errors from inside pass through."""
    with pytest.raises(kind) as caught:
        load_scenario(written(tmp_path, text))
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_a_missing_file_gets_the_nearest_names(monkeypatch: pytest.MonkeyPatch) -> None:
    """A name that is nearly right is answered with the right one, otherwise with all there are."""
    monkeypatch.chdir(ROOT)
    with pytest.raises(MissingFile, match=r"did you mean tasks/planar_circle\.py"):
        load_scenario("tasks/planer_circle.py")
    with pytest.raises(MissingFile, match="tasks/panda_circle"):
        load_scenario("xyz")


def test_bugs_in_a_scenario_file_keep_their_traceback(tmp_path: Path) -> None:
    """The error of the file is the cause of the one that names its line."""
    with pytest.raises(InvalidValue, match="line 1: ZeroDivisionError") as told:
        load_scenario(written(tmp_path, "x = 1 / 0\n"))
    assert isinstance(told.value.__cause__, ZeroDivisionError)
