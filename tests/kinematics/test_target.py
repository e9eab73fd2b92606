"""Targets: values, exact rates, ends, timing laws, and refusals."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.pose import exp6
from taskopt.kinematics.space import PoseSpace, PostureSpace
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import TIMING, Circle, Function, Hold, Latest, Line, as_target
from taskopt.kinematics.task import FrameTask
from tests.helpers.moving import tumbling
from tests.helpers.robots import generic_q, robot

POSES = PoseSpace("target")
START = exp6(np.array([0.3, -0.1, 0.5, 0.4, -0.7, 0.2]))
GOAL = START @ exp6(np.array([-0.2, 0.3, 0.1, -0.5, 1.1, 0.6]))
MOVING = {
    **{f"line, {law}": Line(to=GOAL, duration=2.0, timing=law) for law in TIMING},
    "line by a displacement": Line(by=[0.1, 0.2, -0.3], duration=2.0),
    "line to a position": Line(to=[0.1, 0.2, 0.3], duration=2.0),
    "line to a rotation": Line(to=GOAL[:3, :3], duration=2.0, timing="quintic"),
    "circle": Circle(radius=0.2, period=1.7, toward=(1, 0, 1), along=(0, -2, 0)),
    **{f"circle, {law}": Circle(radius=0.2, period=1.3, turns=1.5, timing=law) for law in TIMING},
    "function": tumbling(START, 3),
    "function, rate from differences": Function(tumbling(START, 3).value),
    "position, rate from differences": Function(lambda t: [np.sin(t), np.cos(2 * t), t**3]),
}


def sample(course, t):
    """(value, rate) of poses at t; the rate is zero where the course says that it does not move."""
    value, rate = np.full((4, 4), np.nan), np.full(6, np.nan)
    moving = course(t, value, rate)
    return value, rate if moving else np.zeros(6)


@pytest.mark.parametrize("name", MOVING)
@pytest.mark.parametrize("t", [0.31, 0.9, 1.6])
def test_the_rate_is_the_derivative_of_the_value(name, t):
    """ẋ_d by central differences in world axes: linear of the origin, then angular."""
    course, h = MOVING[name].start(POSES, START, 0.2), 1e-5
    before, after = sample(course, t - h)[0], sample(course, t + h)[0]
    numeric = POSES.difference(before, after) / (2.0 * h)
    np.testing.assert_allclose(sample(course, t)[1], numeric, atol=3e-8)


def test_a_wrong_rate_is_caught():
    """The check above sees a rate in the axes of the body."""
    right = tumbling(START, 3)
    wrong = Function(right.value, lambda t: right.derivative(0.0))
    h = 1e-5
    course = wrong.start(POSES, START, 0.0)
    numeric = POSES.difference(sample(course, 0.9 - h)[0], sample(course, 0.9 + h)[0]) / (2.0 * h)
    assert np.abs(sample(course, 0.9)[1] - numeric).max() > 1e-2


@pytest.mark.parametrize("name", [n for n in MOVING if n.startswith(("line", "circle"))])
def test_a_target_begins_where_the_run_starts(name):
    """x_d(t_0) = x_0, and before t_0 it waits there."""
    course = MOVING[name].start(POSES, START, 0.2)
    for t in (0.2, 0.1):
        np.testing.assert_allclose(sample(course, t)[0], START, atol=1e-15)
    np.testing.assert_array_equal(sample(course, 0.1)[1], 0.0)


@pytest.mark.parametrize("timing", TIMING)
@pytest.mark.parametrize("dt", [1e-3, 0.1, 1 / 3])
def test_from_the_first_held_sample_on_there_is_no_feedforward(timing, dt):
    """However i·dt rounds, the sample at the end of the line is a held one, at the goal."""
    ticks = round(2.0 / dt)
    course = Line(to=GOAL, duration=2.0, timing=timing).start(POSES, START, 0.0)
    for i in (ticks, ticks + 1, ticks + 1000):
        value, rate = sample(course, i * dt)
        np.testing.assert_allclose(value, GOAL, atol=1e-14)
        np.testing.assert_array_equal(rate, 0.0)


@pytest.mark.parametrize("timing", TIMING)
def test_an_open_loop_that_sums_the_rate_arrives(timing):
    """Σ ẋ_d dt over the samples before the end is the displacement, up to the rectangle rule's dt."""
    dt = 1e-3
    course = Line(by=[0.5, 0.0, 0.0], duration=1.0, timing=timing).start(POSES, START, 0.0)
    travelled = sum(sample(course, i * dt)[1][0] for i in range(2000)) * dt
    assert abs(travelled - 0.5) < (1e-12 if timing == "linear" else 1e-6)


