"""Sweeps: their cases, figures, what a kill leaves, and workers that die."""

import csv
import json
import signal
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from taskopt.bench.sweep.case import FIGURES, run_case, start
from taskopt.bench.sweep.grid import Case, Grid, axis
from taskopt.bench.sweep.report import write_all
from taskopt.bench.sweep.sweep import FILE, Sweep, carry_out, read_sweep
from taskopt.bench.sweep.table import table, timeless
from taskopt.errors import InvalidValue, NotSolved, UnknownName
from taskopt.loop.run import run
from taskopt.loop.scenario import load_scenario
from taskopt.loop.variation import varied

ARM = """
import os
from pathlib import Path
from taskopt import Function, JointTask, PositionTask, Scenario, Stack, planar_arm

DEATHS = Path(__file__).with_suffix(".deaths")
DEATHS.mkdir(exist_ok=True)

def target(t):
    for death in range({deaths} if t > 0.015 else 0):
        try:
            (DEATHS / str(death)).touch(exist_ok=False)  # two workers never count the same one
        except FileExistsError:
            continue
        os._exit(9)
    return [0.8, 0.3 + 0.1 * t, 0.0]

tip = PositionTask("tip", target=Function(target), gain=10.0, axes="xy", name="hand")
scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.3], lower=-2.0, upper=2.0), q0=[0.1, 0.5, 0.2],
    stack=Stack([[tip], [JointTask(name="rest")]]), duration=0.03, dt=0.005,
)
"""
AXES = axis("hand.gain=1,10,100"), axis("rest.weight=1")
GRID = Grid(AXES, seeds=2, resolvers=("active-set", "pinv"))


@pytest.fixture
def arm(tmp_path: Path) -> str:
    (tmp_path / "arm.py").write_text(ARM.format(deaths=0))
    return str(tmp_path / "arm.py")


def finish(sweep: Sweep, folder: Path, jobs: int = 1, scheduler: str | None = None) -> int:
    """Carry a sweep out, and return the number of cases that were computed."""
    steps = [*carry_out(sweep, folder, jobs, scheduler)]
    assert steps[-1][0] == steps[-1][1]
    return len(steps) - 1


def shown(folder: Path, grid: Grid = GRID) -> list[object]:
    """All that does not depend on time."""
    done = read_sweep(folder, grid)
    return [table(done, grid).rows, [timeless(figures) for figures in done.values()]]


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a.w=1e-3..1e3:3", ("0.001", "1", "1000")),
        ("a.w=0..1:3", ("0", "0.5", "1")),
        ("a.w=-1..1:2", ("-1", "1")),
        ("a.w=2..8:3", ("2", "5", "8")),
        ("a.w=0.5", ("0.5",)),
        ("a.axes=xyz,xy", ("xyz", "xy")),
        ("a.target=[0, 1]", ("[0, 1]",)),
    ],
)
def test_values_are_read(text: str, values: tuple[str, ...]) -> None:
    """Ranges over a decade are logarithmic, others even; lists are split at commas."""
    assert axis(text).values == values


@pytest.mark.parametrize(
    "text", ["a.w", "=1", "a.w=", "a.w=1..2", "a.w=1..2:1", "a.w=x..2:3", "a.w=1..inf:3"]
)
def test_other_forms_are_refused(text: str) -> None:
    """The message has the text, and an example."""
    with pytest.raises(InvalidValue, match="--set"):
        axis(text)


def test_every_combination_is_a_case_once() -> None:
    """3 × 1 values, 2 resolvers, 2 seeds; names that are given twice are refused."""
    cases = [*GRID.cases()]
    assert len(cases) == len(set(cases)) == 12
    with pytest.raises(InvalidValue, match=r"named twice: hand\.gain"):
        Grid((AXES[0], AXES[0]))
    with pytest.raises(InvalidValue, match="at least one seed"):
        Grid(AXES, seeds=0)


