"""What the README shows is true."""

import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from taskopt.cli import app

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
COMMANDS = [
    line for block in re.findall(r"```sh\n(.*?)```", README, flags=re.DOTALL) for line in block.splitlines()
]


@pytest.mark.parametrize("snippet", SNIPPETS, ids=lambda snippet: snippet.strip().splitlines()[0][:40])
def test_snippets_run(snippet: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Every Python block of the README runs as it stands and prints something."""
    exec(compile(snippet, "README.md", "exec"), {})
    assert capsys.readouterr().out


def test_a_hierarchy_takes_five_lines() -> None:
    """A hierarchy is built, resolved and certified in five lines, and the answer is what it says."""
    first = SNIPPETS[0].strip().splitlines()
    assert len([line for line in first if line]) <= 5
    scope: dict = {}
    exec(SNIPPETS[0], scope)
    np.testing.assert_allclose(scope["answer"].x, [1.0, 1.0, 0.5], atol=1e-9)
    assert scope["answer"].kkt_met()


def test_set_up_takes_two_commands_of_one_line() -> None:
    """One line installs and runs the main job, one installs and passes the tests."""
    run, test = COMMANDS[:2]
    assert run.startswith("python3 -m venv")
    assert run.endswith("taskopt run tasks/panda_circle.py")
    assert test.endswith("-m pytest -n auto --dist worksteal")


@pytest.mark.parametrize("line", [line for line in COMMANDS if line.startswith("taskopt")])
def test_commands_are_known(line: str) -> None:
    """Every command shown has its name, its options and its scenario file."""
    words = shlex.split(line, comments=True)[1:]
    result = CliRunner().invoke(app, [words[0], "--help"])
    assert result.exit_code == 0
    assert all(option in result.output for option in words if option.startswith("-"))
    assert all((ROOT / word).is_file() for word in words if word.endswith(".py"))


def test_the_citation_is_of_this_version() -> None:
    """CITATION.cff states the version, the licence and the keywords of the package."""
    lines = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"version: {project['version']}" in lines
    assert f"license: {project['license']}" in lines
    assert [line.removeprefix("  - ") for line in lines[lines.index("keywords:") + 1 :]] == project[
        "keywords"
    ]