@pytest.mark.parametrize("timing", TIMING)
def test_timing_laws_run_from_zero_to_one_and_never_back(timing):
    """s(0) = 0, s(1) = 1, ds/du ≥ 0, and symmetric: s(u) + s(1 − u) = 1."""
    law = TIMING[timing]
    u = np.linspace(0.0, 1.0, 101)
    s, speed, change = np.array([law(float(x)) for x in u]).T
    assert s[0] == pytest.approx(0.0, abs=1e-15)
    assert s[-1] == pytest.approx(1.0)
    assert (speed >= 0.0).all()
    np.testing.assert_allclose(change[1:-1], -change[-2:0:-1], atol=1e-12)
    np.testing.assert_allclose(s + s[::-1], 1.0, atol=1e-14)


def test_the_circle_of_the_chapter_is_one_line():
    """p_d = [0.25 (1 − cos πt), 0.25 (2 + sin πt)] of Sect. 3.7.5, and two turns last 4 s."""
    start = np.eye(4)
    start[1, 3] = 0.5
    circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2)
    course = circle.start(POSES, start, 0.0)
    for t in np.linspace(0.0, 3.999, 50):
        value, rate = sample(course, float(t))
        c, s = np.cos(np.pi * t), np.sin(np.pi * t)
        np.testing.assert_allclose(value[:2, 3], [0.25 * (1 - c), 0.25 * (2 + s)], atol=1e-15)
        np.testing.assert_allclose(rate[:2], [0.25 * np.pi * s, 0.25 * np.pi * c], atol=1e-14)
    value, rate = sample(course, 4000 * 1e-3)
    np.testing.assert_allclose(value, start, atol=1e-15)
    np.testing.assert_array_equal(rate, 0.0)


@pytest.mark.parametrize("timing", [law for law in TIMING if law != "linear"])
def test_a_circle_with_a_timing_law_goes_from_rest_to_rest(timing):
    """It is the circle of constant speed at s(u) of its duration, and its rate vanishes at both ends."""
    even = Circle(radius=0.2, period=1.3, turns=1.5).start(POSES, START, 0.0)
    timed = Circle(radius=0.2, period=1.3, turns=1.5, timing=timing).start(POSES, START, 0.0)
    end = 1.5 * 1.3
    for u in (0.1, 0.4, 0.5, 0.8):
        expected = sample(even, TIMING[timing](u)[0] * end)[0]
        np.testing.assert_allclose(sample(timed, u * end)[0], expected, atol=1e-14)
    for t in (0.0, end - 1e-8):
        assert np.abs(sample(timed, t)[1]).max() < 1e-7
        assert np.abs(sample(even, t)[1]).max() > 0.5
    value, rate = sample(timed, end)
    np.testing.assert_allclose(value, sample(even, end)[0], atol=1e-14)
    np.testing.assert_array_equal(rate, 0.0)


def test_a_circle_without_an_end_has_no_timing_law():
    """Nothing says when it would come to rest; a law of an unknown name is refused, too."""
    with pytest.raises(InvalidValue, match="timing law 'cubic' needs a number of `turns`"):
        Circle(radius=0.1, period=1.0, timing="cubic")
    with pytest.raises(UnknownName, match="timing law"):
        Circle(radius=0.1, period=1.0, turns=1, timing="cubik")


def test_a_function_that_holds_has_no_feedforward_from_that_sample_on():
    """Differences look forward: at the corner t = 1 the rate is that of what follows."""
    course = Function(lambda t: [min(t, 1.0), 0.0, 0.0]).start(POSES, START, 0.0)
    assert sample(course, 0.9)[1][0] == pytest.approx(1.0)
    assert sample(course, 1.0)[1][0] == 0.0


@given(t=st.floats(0.0, 1e5))
def test_differences_stay_good_at_any_time(t):
    """At t = 1e5 s the rounding of t itself, 1e-11 s, is taken out: the rate is good to 1e-6."""
    course = Function(lambda t: [np.sin(t), np.cos(t), 0.1 * t]).start(POSES, START, 0.0)
    want = [np.cos(t), -np.sin(t), 0.1]
    np.testing.assert_allclose(sample(course, t)[1][:3], want, atol=1e-8 + 1e-11 * t)


