"""Campaigns: what a kill leaves, other conditions, and processes that crash, hang or print."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from taskopt.bench.comparison import campaign
from taskopt.bench.comparison.campaign import FILE, Campaign, carry_out, spread, standard_resolvers
from taskopt.bench.comparison.catalogue import problem_set
from taskopt.bench.comparison.results import read_results
from taskopt.bench.comparison.trial import Row, without_answer
from taskopt.bench.comparison.worker import Cell, Worker
from taskopt.errors import InvalidValue, UnknownName

PLAN = Campaign(("contradicting",), ("active-set", "hqp/daqp"), ("cold",), repeats=1, sequences=8)
BAD = """
import os, sys, time
import numpy as np
from taskopt.hierarchy.qp import Solution
from taskopt.hierarchy.status import Status
from taskopt.solver.registry import register_solver, solver

def crash(qp, accuracy):
    os._exit(3)

def hang(qp, accuracy):
    time.sleep(600)

def talk(qp, accuracy):
    print("a banner")
    os.write(1, b"another banner")
    return solver("daqp")(qp, accuracy)

def odd(qp, accuracy):
    raise ZeroDivisionError("odd solver")

for function in (crash, hang, talk, odd):
    register_solver(function.__name__, function)
"""


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Cell]:
    """Cells that a stand-in of the worker is asked, which answers at once."""
    cells: list[Cell] = []

    def ask(self: Worker, cell: Cell, length: int) -> list[Row]:
        cells.append(cell)
        return [without_answer(index, "CRASHED", cell.resolver) for index in range(length)]

    monkeypatch.setattr(Worker, "ask", ask)
    return cells


def finish(plan: Campaign, folder: Path) -> int:
    return len([*carry_out(plan, folder)])


def test_a_second_run_has_nothing_left_to_do(tmp_path: Path, asked: list[Cell]) -> None:
    """Every cell is asked once, whoever runs how often."""
    finish(PLAN, tmp_path)
    assert len(asked) == len(set(asked)) == 16
    finish(PLAN, tmp_path)
    assert len(asked) == 16
    assert len(read_results(tmp_path)) == 16


@pytest.mark.parametrize("kept", [0.05, 0.5, 0.99])
def test_a_kill_loses_only_the_line_that_was_being_written(
    tmp_path: Path, asked: list[Cell], kept: float
) -> None:
    """A file that is cut anywhere is completed to the same rows."""
    finish(PLAN, tmp_path)
    whole = (tmp_path / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(whole[: int(kept * len(whole))])
    asked.clear()
    finish(PLAN, tmp_path)
    assert 0 < len(asked) <= 16
    again = [line for line in (tmp_path / FILE).read_bytes().splitlines() if b'"cell"' in line]
    assert sorted(again) == sorted(line for line in whole.splitlines() if b'"cell"' in line)


def test_an_interrupted_run_keeps_what_is_done(tmp_path: Path, asked: list[Cell]) -> None:
    """Closing the generator, as Ctrl-C does, leaves whole lines."""
    steps = carry_out(PLAN, tmp_path)
    for _ in range(5):
        next(steps)
    steps.close()
    finish(PLAN, tmp_path)
    assert len(asked) == len(set(asked)) == 16


def test_rows_of_other_conditions_are_not_mixed(
    tmp_path: Path, asked: list[Cell], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another version, another number of repeats or other problems end in one sentence."""
    finish(PLAN, tmp_path)
    changed = replace(PLAN, repeats=2)
    with pytest.raises(InvalidValue, match="repeats \\(1 → 2\\)"):
        finish(changed, tmp_path)
    monkeypatch.setattr(campaign, "versions", lambda: {"numpy": "0.1"})
    with pytest.raises(InvalidValue, match=r"numpy: .* → 0\.1"):
        finish(PLAN, tmp_path)
    monkeypatch.undo()
    lines = (tmp_path / FILE).read_text().splitlines()
    first = json.loads(lines[0])
    first["conditions"]["sets"]["contradicting"]["checksum"] = "0"
    (tmp_path / FILE).write_text("\n".join([json.dumps(first), *lines[1:]]) + "\n")
    with pytest.raises(InvalidValue, match="the problems of set contradicting"):
        finish(PLAN, tmp_path)


def test_mistakes_are_named_before_anything_runs() -> None:
    """Sets, resolvers and settings that are not there."""
    with pytest.raises(UnknownName, match="no resolver named 'hqp/dapq'"):
        Campaign(resolvers=("hqp/dapq",))
    with pytest.raises(InvalidValue, match="no setting 'hot'"):
        Campaign(settings=("hot",))
    with pytest.raises(UnknownName, match="no problem set named 'tiny'"):
        Campaign(("tiny",)).problem_sets()
    with pytest.raises(InvalidValue, match="deadline"):
        Campaign(deadline=0.0)


