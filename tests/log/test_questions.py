"""A stranger's questions on a recorded run of a Panda, answered by commands, against the steps of the run."""

import re
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from typer.testing import CliRunner

from taskopt import (
    Controller,
    FrameTask,
    JointAccelerationLimit,
    JointTask,
    JointVelocityLimit,
    Stack,
    Step,
    find_conflict,
    load_scenario,
    open_log,
)
from taskopt.cli import app
from taskopt.compare import Comparison
from taskopt.errors import Infeasible
from taskopt.loop.run_log import RunLog
from taskopt.resolver.registry import resolver

DT = 1e-2
NAMES = ("active-set", "pinv")


class Recorded(NamedTuple):
    """The steps of both resolvers, and the file of the log."""

    steps: dict[str, list[Step]]
    path: str


@pytest.fixture(scope="module")
def panda(tmp_path_factory) -> Recorded:
    """The circle of the Panda, where the active set keeps limits and the closed form does not."""
    scenario = replace(load_scenario("tasks/panda_circle.py"), dt=DT)
    path, steps = tmp_path_factory.mktemp("panda") / "a.arrow", {name: [] for name in NAMES}
    with RunLog(scenario, [resolver(name) for name in NAMES], path) as log:
        for step in Comparison(scenario, NAMES, judged=1, log=log):
            steps[step.resolver].append(step)
    return Recorded(steps, str(path))


def command(*words: str) -> str:
    """Run a command and return what it prints."""
    done = CliRunner().invoke(app, list(words), catch_exceptions=False)
    assert done.exit_code == 0
    return done.output


def part(text: str, name: str) -> list[str]:
    """The lines of one resolver."""
    lines = text.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith(f"{name}:"))
    return [lines[start], *(line for line in lines[start + 1 :][: _indented(lines[start + 1 :])])]


def _indented(lines: list[str]) -> int:
    """The number of first lines that are indented."""
    return next((i for i, line in enumerate(lines) if not line.startswith("  ")), len(lines))


@pytest.mark.slow
def test_which_joints_met_a_limit_when_first_and_how_long(panda):
    """`show` names every limit of a joint that was active, with its first time and its time in all."""
    told = part(command("show", panda.path), "active-set")
    ticks: dict[str, list[float]] = {}
    for step in panda.steps["active-set"]:
        for row in step.resolution.active:
            ticks.setdefault(f"{row.name} {row.side}", []).append(step.t)
    assert any("panda_joint2 lower" in name for name in ticks)
    for name, times in ticks.items():
        (line,) = (line for line in told if line.startswith(f"  {name}:"))
        assert f"first at {times[0]:.6g} s" in line
        assert f"{len(times) * DT:.4g} s in all" in line
    assert sum("active " in line for line in told) == len(ticks)


@pytest.mark.slow
def test_what_it_cost_the_hand_with_the_price_and_its_unit(panda):
    """`show --joint` has the error of the hand in mm while the limit held it back, and the price."""
    told = part(command("show", panda.path, "--joint", "panda_joint2"), "active-set")
    steps = panda.steps["active-set"]
    price = max(
        abs(row.multiplier)
        for step in steps
        for row in step.resolution.active
        if "panda_joint2" in row.name and row.level == 1
    )
    (line,) = (line for line in told if f"price up to {price:.3g} [(m/s)² + (rad/s)²] per rad/s" in line)
    begin, length = map(float, re.search(r"from (\S+) s for (\S+) s", line).groups())
    during = [s for s in steps if begin - 1e-9 <= s.t < begin + length - 1e-9]
    worst = max(np.linalg.norm(step.errors["panda_hand"][:3]) for step in during)
    assert worst > 1e-3
    assert any(f"meanwhile panda_hand: error up to {1000 * worst:.4g} mm at " in line for line in told)


