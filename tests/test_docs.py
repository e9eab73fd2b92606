"""What the pages in docs/ show is true: snippets run and print what stands beside them, names are known."""

import json
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stdout
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import taskopt
from taskopt import Stack
from taskopt.cli import app
from taskopt.kinematics.limit import ObstacleLimit
from taskopt.resolver.registry import resolver_names

ROOT = Path(__file__).parents[1]
PACKAGE = Path(taskopt.__file__).parent
PAGES = sorted((ROOT / "docs").glob("*.md"))
NOTEBOOKS = [
    pytest.param(path, marks=[pytest.mark.slow] if path.stem == "log" else [], id=path.stem)
    for path in sorted((ROOT / "docs").glob("*.ipynb"))
]
REFERENCE = sorted((ROOT / "docs" / "reference").glob("*.md"))
PRINTS = "# prints "


def text(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def blocks(source: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", source, flags=re.DOTALL | re.MULTILINE)


def promised(snippet: str) -> list[str]:
    return [line.split(PRINTS)[1].strip() for line in snippet.splitlines() if PRINTS in line]


def printed_by_program(snippet: str, folder: Path) -> str:
    """What a snippet prints that is a file of its own, since it starts other processes."""
    (folder / "program.py").write_text(snippet, "utf-8")
    done = subprocess.run(
        [sys.executable, "program.py"], cwd=folder, capture_output=True, text=True, check=False
    )
    return done.stdout if done.returncode == 0 else done.stderr


def printed(snippet: str, scope: dict[str, Any]) -> str:
    with redirect_stdout(StringIO()) as said:
        exec(compile(snippet, "snippet", "exec"), scope)
    return said.getvalue()


def broken_promises(source: str, folder: Path) -> list[str]:
    """Snippets that print something else than stands beside them, or say nothing; in order, in one scope.

    A snippet with a guarded main part is a program of its own.
    """
    scope: dict[str, Any] = {}
    faults = []
    for snippet in blocks(source, "python"):
        alone = 'if __name__ == "__main__":' in snippet
        said = (printed_by_program(snippet, folder) if alone else printed(snippet, scope)).splitlines()
        if promised(snippet) and promised(snippet) != said:
            faults.append(f"{promised(snippet)} is {said}")
        if not said and "assert" not in snippet:
            faults.append(f"nothing shown by: {snippet.splitlines()[0]}")
    return faults


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::taskopt.DroppedWarning")  # pages read files that state little
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_snippets_print_what_stands_beside_them(page: Path, tmp_path: Path) -> None:
    """The Python blocks of a page run one after the other, and none of them shows nothing."""
    assert broken_promises(text(page), tmp_path) == []


@pytest.mark.parametrize(
    "source",
    [
        "```python\nprint(1 + 1)  # prints 3\n```\n",
        "```python\nx = 1\n```\n",
        '```python\nif __name__ == "__main__":\n    print(1 + 1)  # prints 3\n```\n',
        '```python\nif __name__ == "__main__":\n    print(1 / 0)  # prints 3\n```\n',
    ],
)
def test_a_page_that_is_wrong_is_caught(source: str, tmp_path: Path) -> None:
    """A wrong result beside a line, a snippet without one, and a program that is wrong or ends early."""
    assert broken_promises(source, tmp_path)


def stale_cells(notebook: str) -> list[str]:
    """Cells of a notebook whose stored output is not what they print; in order, in one scope."""
    scope: dict[str, Any] = {}
    cells = [cell for cell in json.loads(notebook)["cells"] if cell["cell_type"] == "code"]
    faults = []
    for cell in cells:
        stored = "".join(line for output in cell["outputs"] for line in output["text"])
        if printed("".join(cell["source"]), scope) != stored:
            faults.append("".join(cell["source"]))
    return faults if any(cell["outputs"] for cell in cells) else ["no cell shows anything"]


@pytest.mark.parametrize("notebook", NOTEBOOKS)
def test_a_notebook_shows_what_its_cells_print(notebook: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The code cells run one after the other, and print the output that is stored with them."""
    monkeypatch.setenv("MPLBACKEND", "Agg")
    assert stale_cells(text(notebook)) == []


@pytest.mark.parametrize("stored", [[], [{"text": ["3\n"]}]])
def test_a_stale_notebook_is_caught(stored: list[dict[str, list[str]]]) -> None:
    """A stored output that is another one, or none."""
    cell = {"cell_type": "code", "source": ["print(1 + 1)"], "outputs": stored}
    assert stale_cells(json.dumps({"cells": [cell]}))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_are_known(page: Path) -> None:
    """Every command shown has its name, its options, its resolvers and its files."""
    lines = [line for block in blocks(text(page), "sh") for line in block.splitlines()]
    for line in (line for line in lines if line.startswith("taskopt")):
        words = shlex.split(line, comments=True)[1:]
        names = words[: 2 if words[0] == "bench" else 1]
        result = CliRunner().invoke(app, [*names, "--help"])
        assert result.exit_code == 0, line
        assert all(word in result.output for word in words if word.startswith("-"))
        assert all((ROOT / word).is_file() for word in words if word.endswith(".py"))
        asked = [after for word, after in pairwise(words) if word in ("-r", "--resolver")]
        assert set(asked) <= set(resolver_names())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_files_are_there(page: Path) -> None:
    """Pictures and links to files of this checkout lead somewhere; pictures have less than 300 kB."""
    for target in re.findall(r"\]\(([^)#:]+)\)", text(page)):
        file = page.parent / target
        assert file.exists(), target
        assert file.suffix != ".png" or file.stat().st_size < 300_000


def test_every_row_of_the_table_of_objectives_runs_and_has_its_figure() -> None:
    """The code line is evaluated after the snippets; the last column has a scenario and its picture."""
    page = ROOT / "docs" / "objectives.md"
    scope: dict[str, Any] = {}
    for snippet in blocks(text(page), "python"):
        exec(compile(snippet, "snippet", "exec"), scope)
    scope["ObstacleLimit"] = ObstacleLimit
    rows = [
        [cell.strip() for cell in line.split(" | ")] for line in text(page).splitlines() if "](pic" in line
    ]
    rows = [cells for cells in rows if len(cells) == 7]
    assert len(rows) == 15
    for *_, code, figure in rows:
        made = eval(code.strip("`"), scope)
        if isinstance(made, Stack):
            tip = "tip(" in code
            made.at(scope["stretched" if tip else "at"], dt=1e-3)
        match = re.match(r"\[`(\w+)`\]\(pictures/(\w+)\.png\)", figure)
        assert match
        assert match[1] == match[2]
        assert (ROOT / "tasks" / f"{match[1]}.py").is_file()


def missing_names(page: str) -> list[str]:
    """Files in code marks that are not there, and names in code marks that no source file mentions."""
    source = "\n".join(path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py"))
    marked = set(re.findall(r"`([A-Za-z_./]+)`", page))
    files = {name for name in marked if name.endswith((".py", ".md", ".toml")) or "/" in name}
    here = [PACKAGE.parent, ROOT]
    absent = [name for name in files if not any((folder / name).exists() for folder in here)]
    known = {name for name in marked - files if all(part in source for part in name.split("."))}
    programs = {"lint-imports", "taskopt warmup", "explain"}
    return sorted([*absent, *(marked - files - known - programs)])


def test_the_architecture_names_what_is_there() -> None:
    """Each file, function and class that the page names exists."""
    assert missing_names(text(ROOT / "docs" / "architecture.md")) == []


def test_a_name_that_is_gone_is_caught() -> None:
    """A file and a function that do not exist."""
    assert missing_names("`taskopt/tick.py` has `normal_tick_of_old`") == [
        "normal_tick_of_old",
        "taskopt/tick.py",
    ]


def missing_in_reference(pages: str) -> list[str]:
    """Modules with public names that no page of the reference shows, or more than one."""
    shown = re.findall(r"^\.\. public-names:: (\S+)$", pages, flags=re.MULTILINE)
    homes = {taskopt._HOME[name] for name in taskopt.__all__}
    return sorted(home for home in homes if sum(f"{home}.".startswith(f"{part}.") for part in shown) != 1)


def test_the_reference_has_every_public_name_once() -> None:
    """Every module in which public names live is on one page of the reference."""
    assert missing_in_reference("".join(text(page) for page in REFERENCE)) == []


def test_a_module_that_the_reference_lacks_or_repeats_is_caught() -> None:
    """Without the page of limits, and with the page of errors twice."""
    pages = [text(page) for page in REFERENCE if page.stem != "limits"]
    assert missing_in_reference("".join(pages)) == ["taskopt.kinematics.limit"]
    assert "taskopt.errors" in missing_in_reference(
        "".join([*pages, text(ROOT / "docs" / "reference" / "errors.md")])
    )


def test_every_page_has_its_place() -> None:
    """The table of contents in docs/index.md names every page of the folder."""
    listed = set(re.findall(r"^[a-z_/]+$", text(ROOT / "docs" / "index.md"), flags=re.MULTILINE))
    pages = {page.stem for page in PAGES} | {f"reference/{page.stem}" for page in REFERENCE}
    assert pages - {"index"} == listed
