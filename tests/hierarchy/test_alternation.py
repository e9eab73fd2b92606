"""Alternation is counted by name, with the cause that was planted, and only where there is any."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from taskopt import Hierarchy, JointTask, JointVelocityLimit, Level, PositionTask, Scenario, Stack
from taskopt.errors import InvalidValue
from taskopt.hierarchy.alternation import alternations
from taskopt.hierarchy.causes import ADVICE
from taskopt.hierarchy.damping import ConstantDamping, RestDamping
from taskopt.hierarchy.resolution import Resolution
from taskopt.kinematics.robot import planar_arm
from taskopt.kinematics.task import LevelDamping
from taskopt.loop.run import run
from taskopt.resolver.active_set.resolver import ActiveSet

DT = 1e-2


def ticks_of(cause: str) -> Iterator[Hierarchy]:
    """Yield a hundred ticks whose box is active every other time, for one cause."""
    for k in range(100):
        side = 1.0 if k % 2 else -1.0
        A, b, upper = np.eye(2), np.ones(2), np.full(2, 2.0)
        if cause == "tolerance":
            upper[0] = 1.0 + side * 5e-9
        elif cause == "gain":
            b[0] = 5.0 * side
        elif cause == "rank":
            A, b[1] = np.array([[1.0, 1.0], [1.0, 1.0 + 1e-3]]), 1.0 + 1.4e-3 * (2.0 + side)
        elif cause == "dt":
            upper[0] = 1.0 + 0.5 * side
        yield Hierarchy([Level(A, b)], box=([-9.0, -9.0], upper), unknowns=["hip", "knee"])


def bound_moves(move: float = 0.5, noise: float = 0.0, other: float = 1.0) -> list[Resolution]:
    """Forty ticks in which a bound moves past its target by `move`, beside two more levels.

    Level 2 asks for zero ± noise with a row of the size `other`, and level 3 is three times a row of level 1.
    """
    ticks = []
    for k in range(40):
        side = 1.0 if k % 2 else -1.0
        row = np.array([[0.1, 0.2, 0.3, 0.0]])
        first = Level(np.vstack([[1.0, 0.0, 0.0, 0.0], row]), [1.0, 0.1])
        second = Level([[0.0, 0.0, other, 0.0]], [side * noise])
        box = ([-9.0] * 4, [1.0 + move * side, 9.0, 9.0, 9.0])
        ticks.append(Hierarchy([first, second, Level(3.0 * row, [0.3])], box=box))
    return [ActiveSet()(hierarchy)[0] for hierarchy in ticks]


def resolved(cause: str) -> list[Resolution]:
    """The answers of `active-set` to `ticks_of`."""
    return [ActiveSet()(hierarchy)[0] for hierarchy in ticks_of(cause)]


@pytest.mark.parametrize("cause", sorted(ADVICE.keys() - {"transition"}))
def test_the_planted_cause_is_suggested(cause: str) -> None:
    """The bound is named, every change is counted, and the text says what to do."""
    most = alternations(resolved(cause), DT)[0]
    assert most.cause == cause
    assert most.name.startswith("box/")
    assert most.changes == 99
    assert most.per_second == pytest.approx(99.0)
    assert ADVICE[cause] in str(most)


def test_a_bound_that_stays_active_does_not_alternate() -> None:
    """A bound that becomes active once, and one that never does, are not reported."""
    quiet = [Hierarchy([Level([[1.0]], [2.0 if k > 50 else 0.0])], box=([-1.0], [1.0])) for k in range(100)]
    assert alternations([ActiveSet()(hierarchy)[0] for hierarchy in quiet], DT) == ()
    assert alternations([], DT) == ()
    with pytest.raises(InvalidValue, match="dt"):
        alternations([], 0.0)


@pytest.mark.parametrize("gain", [2.0, 20.0])
def test_a_target_out_of_reach_is_the_rank_and_damping_it_helps_where_a_lower_gain_does_not(gain: float):
    """A stretched arm flips its joints from tick to tick, whatever the gain, until its level is damped."""
    arm = planar_arm([0.5, 0.5, 0.5], velocity=2.0)
    far = PositionTask("tip", target=(1.8, 1.2, 0.0), gain=gain, axes="xy")
    found = []
    damped = [far, LevelDamping(ConstantDamping(0.3))]
    for level, damping in (([far], None), (damped, None), ([far], RestDamping())):
        stack = Stack([level, [JointTask()]], [JointVelocityLimit()], damping=damping)
        scenario = Scenario(robot=arm, q0=[0.3, 0.5, 0.4], stack=stack, duration=0.8, dt=2e-3)
        found.append(alternations((step.resolution for step in run(scenario, ActiveSet())), 2e-3))
    assert {row.cause for row in found[0]} == {"rank"}
    assert found[0][0].per_second > 300.0
    assert found[1:] == [(), ()]


def test_a_run_that_meets_its_limits_once_does_not_alternate() -> None:
    """A joint that runs at its velocity limit and then arrives."""
    stack = Stack([[JointTask([0.5, 0.5], gain=0.5 / DT)]], [JointVelocityLimit(velocity=0.5)])
    scenario = Scenario(robot=planar_arm([0.5, 0.5]), q0=[0.4, 0.2], stack=stack, duration=1.0, dt=DT)
    assert alternations((step.resolution for step in run(scenario, ActiveSet())), DT) == ()


@pytest.mark.parametrize(
    ("bound", "cause"),
    [
        ({}, "dt"),  # rows that depend on each other for good are not near a loss of rank
        ({"move": 1e-6}, "dt"),
        ({"move": 2e-9}, "tolerance"),
        ({"other": 0.02}, "dt"),
        ({"other": 1e-4}, "rank"),
        ({"noise": 1e-10}, "dt"),
        ({"noise": 1e-6}, "gain"),
    ],
)
def test_each_symptom_has_its_threshold(bound: dict[str, float], cause: str) -> None:
    """A cause is suggested where its symptom is beyond the threshold, and not before it."""
    assert {row.cause for row in alternations(bound_moves(**bound), DT)} == {cause}


def test_a_few_changes_are_no_alternation() -> None:
    """Four changes are none, however short the run is; five are one."""
    for ticks, count in ((5, 0), (6, 1)):
        assert len(alternations(bound_moves()[:ticks], DT)) == count


def test_the_rate_decides_what_is_reported() -> None:
    """39 changes in 40 ticks of 0.01 s are 97.5 a second."""
    assert len(alternations(bound_moves(), DT, per_second=97.5)) == 1
    assert alternations(bound_moves(), DT, per_second=98.0) == ()


def test_a_row_that_goes_from_bound_to_bound_is_a_matter_of_gain() -> None:
    """The box lies above its target in one tick and below it in the next, and no target changes."""
    boxes = [([2.0], [3.0]) if k % 2 else ([-3.0], [0.5]) for k in range(20)]
    ticks = [ActiveSet()(Hierarchy([Level([[1.0]], [1.0])], box=box))[0] for box in boxes]
    found = alternations(ticks, DT)
    assert {row.name for row in found} == {"box/x0 lower", "box/x0 upper"}
    assert {row.cause for row in found} == {"gain"}


def test_rows_that_pass_a_singularity_within_a_step_are_a_matter_of_rank() -> None:
    """A row of ±0.05 is far from zero at each tick, and passes through it in between."""
    ticks = []
    for k in range(20):
        side = 1.0 if k % 2 else -1.0
        level = Level([[1.0, 0.0], [0.0, 0.05 * side]], [1.0, 0.0])
        ticks.append(Hierarchy([level], box=([-9.0, -9.0], [1.0 + 0.5 * side, 9.0])))
    assert {row.cause for row in alternations([ActiveSet()(tick)[0] for tick in ticks], DT)} == {"rank"}


def test_a_bound_that_changes_its_owner_changes_its_name() -> None:
    """x ≤ 1 binds in every tick, but comes from two limits in turn, and both are counted."""
    hierarchy = Hierarchy([Level([[1.0]], [2.0])], box=([-1.0], [1.0]))
    layout = replace(hierarchy.layout, owners=("position", "velocity"))
    ticks = []
    for k in range(20):
        tick = Hierarchy.view(layout, hierarchy.buffer.copy(), hierarchy.norm)
        tick.owner[:] = k % 2
        ticks.append(ActiveSet()(tick)[0])
    assert {row.name: row.changes for row in alternations(ticks, DT)} == {
        "position/x0 upper": 19,
        "velocity/x0 upper": 19,
    }
