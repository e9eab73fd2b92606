"""The controller: the run's own answers inside somebody else's loop, and nothing unsafe out of it."""

from pathlib import Path

import numpy as np
import pytest

from taskopt import (
    Controller,
    FrameTask,
    Hierarchy,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Latest,
    Robot,
    Stack,
)
from taskopt.errors import InvalidValue, NotSolved, UnknownName
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.kinematics.robot import planar_arm
from taskopt.loop.run import run
from taskopt.loop.scenario import load_scenario
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory, answered
from taskopt.resolver.infeasible import no_answer
from taskopt.resolver.registry import resolver

TASKS = Path(__file__).parents[2] / "tasks"
ARM = planar_arm([0.5, 0.5, 0.5], lower=-1.0, upper=1.0, velocity=2.0)
STACK = Stack([[FrameTask("tip", gain=20.0)], [JointTask()]], [JointPositionLimit(), JointVelocityLimit()])


@pytest.mark.parametrize("name", ["active-set", "pinv", "hqp/daqp"])
def test_it_is_the_loop_of_a_run(name: str) -> None:
    """Stepping the controller along a run gives that run's velocities, bit by bit."""
    scenario = load_scenario(TASKS / "planar_circle.py")
    control = Controller(scenario.robot, scenario.stack, name, dt=scenario.dt)
    for step, _ in zip(run(scenario, resolver(name)), range(50), strict=False):
        resolution = control.step(step.q, step.t)
        np.testing.assert_array_equal(resolution.v, step.v)


def test_the_latest_target_counts_from_the_next_step_on() -> None:
    """A target that is moved between steps is followed, and reached."""
    robot = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    target = Latest()
    stack = Stack([[FrameTask("panda_hand", target=target, gain=50.0)]], [JointPositionLimit()])
    control = Controller(robot, stack, dt=1e-2)
    q = robot.posture("default")
    assert np.abs(control.step(q, 0.0).v).max() < 1e-9
    pose = control.plan.configuration.pose("panda_hand")
    pose[:3, 3] += [0.02, -0.03, 0.01]
    target.set(pose)
    for k in range(1, 60):
        q = robot.integrate(q, control.step(q, 1e-2 * k).v, 1e-2)
    np.testing.assert_allclose(control.plan.tasks[0].actual, pose, atol=1e-6)


@pytest.mark.parametrize(
    ("q", "words"),
    [
        ([0.1, 0.2], "shape"),
        (np.array([0.1, 0.2]), "3 numbers"),
        (np.array([0.1, np.nan, 0.0]), "NaN"),
        (np.array([np.inf, 0.0, 0.0]), "finite"),
        (0.1, "shape"),
    ],
)
def test_a_bad_q_is_refused_and_the_next_step_is_right(q: object, words: str) -> None:
    """Wrong size, NaN and inf raise a clear error, and leave the controller as it was."""
    control = Controller(ARM, STACK)
    good = np.array([0.1, 0.2, 0.3])
    before = control.step(good, 0.0).v.copy()
    with pytest.raises(InvalidValue, match=words):
        control.step(q, 1e-3)  # type: ignore[arg-type]
    np.testing.assert_array_equal(control.step(good, 0.0).v, before)


def test_a_start_outside_the_limits_may_stop_or_return() -> None:
    """No velocity leads farther out."""
    control = Controller(ARM, STACK)
    resolution = control.step(np.array([1.2, 0.0, 0.0]), 0.0)
    assert resolution.kkt_met()
    assert resolution.v[0] <= 1e-12


def test_a_tick_without_an_answer_stops_the_loop() -> None:
    """An answer that may not be sent to a robot is an error that keeps the resolution."""
    control = Controller(ARM, STACK, _GivesUp())
    with pytest.raises(NotSolved, match="failed; it gave up") as caught:
        control.step(np.zeros(3), 1e-3)
    assert caught.value.resolution is not None


class _GivesUp:
    """Says at every tick that the limits contradict each other, which is not so."""

    name, strict = "gives-up", True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        return no_answer(hierarchy, Status.INFEASIBLE)

    def closed_form(self, hierarchy: Hierarchy) -> np.ndarray:
        return np.zeros(hierarchy.n)


def test_a_claim_that_breaks_a_limit_is_not_sent() -> None:
    """SOLVED is a claim: a velocity 1e-3 above its limit stops the loop; one 1e-9 above may be rounding."""
    for beyond, sent in ((1e-9, True), (1e-3, False)):
        control = Controller(ARM, STACK, _Claims(np.array([2.0 + beyond, 0.0, 0.0])))
        if sent:
            assert control.step(np.zeros(3), 0.0).v[0] > 2.0
        else:
            with pytest.raises(NotSolved, match="breaks a hard limit"):
                control.step(np.zeros(3), 0.0)


class _Claims:
    """Says of one velocity, at every tick, that it is the optimum."""

    name, strict = "claims", True

    def __init__(self, x: np.ndarray) -> None:
        self._x = x

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        y = np.zeros((hierarchy.layout.level_count + 1, hierarchy.layout.width))
        return answered(hierarchy, self._x, y, np.zeros(hierarchy.layout.width, np.int8), Status.SOLVED)

    def closed_form(self, hierarchy: Hierarchy) -> np.ndarray:
        return np.zeros(hierarchy.n)


def test_a_start_does_not_change_what_follows() -> None:
    """Compiling the fast path and the search at the start leaves no memory behind."""
    q = np.array([0.3, -0.2, 0.4])
    started, plain = Controller(ARM, STACK), Controller(ARM, STACK)
    started.start(q)
    for k in range(5):
        one, other = started.step(q, 1e-3 * k), plain.step(q, 1e-3 * k)
        np.testing.assert_array_equal(one.answer, other.answer)
        np.testing.assert_array_equal(one.state, other.state)


@pytest.mark.parametrize("dt", [0.0, -1e-3, np.nan])
def test_a_step_must_take_time(dt: float) -> None:
    """dt ≤ 0 is refused when the controller is made."""
    with pytest.raises(InvalidValue, match="dt"):
        Controller(ARM, STACK, dt=dt)


def test_names_are_checked_when_it_is_made() -> None:
    """Unknown resolvers and frames are refused with the nearest name."""
    with pytest.raises(UnknownName, match="did you mean active-set"):
        Controller(ARM, STACK, "activ-set")
    with pytest.raises(UnknownName, match="did you mean tip"):
        Controller(ARM, Stack([[FrameTask("tipp")]]))


@pytest.mark.parametrize(("given", "sentence"), [(ActiveSet, "is a class"), (object(), "lacks name, strict")])
def test_what_is_no_resolver_is_refused_at_once(given: object, sentence: str) -> None:
    """A class in place of a resolver, and an object that lacks parts of the protocol."""
    with pytest.raises(InvalidValue, match=sentence):
        Controller(planar_arm(), Stack([[JointTask()]]), given)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((STACK, ARM), "stack must be a Stack"),
        ((ARM, [[JointTask()]]), "stack must be a Stack"),
        (("panda", STACK), "robot must be a Robot, as Robot.load .* got 'panda'"),
    ],
)
def test_arguments_of_another_kind_are_told_apart(arguments: tuple, message: str) -> None:
    """A swapped pair, bare levels, and the name of a robot in place of the robot."""
    with pytest.raises(InvalidValue, match=message):
        Controller(*arguments)