def test_sequences_are_spread_evenly_over_a_set() -> None:
    """Three of seven are the first, the third and the fifth; there are never more than there are."""
    found = Campaign(("small",)).problem_sets()["small"].sequences[:7]
    assert spread(found, 3) == [found[0], found[2], found[4]]
    assert spread(found, 20) == list(found)
    plans = [Campaign(("small",), ("pinv",), ("cold",), full=full, sequences=2) for full in (False, True)]
    assert [len([*plan.cells(plan.problem_sets())]) for plan in plans] == [2, 25]


def test_settings_that_change_nothing_are_left_out() -> None:
    """A cascade uses no memory, a formula no solver."""
    plan = Campaign(("small",), ("active-set", "hqp/daqp", "pinv"))
    pairs = {(cell.resolver, cell.setting) for cell, _ in plan.cells(plan.problem_sets())}
    assert pairs == {
        ("active-set", "cold"), ("active-set", "warm"), ("hqp/daqp", "cold"), ("hqp/daqp", "defaults"),
        ("pinv", "cold"), ("pinv", "warm"),
    }  # fmt: skip
    assert {"active-set", "hqp/daqp", "wqp/clarabel"} <= set(standard_resolvers())
    assert any(name.startswith("cvxpy/") for name in standard_resolvers(full=True))


def test_a_set_in_a_file_is_run_whole(tmp_path: Path) -> None:
    """Each of its problems is a sequence, and none is left out."""
    problem_set("contradicting").save(tmp_path / "mine.npz")
    name = str(tmp_path / "mine.npz")
    plan = Campaign((name,), ("pinv",), ("cold",), sequences=3)
    assert len([*plan.cells(plan.problem_sets())]) == 8
    inside = Campaign(("contradicting",), ("pinv",), ("cold",), sequences=3)
    assert len([*inside.cells(inside.problem_sets())]) == 3


def test_nothing_to_run_and_a_file_for_a_folder_are_said(tmp_path: Path, asked: list[Cell]) -> None:
    """Instead of a folder without rows, and of a traceback."""
    with pytest.raises(InvalidValue, match="nothing to run: warm is as cold"):
        finish(Campaign(("small",), ("hqp/daqp",), ("warm",)), tmp_path / "out")
    (tmp_path / "file").touch()
    with pytest.raises(InvalidValue, match="file is a file; rows go to a folder"):
        finish(Campaign(("small",), ("pinv",), ("cold",)), tmp_path / "file")
    assert not asked


@pytest.fixture
def worker(tmp_path: Path) -> Callable[..., Worker]:
    """Makes workers that know the bad solvers."""
    (tmp_path / "bad.py").write_text(BAD)
    return lambda deadline: Worker(tmp_path / "output.txt", deadline, 1, (str(tmp_path / "bad.py"),))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "note"), [("crash", "printed nothing"), ("odd", "ZeroDivisionError: odd solver")]
)
def test_a_process_that_dies_is_said(worker: Callable[..., Worker], name: str, note: str) -> None:
    """The rows say what is known, and the next cell is answered."""
    asked = worker(60.0)
    rows: list[dict[str, Any]] = asked.ask(Cell("small", "ties 0", f"hqp/{name}", "cold"), 2)
    assert [row["status"] for row in rows] == ["CRASHED", "NOT RUN"]
    assert note in rows[0]["note"]
    rows = asked.ask(Cell("small", "ties 0", "hqp/daqp", "cold"), 2)
    assert [row["verdict"] for row in rows] == ["proven", "proven"]
    asked.end()


@pytest.mark.slow
def test_a_solver_that_hangs_is_ended(worker: Callable[..., Worker], monkeypatch: pytest.MonkeyPatch) -> None:
    """It has its deadline, and no longer."""
    monkeypatch.setattr("taskopt.bench.comparison.worker._FIRST", 1.0)
    asked = worker(1.0)
    rows = asked.ask(Cell("small", "ties 0", "hqp/hang", "cold"), 2)
    assert [row["status"] for row in rows] == ["DEADLINE", "NOT RUN"]
    asked.end()


@pytest.mark.slow
def test_no_banner_reaches_the_terminal(
    worker: Callable[..., Worker], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """What a solver prints, from Python or from C, goes to the file."""
    asked = worker(60.0)
    rows = asked.ask(Cell("small", "well scaled 0", "hqp/talk", "cold"), 2)
    asked.end()
    assert [row["status"] for row in rows] == ["SOLVED", "SOLVED"]
    assert "banner" not in "".join(capfd.readouterr())
    assert b"another banner" in (tmp_path / "output.txt").read_bytes()
