"""The table of docs/chapter.md: it has every number of the chapter, and all that it names exists and runs."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "chapter.md"
LAST = {"equation": 128, "figure": 27, "example": 6, "problem": 23}
KINDS = {"(": "equation", "Fig. ": "figure", "Example ": "example", "Problem ": "problem"}
NOT_BUILT = "not yet built"
CONCEPTUAL = {f"3.{n}" for n in (1, 2, 7, 11, 12, 14, 21, 22)}


class Entry(NamedTuple):
    """A row of the table."""

    kind: str
    number: str
    code: str
    test: str

    def __str__(self) -> str:
        return f"{self.kind} {self.number}"


def entries(page: str) -> list[Entry]:
    """The rows of the table, in order."""
    row = r"^\| (\(|Fig\. |Example |Problem )(3\.\d+)\)? \| .*? \| `?(.*?)`? \| `?(.*?)`? \|$"
    return [Entry(KINDS[kind], *rest) for kind, *rest in re.findall(row, page, re.MULTILINE)]


TABLE = entries(PAGE.read_text(encoding="utf-8"))
BUILT = [entry for entry in TABLE if entry.code != NOT_BUILT]


def faults_of_numbers(table: list[Entry]) -> list[str]:
    """Numbers of the chapter that are missing or stand twice."""
    found = [str(entry) for entry in table]
    wanted = [f"{kind} 3.{n}" for kind, last in LAST.items() for n in range(1, last + 1)]
    return sorted(set(wanted) ^ set(found)) + sorted({name for name in found if found.count(name) > 1})


def exists(code: str) -> bool:
    """True for a file of this checkout, and for a name inside the package."""
    if code.endswith(".py"):
        return (ROOT / code).is_file()
    parts = ["taskopt", *code.split(".")]
    for split in range(len(parts) - 1, 0, -1):
        try:
            owner = import_module(".".join(parts[:split]))
        except ModuleNotFoundError:
            continue
        for name in parts[split:]:
            if not hasattr(owner, name):
                return False
            owner = getattr(owner, name)
        return True
    return False


@cache
def marks(file: str) -> dict[str, set[tuple[str, str]]]:
    """The numbers that the tests of a file are marked with, by the name of the test."""
    tree = ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8"))
    return {
        node.name: set(_marks_of(node))
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }


def _marks_of(node: ast.FunctionDef) -> Iterator[tuple[str, str]]:
    """Yield kind and number of each mark of a test."""
    for decorator in node.decorator_list:
        if isinstance(decorator, ast.Call):
            kind = ast.unparse(decorator.func).rsplit(".", 1)[-1]
            if kind in LAST:
                yield from ((kind, ast.literal_eval(number)) for number in decorator.args)


def carries_its_mark(entry: Entry) -> bool:
    """True if the test of a row exists and is marked with the number of the row."""
    file, _, test = entry.test.partition("::")
    return (ROOT / "tests" / file).is_file() and (entry.kind, entry.number) in marks(file).get(test, set())


def test_no_number_is_missing() -> None:
    """Each of 128 equations, 27 figures, 6 examples and 23 problems has one row."""
    assert faults_of_numbers(TABLE) == []
    assert {(entry.kind, entry.number) for entry in TABLE if entry.code == NOT_BUILT} == set()


@pytest.mark.parametrize("entry", BUILT, ids=str)
def test_what_implements_an_entry_exists(entry: Entry) -> None:
    """The function, class or scenario is there, and the test is there and carries the mark."""
    assert exists(entry.code), entry.code
    assert carries_its_mark(entry), entry.test


def test_drawn_figures_lead_to_their_picture_and_conceptual_ones_to_a_test() -> None:
    """A figure is drawn by a function or a scenario, unless it only explains a concept."""
    figures = [entry for entry in TABLE if entry.kind == "figure"]
    drawn = {entry.number for entry in figures if entry.code.startswith(("figures.", "tasks/"))}
    assert drawn | CONCEPTUAL == {entry.number for entry in figures}
    assert not drawn & CONCEPTUAL
    page = PAGE.read_text(encoding="utf-8")
    assert all(f"figures/fig_{number.replace('.', '_')}.png" in page for number in drawn)


@pytest.mark.slow
def test_every_test_of_the_table_is_collected() -> None:
    """Pytest finds each of them, so that it runs with the suite."""
    tests = sorted({f"tests/{entry.test}" for entry in BUILT})
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", *tests]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    collected = {line.split("[")[0] for line in done.stdout.splitlines()}
    assert set(tests) <= collected


@pytest.mark.parametrize(
    ("old", "new"),
    [("| (3.30) |", "| (3.31) |"), ("| Problem 3.23 |", "| Problem 3.24 |"), ("| Fig. 3.5 |", "| Fig 3.5 |")],
)
def test_a_number_that_is_missing_is_caught(old: str, new: str) -> None:
    """A row too few, too many, or twice is named."""
    page = PAGE.read_text(encoding="utf-8")
    assert page.count(old) == 1
    assert faults_of_numbers(entries(page.replace(old, new))) != []


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"code": "kinematics.analysis.jacobians.geometric_jacobians"}, "code"),
        ({"code": "tasks/fig_3_14.py"}, "code"),
        ({"test": "chapter/test_problems.py::test_problem_3_99"}, "test"),
        ({"test": "chapter/test_problems.py::test_problem_3_1"}, "test"),  # it is there, with another mark
    ],
)
def test_an_entry_that_leads_nowhere_is_caught(change: dict[str, str], says: str) -> None:
    """A name, a scenario, a test or a mark that is not there."""
    (entry,) = (entry for entry in TABLE if str(entry) == "equation 3.30")
    changed = entry._replace(**change)
    assert not (exists(changed.code) if says == "code" else carries_its_mark(changed))
