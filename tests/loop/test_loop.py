"""One tick: what may be sent, what happens where it may not, and that there is one behaviour for all."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from taskopt import (
    Controller,
    Hierarchy,
    Infeasible,
    JointAccelerationLimit,
    JointTask,
    JointVelocityLimit,
    Memory,
    NotSolved,
    Resolution,
    Scenario,
    Stack,
    Status,
    load_scenario,
    planar_arm,
    run,
)
from taskopt.loop.loop import may_be_sent
from taskopt.resolver.base import answered
from taskopt.resolver.registry import resolver

TASKS = Path(__file__).parents[2] / "tasks"
ARM = planar_arm([0.5, 0.5, 0.5], lower=-1.0, upper=1.0, velocity=2.0)
STACK = Stack([[JointTask()]], [JointVelocityLimit()])


class Says:
    """Give one velocity and one status at every tick, and keep the memories that are handed over."""

    name, strict = "says", True

    def __init__(self, x: list[float], status: Status) -> None:
        self._x, self._status, self.memories = np.array(x), status, []

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        self.memories.append(memory)
        return said(hierarchy, self._x, self._status)

    def closed_form(self, hierarchy: Hierarchy) -> np.ndarray:
        return np.zeros(hierarchy.n)


def said(hierarchy: Hierarchy, x: np.ndarray, status: Status) -> tuple[Resolution, Memory]:
    layout = hierarchy.layout
    multipliers = np.zeros((layout.level_count + 1, layout.width))
    return answered(hierarchy, x, multipliers, np.zeros(layout.width, np.int8), status)


def by_controller(says: Says) -> None:
    Controller(ARM, STACK, says).step(np.zeros(3), 0.0)


def by_run(says: Says) -> None:
    next(run(Scenario(robot=ARM, q0=[0.0, 0.0, 0.0], stack=STACK, duration=0.1), says))


@pytest.mark.parametrize("tick", [by_controller, by_run])
@pytest.mark.parametrize(
    ("beyond", "status", "sent"),
    [
        (1e-7, Status.SOLVED, True),
        (1e-5, Status.SOLVED, False),
        (1e-9, Status.ITERATION_LIMIT, True),
        (1e-7, Status.ITERATION_LIMIT, False),
        (1.0, Status.FORMULA, True),
        (0.0, Status.FAILED, False),
        (0.0, Status.INFEASIBLE, False),
        (np.nan, Status.FORMULA, False),
    ],
)
def test_only_what_keeps_the_limits_is_sent(
    tick: Callable[[Says], None], beyond: float, status: Status, sent: bool
) -> None:
    """A velocity that is over its limit by more than its status allows stops run and controller alike."""
    says = Says([2.0 + beyond, 0.0, 0.0], status)
    if sent:
        tick(says)
    else:
        with pytest.raises(NotSolved, match="says at t = 0 s"):
            tick(says)


@pytest.mark.parametrize("status", list(Status))
def test_the_check_of_a_status_is_what_it_says(status: Status) -> None:
    """Statuses without an optimum are sent if finite; the others only if the hard limits hold."""
    hierarchy = STACK.compile(ARM, 1e-3).at(np.zeros(3), 0.0)
    inside, outside, nothing = ([x, 0.0, 0.0] for x in (0.1, 2.1, np.inf))
    verdicts = [may_be_sent(said(hierarchy, np.array(x), status)[0]) for x in (inside, outside, nothing)]
    optimum = status in (Status.SOLVED, Status.ITERATION_LIMIT)
    without = status in (Status.FORMULA, Status.RELAXED, Status.BRAKED)
    assert verdicts == [optimum or without, without, False]


class FailsOnce:
    """The exact resolver, which gives up at one call of its own; keeps the memories that it is handed."""

    name, strict = "fails-once", True

    def __init__(self, call: int) -> None:
        self._call, self.memories = call, []

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        self.memories.append(memory)
        resolution, memory = resolver("active-set")(hierarchy, memory)
        failed = len(self.memories) == self._call
        return (resolution.replaced(Status.FAILED) if failed else resolution), memory

    def closed_form(self, hierarchy: Hierarchy) -> np.ndarray:
        return np.zeros(hierarchy.n)


def test_after_an_answer_that_may_not_be_sent_nothing_is_remembered() -> None:
    """The tick after a refused one starts cold, all others start from the last active set."""
    fails = FailsOnce(call=3)
    control = Controller(ARM, STACK, fails)
    for k in range(5):
        if k == 2:
            with pytest.raises(NotSolved):
                control.step(np.zeros(3), 1e-3 * k)
        else:
            control.step(np.zeros(3), 1e-3 * k)
    assert [memory is None for memory in fails.memories] == [True, False, False, True, False]


def conflicting() -> Scenario:
    return load_scenario(TASKS / "planar_conflict.py")


@pytest.mark.parametrize("name", ["active-set", pytest.param("hqp/daqp", marks=pytest.mark.slow)])
def test_run_and_controller_agree_through_a_conflict(name: str) -> None:
    """Before, at and after ticks whose limits contradict each other, both send the same, bit by bit."""
    made = conflicting()
    control = Controller(made.robot, made.stack, name, made.dt, made.on_conflict)
    statuses = set()
    for step in run(made, name):
        resolution = control.step(step.q, step.t)
        np.testing.assert_array_equal(resolution.v, step.v)
        assert resolution.status is step.resolution.status
        statuses.add(step.resolution.status)
    assert statuses == {Status.SOLVED, Status.BRAKED}


def test_the_policy_raise_names_time_and_limits() -> None:
    """`Infeasible` ends the run with the resolver, the time and the conflict in words."""
    made = conflicting()
    scenario = Scenario(robot=made.robot, q0=made.start, stack=made.stack, duration=made.duration, dt=made.dt)
    with pytest.raises(Infeasible, match=r"active-set at t = .* s: these limits exclude each other"):
        list(run(scenario))


def test_the_rate_limits_are_told_the_velocity_that_is_sent() -> None:
    """From tick to tick the velocity changes by no more than the acceleration limit allows."""
    stack = Stack([[JointTask([0.9, -0.9, 0.9], gain=100.0)]], [JointAccelerationLimit(5.0)])
    control, q, v = Controller(ARM, stack, dt=1e-2), np.zeros(3), np.zeros(3)
    for k in range(20):
        sent = control.step(q, 1e-2 * k).v
        assert np.abs(sent - v).max() <= 5.0 * 1e-2 * (1.0 + 1e-9)
        q, v = ARM.integrate(q, sent, 1e-2), sent.copy()
    assert np.abs(v).max() > 0.5