def test_figures_are_those_of_the_run(arm: str) -> None:
    """The root mean square of the tip's error, the last and the largest, from the steps themselves."""
    case = Case(("hand.gain=3", "rest.weight=1"), 0, "active-set")
    figures = run_case(arm, case, None, None, 0.1, 3)
    steps = [*run(varied(load_scenario(arm), case.settings), "active-set")]
    errors = [float(np.hypot(*step.errors["hand"])) for step in steps]
    assert figures["tracking"] == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    assert (figures["tracking_max"], figures["tracking_last"]) == pytest.approx((max(errors), errors[-1]))
    assert (figures["ticks"], figures["claimed"], figures["judged"]) == (6, 1.0, 3)
    assert figures.keys() == FIGURES.keys()
    other = run_case(arm, case._replace(settings=("hand.gain=30", "rest.weight=1")), None, None, 0.1, 3)
    assert other["tracking_last"] < 0.9 * figures["tracking_last"]


def test_starts_are_near_and_inside(arm: str) -> None:
    """Seed 0 is the scenario's own; others differ by at most the spread, and keep the limits."""
    scenario = load_scenario(arm)
    assert start(scenario, 0, 0.5).tolist() == scenario.start.tolist()
    starts = np.array([start(scenario, seed, 1.9) for seed in range(1, 20)])
    assert len({tuple(q) for q in starts}) == 19
    assert np.abs(starts - scenario.start).max() <= 1.9
    assert np.abs(starts).max() == 2.0


@pytest.mark.slow
def test_a_sweep_computes_only_what_is_missing(arm: str, tmp_path: Path) -> None:
    """A sweep that was interrupted and cut goes on, and shows what an undisturbed one shows."""
    sweep = Sweep(arm, GRID)
    assert finish(sweep, tmp_path / "whole") == 12
    assert finish(sweep, tmp_path / "whole") == 0
    steps = carry_out(sweep, tmp_path / "cut", jobs=1)
    for _ in range(9):
        next(steps)
    steps.close()
    file = tmp_path / "cut" / FILE
    file.write_bytes(file.read_bytes()[:-20])
    assert finish(sweep, tmp_path / "cut") == 12 - 7
    assert shown(tmp_path / "cut") == shown(tmp_path / "whole")
    more = Sweep(arm, Grid((axis("hand.gain=1,10,100,150"), AXES[1]), 2, GRID.resolvers))
    assert finish(more, tmp_path / "whole") == 4


def test_other_conditions_are_not_mixed(arm: str, tmp_path: Path) -> None:
    """Another length, or another text of the scenario, ends in one sentence."""
    grid = Grid((axis("hand.gain=1"),))
    finish(Sweep(arm, grid), tmp_path)
    with pytest.raises(InvalidValue, match=r"duration: None → 0\.01"):
        finish(Sweep(arm, grid, duration=0.01), tmp_path)
    Path(arm).write_text(Path(arm).read_text() + "\n")
    with pytest.raises(InvalidValue, match="sha256"):
        finish(Sweep(arm, grid), tmp_path)


def test_mistakes_are_named_before_anything_runs(arm: str) -> None:
    """A parameter that is not there, a value that it does not take, a resolver, a spread."""
    with pytest.raises(InvalidValue, match="gain 1000 1/s of 'hand' is too large"):
        Sweep(arm, Grid((axis("rest.weight=1"), axis("hand.gain=1,1000"))))
    with pytest.raises(UnknownName, match=r"hand\.gian"):
        Sweep(arm, Grid((axis("hand.gian=1,2"),)))
    with pytest.raises(UnknownName, match="hqp/dapq"):
        Sweep(arm, Grid((axis("hand.gain=1"),), resolvers=("hqp/dapq",)))
    with pytest.raises(InvalidValue, match="spread"):
        Sweep(arm, Grid(()), spread=0.0)


def test_a_run_that_ends_early_is_counted(tmp_path: Path) -> None:
    """Limits that contradict each other from some tick on end the run; the reason is kept and counted."""
    conflict = (Path(__file__).parents[3] / "tasks" / "planar_conflict.py").read_text()
    (tmp_path / "wall.py").write_text(conflict.replace('on_conflict="brake"', 'on_conflict="raise"'))
    case, grid = Case((), 0, "active-set"), Grid(())
    figures = run_case(str(tmp_path / "wall.py"), case, 0.6, None, 0.1, 0)
    assert 200 < float(figures["ticks"]) < 300
    assert "exclude each other" in str(figures["stopped"])
    assert table({case: figures}, grid).rows[0][:3] == ("active-set", "1", "1")