def test_latest_gives_what_was_set_last():
    """Start, then a pose with its velocity, then a position without one."""
    target = Latest()
    course = target.start(POSES, START, 0.0)
    np.testing.assert_array_equal(sample(course, 0.0)[0], START)
    target.set(pin.SE3(GOAL), velocity=[1, 2, 3, 4, 5, 6])
    value, rate = sample(course, 0.0)
    np.testing.assert_allclose(value, GOAL)
    np.testing.assert_array_equal(rate, [1, 2, 3, 4, 5, 6])
    target.set([0.1, 0.2, 0.3])
    value, rate = sample(course, 0.0)
    np.testing.assert_array_equal(value[:3, 3], [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(value[:3, :3], START[:3, :3])
    np.testing.assert_array_equal(rate, 0.0)


def test_latest_keeps_a_copy():
    """Changing the array afterwards does not move the target."""
    pose = GOAL.copy()
    target = Latest(pose)
    pose[:] = np.nan
    np.testing.assert_allclose(sample(target.start(POSES, START, 0.0), 0.0)[0], GOAL)


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (np.full((4, 4), np.nan), "NaN"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "rotation"),
        (2.0 * np.eye(3), "rotation"),
        (np.zeros(4), "4×4"),
        ([0.0, np.inf, 0.0], "not finite"),
        (np.eye(4) + np.eye(4)[::-1] * 1e-3, "rotation|last row"),
    ],
)
@pytest.mark.parametrize(
    "kind", [Hold, lambda v: Line(to=v, duration=1.0), lambda v: Function(lambda t: v), Latest]
)
def test_what_is_no_pose_is_refused(kind, value, says):
    """NaN, mirror images, scaled axes and wrong shapes are named, at the first tick at the latest."""
    of = robot("panda")

    def first_tick():
        task = FrameTask("panda_hand", target=kind(value))
        Stack([[task]]).compile(of, 1e-3).at(of.posture("middle"), 0.0)

    with pytest.raises(InvalidValue, match=rf"(?s)target of 'panda_hand'.*{says}"):
        first_tick()


@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (lambda: Line(to=GOAL, duration=0.0), InvalidValue, "duration"),
        (lambda: Line(duration=1.0), InvalidValue, "neither"),
        (lambda: Line(to=GOAL, by=[0, 0, 1], duration=1.0), InvalidValue, "both"),
        (lambda: Line(to=GOAL, duration=1.0, timing="cubik"), UnknownName, "cubic"),
        (lambda: Circle(radius=-0.1, period=1.0), InvalidValue, "radius"),
        (lambda: Circle(radius=0.1, period=np.nan), InvalidValue, "period"),
        (
            lambda: Circle(radius=0.1, period=1.0, toward=(0, 1, 1), along=(0, 1, 0)),
            InvalidValue,
            "right angles",
        ),
        (lambda: Circle(radius=0.1, period=1.0, toward=(0, 0, 0)), InvalidValue, "direction"),
        (lambda: Function(3.0), InvalidValue, "function of time"),
        (lambda: Latest([[1.0], [2.0, 3.0]]), InvalidValue, "numbers"),
    ],
)
def test_a_senseless_target_is_refused_where_it_is_written(make, error, says):
    """Each with the value it got and the way out."""
    with pytest.raises(error, match=says):
        make()


def test_a_bare_value_is_held():
    """as_target leaves targets alone and wraps the rest."""
    line = Line(to=GOAL, duration=1.0)
    assert as_target(line) is line
    assert isinstance(as_target(GOAL), Hold)


@pytest.mark.parametrize("name", ["panda", "tiago", "talos_reduced"])
def test_a_line_between_postures_keeps_one_velocity_ratio(name):
    """q(s) = q_0 ⊕ s (q_1 ⊖ q_0): it arrives, and its rate is the derivative on the manifold."""
    of = robot(name)
    q0, q1 = generic_q(of, 0), generic_q(of, 1, spread=0.8)
    course = Line(to=q1, duration=2.0).start(PostureSpace("target", of, of.joints), q0, 0.0)
    q, rate, h = np.empty(of.nq), np.empty(of.nv), 1e-5
    before, after = np.empty(of.nq), np.empty(of.nq)
    course(0.7 - h, before, rate)
    course(0.7 + h, after, rate)
    course(0.7, q, rate)
    np.testing.assert_allclose(rate, of.difference(before, after) / (2 * h), atol=1e-8)
    assert not course(2.0, q, rate)
    np.testing.assert_allclose(of.difference(q, q1), 0.0, atol=1e-12)
