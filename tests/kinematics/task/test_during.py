"""Tasks that come and go: nothing outside their time, all of them within it, no jump at either end."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt import Controller, FrameTask, JointPositionLimit, JointTask, JointVelocityLimit, Stack
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.task import BoxTask, During, PositionTask
from taskopt.kinematics.task.transition import BoundDuring, largest_jump, swap, transitions
from tests.helpers.robots import generic_q, robot

LIMITS = [JointPositionLimit(), JointVelocityLimit()]
Q = generic_q(robot("panda"), 3)
HOME = Configuration(robot("panda"), Q).pose("panda_hand")
FAR = FrameTask("panda_hand", target=HOME[:3, 3] + [0.3, 0.2, -0.2], gain=2.0, axes="xyz", expressed="world")
BOX = BoxTask("panda_hand", HOME[:3, 3] - 0.01, HOME[:3, 3] + 0.01, gain=2.0)
FIRST = JointTask([0.5], joints=["panda_joint1"])
REST = JointTask(generic_q(robot("panda"), 4), gain=1.0)


def velocities(levels, dt, until=1.0):
    """v at times dt apart, the robot standing still all the while: what moves is the stack alone."""
    control = Controller(robot("panda"), Stack(levels, LIMITS), dt=1e-3)
    out = []
    for k in range(round(until / dt)):
        resolution = control.step(Q, k * dt)
        assert resolution.kkt_met()
        out.append(resolution.v.copy())
    return np.array(out)


def cases(blend):
    """Insertion above and below, removal, an inequality, a swap of two levels."""
    early, late = {"end": 0.3, "blend": blend}, {"begin": 0.3, "blend": blend}
    return {
        "insert above": [[During(FAR, **late)], [REST]],
        "insert below": [[FIRST], [During(FAR, **late)], [REST]],
        "remove": [[During(FAR, **early)], [REST]],
        "inequality": [[During(BOX, **late)], [FAR], [REST]],
        "swap": swap([REST], [FAR], at=0.3, blend=blend),
    }


@pytest.mark.slow
@pytest.mark.parametrize("case", cases(0.4))
def test_blended_transitions_are_lipschitz_in_time_and_switched_ones_are_not(case):
    """A quarter of the step means a quarter of the jump when blended, and the same jump when switched."""
    blended = [largest_jump(velocities(cases(0.4)[case], dt)) for dt in (4e-3, 1e-3)]
    switched = [largest_jump(velocities(cases(0.0)[case], dt)) for dt in (4e-3, 1e-3)]
    assert switched[1] == pytest.approx(switched[0])
    assert switched[0] > 0.1
    assert blended[1] < 0.35 * blended[0]
    assert blended[1] < 0.05 * switched[1]


@pytest.mark.parametrize("case", cases(0.4))
def test_before_and_after_it_is_the_stack_without_and_with_the_task(case):
    """The velocities at both ends are those of the stacks that are meant."""
    without = {"insert above": [[REST]], "insert below": [[FIRST], [REST]],
               "remove": [[FAR], [REST]], "inequality": [[FAR], [REST]], "swap": [[REST], [FAR]]}  # fmt: skip
    with_it = {"insert above": [[FAR], [REST]], "insert below": [[FIRST], [FAR], [REST]],
               "remove": [[REST]], "inequality": [[BOX], [FAR], [REST]], "swap": [[FAR], [REST]]}  # fmt: skip
    path = velocities(cases(0.4)[case], 1e-2)
    np.testing.assert_allclose(path[0], velocities(without[case], 1.0)[0], atol=1e-9)
    np.testing.assert_allclose(path[-1], velocities(with_it[case], 1.0)[0], atol=1e-9)


def test_a_task_holds_the_place_where_it_begins():
    """A target that begins at the start is anchored when its task begins, not when the run does."""
    of, dt = robot("panda"), 1e-2
    hold = During(PositionTask("panda_hand", gain=20.0), begin=0.5, blend=0.1)
    move = During(JointTask(generic_q(of, 9), gain=2.0), end=0.5, blend=0.0)
    control = Controller(of, Stack([[hold], [move], [JointTask(gain=0.0)]]), dt=dt)
    q, begun = Q.copy(), HOME
    for k in range(120):
        if k == 50:
            begun = Configuration(of, q).pose("panda_hand")
        q = of.integrate(q, control.step(q, k * dt).v, dt)
    after = Configuration(of, q).pose("panda_hand")
    assert np.linalg.norm(begun[:3, 3] - HOME[:3, 3]) > 0.05
    np.testing.assert_allclose(after[:3, 3], begun[:3, 3], atol=2e-3)


@pytest.mark.parametrize("times", [{"begin": 0.1}, {"end": 0.1}])
def test_a_task_that_asks_for_much_closes_in_from_as_far(times):
    """At a gain of 400 1/s the goal is far beyond ±10; reach follows, and declared too small it matters.

    It does not where the task goes, since a row that is still held then stays until it is not.
    """
    hurried = FrameTask("panda_hand", target=HOME[:3, 3] + [0.1, 0.1, 0.0], gain=400.0, axes="xyz")
    far = 400.0 * 0.1
    jumps = []
    for reach in (None, 0.1 * far):
        levels = [[During(hurried, blend=0.3, reach=reach, **times)], [REST]]
        control = Controller(robot("panda"), Stack(levels), dt=1e-3)
        jumps.append(largest_jump(np.array([control.step(Q, k * 1e-3).v.copy() for k in range(500)])))
    assert jumps[0] < 0.1 * far
    assert jumps[1] > 3.0 * jumps[0] if "begin" in times else jumps[1] < 0.1 * far


def path_of_a_fast_arm(times, speed, dt):
    """Velocities of an arm whose joints want `speed`, while a task holds the hand at times."""
    hold = During(PositionTask("panda_hand", gain=2.0), blend=0.2, **times)
    run = JointTask(Q + speed, gain=1.0)
    control = Controller(robot("panda"), Stack([[hold], [run]]), dt=dt)
    control.start(Q)
    return np.array([control.step(Q, k * dt).v.copy() for k in range(round(0.8 / dt))])


@pytest.mark.slow
@given(speed=st.floats(0.1, 300.0), begin=st.booleans())
@settings(max_examples=10, deadline=None)
def test_a_transition_is_lipschitz_whatever_the_level_below_asks_for(speed, begin):
    """A quarter of the step is a quarter of the jump, from a crawl to speeds that no arm has."""
    times = {"begin": 0.2} if begin else {"end": 0.2}
    jumps = [largest_jump(path_of_a_fast_arm(times, speed, dt)) for dt in (4e-3, 1e-3)]
    assert jumps[1] < 0.3 * jumps[0] + 1e-9
    np.testing.assert_allclose(
        path_of_a_fast_arm({}, speed, 0.4)[0] if begin else np.full(7, speed),
        path_of_a_fast_arm(times, speed, 4e-3)[-1],
        atol=1e-6 * speed,
    )


@pytest.mark.parametrize("times", [{"begin": 0.2}, {"end": 0.2}])
def test_planted_fault_the_band_does_not_look_at_the_velocity(times, monkeypatch):
    """With a band that knows only what the task asks for, the arm jumps by as much at any step."""
    monkeypatch.setattr(BoundDuring, "moved", lambda self, v: None)
    jumps = [largest_jump(path_of_a_fast_arm(times, 25.0, dt)) for dt in (4e-3, 1e-3)]
    assert jumps[1] > 0.8 * jumps[0]


@pytest.mark.slow
@given(speed=st.floats(0.1, 300.0), enabled=st.booleans())
@settings(max_examples=10, deadline=None)
def test_a_task_switched_while_running_is_lipschitz_too(speed, enabled):
    """The same holds for `enabled`, blended over a time."""
    jumps = []
    for dt in (4e-3, 1e-3):
        hold = PositionTask("panda_hand", gain=2.0, name="hand")
        control = Controller(robot("panda"), Stack([[hold], [JointTask(Q + speed, gain=1.0)]]), dt=dt)
        control.start(Q)
        control.set({"hand.enabled": enabled})
        path = []
        for k in range(round(0.8 / dt)):
            if k == round(0.2 / dt):
                control.set({"hand.enabled": not enabled}, over=0.2)
            path.append(control.step(Q, k * dt).v.copy())
        jumps.append(largest_jump(np.array(path)))
        np.testing.assert_allclose(path[-1] if enabled else path[10], speed, atol=1e-6 * speed)
    assert jumps[1] < 0.3 * jumps[0] + 1e-9


def test_a_plan_tells_when_its_tasks_come_and_go():
    """Each end of each task that has one; a swap is both at once."""
    stack = Stack([[During(FIRST, begin=0.1, end=1.0, blend=0.2)], *swap([REST], [FAR], at=0.5)])
    found = {
        (name, what): (begin, end)
        for name, what, begin, end in transitions(stack.compile(robot("panda"), 1e-3).tasks)
    }
    assert found[FIRST.default_name(), "comes"] == pytest.approx((0.1, 0.3))
    assert found[FIRST.default_name(), "goes"] == pytest.approx((1.0, 1.2))
    assert found["panda_hand", "comes"] == found["panda_hand 2", "goes"] == (0.5, 0.75)
    assert len(found) == 4


@pytest.mark.parametrize(
    ("t", "u"),
    [(-1.0, math.inf), (0.9, None), (1.0, 1.0), (1.5, 0.5), (2.0, 0.0), (3.0, 0.0), (3.5, 0.5), (5.0, 2.0)],
)
def test_openness_falls_after_begin_and_rises_after_end(t, u):
    """Straight lines in time, 0 in between."""
    timed = During(REST, begin=1.0, end=3.0, blend=1.0)
    assert timed.openness(t) == pytest.approx(u) if u is not None and t >= 1.0 else timed.openness(t) > 1.0


@pytest.mark.parametrize(
    "times", [{"begin": 1.0, "end": 1.1, "blend": 0.2}, {"blend": -0.1}, {"begin": np.nan}, {"reach": 0.0}]
)
def test_times_that_make_no_sense_are_refused(times):
    """Going before it has come, negative blends, NaN, no reach."""
    with pytest.raises(InvalidValue):
        During(REST, **times)
    with pytest.raises(InvalidValue, match="timed"):
        During(During(REST))


@pytest.mark.parametrize(
    ("t", "openness"), [(0.9, 1.2), (1.0, 1.0), (1.25, 0.5), (1.5, 0.0), (3.0, 0.0), (3.25, 0.5), (3.5, 1.0)]
)
def test_a_task_closes_after_its_begin_and_opens_after_its_end(t: float, openness: float) -> None:
    """From `begin` to `begin + blend` the band closes, from `end` to `end + blend` it opens."""
    during = During(REST, begin=1.0, end=3.0, blend=0.5)
    assert during.openness(t) == pytest.approx(openness)


@pytest.mark.parametrize("t", [0.25, 0.5, 0.9])
def test_the_band_closes_at_a_rate_in_proportion_to_its_width(t: float) -> None:
    """β(u) = ε (e^(κu) − 1) with ε = reach/1000, κ = log 1001 and u = 1 − t while the task comes in 1 s."""
    bound = During(FIRST, begin=0.0, blend=1.0, reach=20.0).bind(robot("panda"), "task")
    at = Configuration(robot("panda"), Q)
    rows = LevelRows(np.zeros((1, at.robot.nv)), np.empty(1), np.empty(1), np.ones(1))
    bound.prepare(rows)
    bound.start(at, 0.0)
    bound.fill(at, t, rows)
    assert rows.upper[0] - rows.lower[0] == pytest.approx(2.0 * 0.02 * (1001.0 ** (1.0 - t) - 1.0))
