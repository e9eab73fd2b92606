"""The loop: Euler on the manifold, one time index, one clock, steps that keep what they show."""

from dataclasses import dataclass
from itertools import pairwise
from time import sleep

import numpy as np
import pytest

from taskopt import (
    Circle,
    FrameTask,
    Hierarchy,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Robot,
    Scenario,
    Stack,
)
from taskopt.errors import NotSolved
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.kinematics.robot import planar_arm
from taskopt.loop.loop import Loop
from taskopt.loop.run import Step, run
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory

ARM = planar_arm([0.5, 0.5, 0.5], velocity=2.0)
START = [0.3, 0.6, 0.5]
PATH = Circle(radius=0.1, period=1.0, toward=(-1, 0, 0), along=(0, 1, 0))
CIRCLE = FrameTask("tip", target=PATH, gain=50.0, axes="xy", expressed="world")


def scenario(*limits: object, duration: float = 0.05, robot: Robot = ARM) -> Scenario:
    stack = Stack([[CIRCLE], [JointTask()]], limits)
    return Scenario(robot=robot, q0=START, stack=stack, duration=duration)


@dataclass(frozen=True)
class Faulty:
    """The exact resolver, with a fault from the third call on."""

    status: Status = Status.SOLVED
    x: float | None = None
    seconds: float = 0.0
    name: str = "faulty"
    strict: bool = True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        resolution, memory = ActiveSet()(hierarchy, memory)
        sleep(self.seconds)
        if self.x is not None:
            resolution.answer[0] = self.x
        return resolution.replaced(self.status), memory

    def closed_form(self, hierarchy: Hierarchy) -> np.ndarray:
        sleep(self.seconds)
        return ActiveSet().closed_form(hierarchy)


@pytest.mark.equation("3.48")
def test_each_step_is_one_euler_step_on_the_manifold() -> None:
    """q_{k+1} = q_k ⊕ v_k Δt (3.48), and v_k resolves the hierarchy of (q_k, t_k)."""
    made = scenario()
    steps = list(run(made, ActiveSet()))
    plan = made.stack.compile(ARM, made.dt)
    plan.start(made.start, 0.0)
    assert [step.index for step in steps] == [*range(made.ticks)]
    for before, after in pairwise(steps):
        np.testing.assert_array_equal(after.q, before.q_next)
    for step in steps:
        np.testing.assert_array_equal(step.q_next, ARM.integrate(step.q, step.v, made.dt))
        np.testing.assert_array_equal(step.hierarchy.buffer, plan.at(step.q, step.t).buffer)


def test_steps_keep_what_they_show() -> None:
    """Nothing in a step changes when later ticks are taken."""
    going = run(scenario(), ActiveSet())
    first = next(going)
    rows, answer, error = first.hierarchy.buffer.copy(), first.resolution.answer.copy(), dict(first.errors)
    kept = {name: array.copy() for name, array in error.items()}
    *_, last = going
    np.testing.assert_array_equal(first.hierarchy.buffer, rows)
    np.testing.assert_array_equal(first.resolution.answer, answer)
    assert all((first.errors[name] == kept[name]).all() for name in kept)
    np.testing.assert_array_equal(first.resolution.problem.buffer, first.hierarchy.buffer)
    assert not np.array_equal(first.q, last.q)
    assert not np.array_equal(first.desired["tip"], last.desired["tip"])


def test_feedforward_and_feedback_keep_the_tip_on_its_circle() -> None:
    """With both, the error of one Euler step stays of the order of Δt² ω² r."""
    *_, last = run(scenario(duration=0.3), ActiveSet())
    apart = last.desired["tip"][:3, 3] - last.actual["tip"][:3, 3]
    assert np.abs(apart).max() < 1e-4


def test_a_run_is_the_same_every_time() -> None:
    """Two runs of one scenario give bit-equal steps, and each resolver's first hierarchy is the same."""
    one, two = (list(run(scenario(), ActiveSet())) for _ in range(2))
    assert all((a.v == b.v).all() for a, b in zip(one, two, strict=True))
    other = next(run(scenario(), Faulty()))
    np.testing.assert_array_equal(one[0].hierarchy.buffer, other.hierarchy.buffer)