@pytest.mark.slow
def test_where_pinv_broke_which_limit_and_by_how_much(panda):
    """`show` and `report` name each limit that was broken, first and worst time, and by how much."""
    told, robot = part(command("show", panda.path), "pinv"), panda.steps["pinv"][0].hierarchy
    excess: dict[str, list[tuple[float, float]]] = {}
    for step in panda.steps["pinv"]:
        h = step.hierarchy
        for side, size, owner in (
            ("lower", h.box_lower - step.v, h.owner[0]),
            ("upper", step.v - h.box_upper, h.owner[1]),
        ):
            for j in np.flatnonzero(size > 1e-6 * np.maximum(1.0, np.abs(step.v))):
                name = f"{h.layout.owners[int(owner[j])]}/{h.layout.unknowns[j]} {side}"
                excess.setdefault(name, []).append((float(size[j]), step.t))
    assert len(excess) > 5
    assert robot.layout.n == 7
    for name, found in excess.items():
        (line,) = (line for line in told if line.startswith(f"  broke {name}:"))
        worst, at = max(found)
        assert f"first at {found[0][1]:.6g} s, {len(found) * DT:.4g} s in all" in line
        assert line.endswith(f"by up to {worst:.4g} rad/s at {at:.6g} s")
    q = np.array([step.q[1] for step in panda.steps["pinv"]])
    lowest = load_scenario("tasks/panda_circle.py").robot.position_lower[1]
    (line,) = (line for line in told if line.startswith("  broke position/panda_joint2 lower:"))
    assert f"by up to {lowest - q.min():.4g} rad" in line
    assert sum("broke " in line for line in told) == len(excess) + 1
    assert not any("broke" in line for line in part(command("show", panda.path), "active-set"))
    assert f"{lowest - q.min():.4g} rad" in command("report", panda.path)


@pytest.mark.slow
def test_what_another_weight_would_have_done_at_an_instant(panda, tmp_path):
    """`replay --at --set` has the velocities that a run sends which goes on from there with that weight."""
    tick = max(panda.steps["active-set"], key=lambda step: np.linalg.norm(step.errors["panda_hand"][:3]))
    weight = "panda_hand.weight=[1,1,1,0.1,0.1,0.1]"
    told = command("replay", panda.path, "--at", f"{tick.t}", "--set", weight)
    path = str(tmp_path / "b.arrow")
    words = ["--no-record", "--from", f"{panda.path}@{tick.t}", "--set", weight, "--duration", "5"]
    command("run", "tasks/panda_circle.py", *words, "--log", path)
    sent = open_log(path).array("x")[0]
    assert np.abs(sent - tick.v).max() > 1e-3
    for name, old, new in zip(tick.hierarchy.layout.unknowns, tick.v, sent, strict=True):
        told_old, told_new = map(float, re.search(rf"^{name}: (\S+) → (\S+)$", told, re.MULTILINE).groups())
        assert told_old == pytest.approx(old, abs=1e-7)
        assert told_new == pytest.approx(new, abs=1e-6)
    assert "Held back by:" in told


@pytest.mark.slow
def test_why_a_run_with_a_conflict_stopped(tmp_path):
    """`show --why` has the time, the limits that exclude each other, and the least that lets them agree."""
    robot, path = load_scenario("tasks/panda_circle.py").robot, tmp_path / "a.arrow"
    hand = FrameTask("panda_hand", target=(0.4, 0.3, 0.6), gain=4.0)
    limits = [JointVelocityLimit(), JointAccelerationLimit([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])]
    control = Controller(robot, Stack([[hand], [JointTask(gain=1.0)]], limits), dt=DT, log=path)
    q = robot.posture("middle")
    for k in range(30):
        q = robot.integrate(q, control.step(q, k * DT).v, DT)
    pushed = np.array([4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # faster than the joint may be at the next tick
    with pytest.raises(Infeasible) as stopped:
        control.step(q, 30 * DT, v=pushed)
    control.log.close()
    told = command("show", str(path), "--why")
    assert f"active-set raised an error at t = {30 * DT:.6g} s: {stopped.value}" in told
    conflict = find_conflict(open_log(path).tick(-1).hierarchy)
    assert "panda_joint1" in str(conflict)
    for side in conflict.members:
        assert side.name in told
    for side, gap in conflict.relaxation:
        assert f"{side.name} {side.side} by {gap:.3g}" in told