@pytest.mark.slow
def test_table_plot_and_cases_are_written(arm: str, tmp_path: Path) -> None:
    """One row for each combination of values and resolver, and one of each case."""
    finish(Sweep(arm, GRID), tmp_path)
    text, files = write_all(tmp_path, GRID)
    assert [file.name for file in files] == ["sweep.md", "sweep.csv", "sweep.svg"]
    assert text.count("| active-set |") == text.count("| pinv |") == 3
    with files[1].open(newline="") as file:
        rows = [*csv.DictReader(file)]
    assert len(rows) == 12
    assert {row["hand.gain"] for row in rows} == {"1", "10", "100"}
    assert "<svg" in files[2].read_text()
    letters = Grid((axis("hand.axes=xy,x"),))
    finish(Sweep(arm, letters), tmp_path / "letters")
    assert [file.name for file in write_all(tmp_path / "letters", letters)[1]] == ["sweep.md", "sweep.csv"]


@pytest.mark.slow
def test_workers_that_die_lose_nothing(arm: str, tmp_path: Path) -> None:
    """Two deaths in the middle give the same figures; one that always dies is said, and the rest kept."""
    finish(Sweep(arm, GRID), tmp_path / "whole")
    (tmp_path / "dying.py").write_text(ARM.format(deaths=2))
    dying = Sweep(str(tmp_path / "dying.py"), GRID)
    assert finish(dying, tmp_path / "dying", jobs=2) == 12
    assert len([*(tmp_path / "dying.deaths").iterdir()]) == 2
    assert shown(tmp_path / "dying") == shown(tmp_path / "whole")
    (tmp_path / "dead.py").write_text(ARM.format(deaths=1000))
    with pytest.raises(NotSolved, match="12 of 12 cases are missing"):
        finish(Sweep(str(tmp_path / "dead.py"), GRID), tmp_path / "dead", jobs=2)


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same(arm: str, tmp_path: Path) -> None:
    """A cluster of two processes, of which one dies in the middle, gives what one process gives."""
    distributed = pytest.importorskip("distributed")
    finish(Sweep(arm, GRID), tmp_path / "whole")
    (tmp_path / "dying.py").write_text(ARM.format(deaths=1))
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        dying = Sweep(str(tmp_path / "dying.py"), GRID)
        assert finish(dying, tmp_path / "dask", scheduler=cluster.scheduler_address) == 12
    assert len([*(tmp_path / "dying.deaths").iterdir()]) == 1
    assert shown(tmp_path / "dask") == shown(tmp_path / "whole")
    lines = [json.loads(line) for line in (tmp_path / "dask" / FILE).read_text().splitlines()]
    assert len([line for line in lines if "case" in line]) == 12


KILLED = """
import os, sys
from pathlib import Path
from taskopt.bench.sweep.grid import Grid, axis
from taskopt.bench.sweep.sweep import Sweep, carry_out

grid = Grid((axis("hand.gain=1,10,100"), axis("rest.weight=1")), seeds=2, resolvers=("active-set", "pinv"))
sweep, scheduler = Sweep(sys.argv[1], grid), sys.argv[3] if len(sys.argv) > 3 else None
for done, _ in carry_out(sweep, Path(sys.argv[2]), 2, scheduler):
    if done == 6:
        os.kill(os.getpid(), 9)
"""


@pytest.mark.slow
@pytest.mark.parametrize("cluster", [False, True], ids=["processes", "Dask"])
def test_a_sweep_that_is_killed_halfway_goes_on(arm: str, tmp_path: Path, cluster: bool) -> None:
    """Its process gets SIGKILL after 6 of 12 cases; the next one computes the others, to the same table."""
    finish(Sweep(arm, GRID), tmp_path / "whole")
    with ExitStack() as stack:
        address = []
        if cluster:
            distributed = pytest.importorskip("distributed")
            made = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
            address = [stack.enter_context(made).scheduler_address]
        command = [sys.executable, "-c", KILLED, arm, str(tmp_path / "killed"), *address]
        assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
        assert len(read_sweep(tmp_path / "killed", GRID)) == 6
        assert finish(Sweep(arm, GRID), tmp_path / "killed", jobs=2, scheduler=(address or [None])[0]) == 6
    assert shown(tmp_path / "killed") == shown(tmp_path / "whole")