def test_the_clock_holds_the_resolver_and_nothing_else() -> None:
    """Time spent in the closed form beside it, or by whoever takes the step, is not on the clock."""
    for step in run(scenario(duration=0.003), Faulty(seconds=0.02)):
        assert 0.02 <= step.seconds < 0.039
        sleep(0.02)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (
            Faulty(status=Status.INFEASIBLE),
            ["faulty", "it claims that the hard limits contradict"],
        ),
        (Faulty(status=Status.FAILED), ["failed"]),
        (Faulty(x=np.nan), ["not a number"]),
        (Faulty(x=np.inf), ["not a number"]),
    ],
)
def test_what_may_not_be_sent_to_a_robot_ends_the_run(fault: Faulty, words: list[str]) -> None:
    """The error names resolver and time, and keeps the problem for a post-mortem."""
    with pytest.raises(NotSolved) as caught:
        next(run(scenario(), fault))
    assert all(word in str(caught.value) for word in [*words, "t = 0 s"]), str(caught.value)
    assert isinstance(caught.value.resolution, Resolution)
    again, _ = ActiveSet()(caught.value.resolution.problem)
    assert again.kkt_met()


def test_nothing_binds_exactly_where_the_closed_form_keeps_all_limits() -> None:
    """Where `free`, the exact answer is the closed form; where not, it is another, and a limit is active."""
    tight = scenario(JointPositionLimit(), JointVelocityLimit(velocity=0.8), duration=0.6)
    steps = list(run(tight, ActiveSet()))
    free = [step for step in steps if step.nothing_binds]
    bound = [step for step in steps if not step.nothing_binds]
    assert free
    assert bound
    assert max(step.closed_form_distance for step in free) < 1e-9
    assert min(step.closed_form_distance for step in bound) > 1e-9
    assert all(step.resolution.active for step in bound)


def test_extreme_limits_are_kept_after_the_step() -> None:
    """Position stays inside within 1e-9 rad, velocity within 1e-9 rad/s, however hard the task pulls."""
    robot = planar_arm([0.5, 0.5, 0.5], lower=-0.4, upper=0.65, velocity=1.5)
    made = scenario(JointPositionLimit(), JointVelocityLimit(), duration=0.5, robot=robot)
    steps = list(run(made, ActiveSet()))
    assert max(step.q_next.max() for step in steps) <= 0.65 + 1e-9
    assert max(step.q_next.max() for step in steps) >= 0.65 - 1e-6
    assert max(np.abs(step.v).max() for step in steps) <= 1.5 + 1e-9


def test_floating_bases_run_on_their_manifold() -> None:
    """A robot with nq ≠ nv keeps a unit quaternion and follows its task."""
    robot = Robot.load("solo12")
    target = Circle(radius=0.02, period=1.0, toward=(0, 1, 0), along=(0, 0, 1))
    task = FrameTask("base_link", target=target, gain=50.0)
    made = Scenario(robot=robot, q0=robot.posture("standing"), stack=Stack([[task]]), duration=0.05, dt=1e-3)
    steps: list[Step] = list(run(made, ActiveSet()))
    assert abs(np.linalg.norm(steps[-1].q_next[3:7]) - 1.0) < 1e-12
    assert np.linalg.norm(steps[-1].errors["base_link"]) < 1e-3


def test_compiling_is_nobodys_solve_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock of a tick stands still while kernels are compiled or loaded."""
    times = iter([0, 0, 5_000_000_000])  # [ns] spent on kernels before rows, before and after the resolver
    monkeypatch.setattr("taskopt.loop.loop.nanoseconds_preparing", lambda: next(times))
    plan = Stack([[JointTask()]]).compile(planar_arm(), 1e-3)
    loop = Loop(plan, ActiveSet(), "raise", timed=True)
    loop.tick(plan.robot.posture("middle"), 0.0)
    assert loop.seconds.resolver < 0.0  # five seconds of compiling were taken off a tick that took none
