"""The page on robots of one's own: its snippets for the extras run, and its table is what the robots say."""

import re
from typing import Any

import numpy as np
import pytest
from checkout import ROOT
from robot_table import HEAD, gymnasium_files, row, rows_of_files, short

from taskopt import Robot, robot_names

PAGE = (ROOT / "docs" / "robots.md").read_text(encoding="utf-8")
ROWS = [line for line in PAGE[PAGE.index(HEAD) :].splitlines()[2:] if line.startswith("|")]
NAMES = [re.sub(r"^\| `(.*?)` .*", r"\1", line) for line in ROWS]
SAMPLE = sorted(np.random.default_rng(10).choice(robot_names(), 5, replace=False).tolist())


def test_snippets_with_the_extras_print_what_stands_beside_them(capsys: pytest.CaptureFixture[str]) -> None:
    """All snippets of the page in order, those for xacro and MJCF among them."""
    pytest.importorskip("mujoco")
    pytest.importorskip("xacrodoc")
    scope: dict[str, Any] = {}
    for language, snippet in re.findall(r"^```(python|py)\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE):
        exec(compile(snippet, language, "exec"), scope)
        said = capsys.readouterr().out.splitlines()
        assert [line.split("# prints ")[1] for line in snippet.splitlines() if "# prints " in line] == said


def test_every_robot_by_name_has_its_row() -> None:
    """In the order of `robot_names`; every tick of every row is proven."""
    assert tuple(NAMES[: len(robot_names())]) == robot_names()
    assert all("| 10 of 10 |" in line for line in ROWS)


@pytest.mark.parametrize("name", [*SAMPLE, "panda", "kinova"])
def test_the_row_of_a_robot_is_what_it_says(name: str) -> None:
    """Velocities, couplings, proven ticks, and what the file states and the robot does not have."""
    assert row(name, Robot.load(name)) == ROWS[NAMES.index(name)]


def test_the_rows_of_mjcf_files_are_what_they_say() -> None:
    """At least ten files; each of the installed gymnasium that has a row."""
    pytest.importorskip("mujoco")
    assert len(NAMES) - len(robot_names()) >= 10
    files = [path for path in gymnasium_files() if path.name in NAMES]
    for path, line in zip(files, rows_of_files(files), strict=True):
        assert line.split(" | ")[:4] == ROWS[NAMES.index(path.name)].split(" | ")[:4]


def test_only_long_lists_are_shortened() -> None:
    """Two names stay; of four the last two are counted."""
    assert short("joints a, b: soft") == "joints a, b: soft"
    assert short("joints a, b, c, d: soft") == "joints a, b and 2 more: soft"
