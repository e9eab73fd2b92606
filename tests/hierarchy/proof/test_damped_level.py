"""Damping of weight 1e-12 in the level of the tasks, as pink has it: KKT residuals do not see its decisions.

The stack is that of benchmarks/accept/motions_of_pink.py. On the Panda's motion an answer was claimed that
held a bound with a multiplier of the wrong sign, −2e-12, and was 2 rad/s off along the null space.
"""

from fractions import Fraction

import numpy as np
import pytest

from taskopt.bench.exact import as_floats, exact_optimum
from taskopt.bench.proof import is_broken, is_wrong
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.proof import Verdict, judge
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import JointPositionLimit, JointVelocityLimit
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Latest
from taskopt.kinematics.task import DampingTask, FrameTask
from taskopt.loop.controller import Controller
from taskopt.resolver.base import answered, final_state
from tests.helpers.robots import robot

TASK_ROWS = 6


@pytest.fixture(scope="module")
def tick() -> Resolution:
    """The Panda at zero, where joint 4 is outside its limits."""
    panda = robot("panda")
    pose = Configuration(panda, panda.neutral).pose("panda_hand")
    pose[:3, 3] += [0.0, 0.01, -0.02]
    hand = FrameTask("panda_hand", target=Latest(pose), gain=20.0)
    limits = [JointPositionLimit(0.5), JointVelocityLimit()]
    stack = Stack([[hand, DampingTask(1e-12)]], limits, damping=None)
    return Controller(panda, stack, dt=5e-3).step(panda.neutral, 0.0)


def at_a_bound(tick: Resolution) -> Resolution:
    """The same answer moved along the null space of the task until a joint is at its velocity limit."""
    problem = tick.problem
    held = (tick.state[:7] != 0) | (problem.box_lower == problem.box_upper)
    rows = np.vstack([problem.A[problem.layout.rows_of_level(1)][:TASK_ROWS], np.eye(7)[held]])
    _, sizes, axes = np.linalg.svd(rows)
    null = axes[int((sizes > 1e-9).sum())]
    room = np.where(null > 0.0, problem.box_upper - tick.x, problem.box_lower - tick.x)
    x = tick.x + null * np.min(room[~held] / null[~held], where=np.abs(null[~held]) > 1e-6, initial=np.inf)
    y = find_multipliers(problem, x)
    return answered(problem, x, y, final_state(problem, x, y), Status.SOLVED)[0]


@pytest.fixture(scope="module")
def exact(tick: Resolution) -> list[Fraction]:
    """Its optimum in rational arithmetic."""
    return exact_optimum(tick.problem)


def test_a_bound_that_damping_would_leave_is_refuted(tick: Resolution, exact: list[Fraction]) -> None:
    """It is claimed, and meets its KKT conditions; by the error bound it is more than 1 rad/s off."""
    lie = at_a_bound(tick)
    assert np.abs(lie.x - as_floats(exact)).max() > 1.0
    assert lie.claimed
    assert lie.kkt_met()
    assert lie.certificate.verdict is Verdict.REFUTED
    assert not is_broken(lie.certificate.judgement, lie.x, exact)


def test_a_set_that_holds_that_bound_leads_nowhere_wrong(tick: Resolution, exact: list[Fraction]) -> None:
    """Given as a hint it does not prove the lie, and does not hide the optimum."""
    lie = at_a_bound(tick)
    assert judge(tick.problem, lie.x, lie.state).verdict is Verdict.REFUTED
    assert judge(tick.problem, as_floats(exact), lie.state).verdict is Verdict.PROVEN


def test_what_is_proven_of_that_stack_is_right(tick: Resolution, exact: list[Fraction]) -> None:
    """The answer of the active-set method: proven if and only if it is the exact optimum to 1e-8."""
    assert tick.proven is not is_wrong(tick.x, exact)
    assert tick.certified() is tick.proven
    assert not is_broken(tick.certificate.judgement, tick.x, exact)
