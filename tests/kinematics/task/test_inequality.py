"""Inequality tasks: exact derivatives, silence while met, dampers at the edge, a way back from outside."""

import numpy as np
import pytest

from taskopt import Controller, FrameTask, Function, JointTask, Stack
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.task import BoxTask, GazeTask, PositionTask
from tests.helpers.moving import bound
from tests.helpers.robots import FRAMES, generic_q, robot

SIGHT = (0.3, -0.5, 0.8)  # a generic axis of the frame


def moving_point(at, frame, seed):
    """A point near the frame in generic motion, with its exact rate."""
    rng = np.random.default_rng(seed)
    near, velocity = at.pose(frame)[:3, 3] + rng.normal(size=3), rng.normal(size=3)
    return Function(lambda t: near + t * velocity, lambda t: velocity)


def task_of(kind, at, frame, seed):
    if kind == "box":
        p = at.pose(frame)[:3, 3]
        return BoxTask(frame, p - [0.1, np.inf, 0.3], p + [0.2, 0.1, np.inf], gain=7.0)
    return GazeTask(frame, moving_point(at, frame, seed), 0.4, axis=SIGHT, gain=7.0)


def mismatch(task, of, seed, t=0.3, h=4e-6):
    """max |ċ − (A v + rate)| by central differences of the coordinate c along a generic motion."""
    q, v = generic_q(of, seed), np.random.default_rng(seed + 1).normal(size=of.nv)
    ready, rows = bound(task, Configuration(of, q))

    def value(s):
        ready.fill(Configuration(of, of.integrate(q, v, s)), t + s, rows)
        return ready.value.copy()

    numeric = (value(h) - value(-h)) / (2.0 * h)
    ready.fill(Configuration(of, q), t, rows)
    edge = task.half_angle if isinstance(task, GazeTask) else np.asarray(task.upper)
    rate = 0.0 if isinstance(task, BoxTask) else ready.gain * (edge - ready.value) - rows.upper
    return float(np.abs(numeric - rows.A @ v - rate).max())


@pytest.mark.parametrize("kind", ["box", "gaze"])
@pytest.mark.parametrize("name", FRAMES)
def test_rows_are_the_derivative_of_the_coordinate(name, kind):
    """ċ = A v plus what the target's own motion does, on robots of four kinds."""
    of, frame = robot(name), FRAMES[name]
    for seed in range(4):
        at = Configuration(of, generic_q(of, seed))
        assert mismatch(task_of(kind, at, frame, seed), of, seed) < 2e-8


def test_a_target_whose_motion_is_not_told_is_caught():
    """The check above fails if the rate of the point is left out."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    right = moving_point(at, "panda_hand", 0)
    wrong = GazeTask("panda_hand", Function(right.value, lambda t: np.zeros(3)), 0.4, axis=SIGHT, gain=7.0)
    assert mismatch(wrong, of, 0) > 1e-2


@pytest.mark.parametrize("away", [1e-7, 1e-3, np.pi - 1e-3, np.pi - 1e-7])
def test_the_row_of_a_gaze_has_unit_length_from_straight_ahead_to_straight_behind(away):
    """Turning about n changes the angle one to one, where its cosine says nothing."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    T = at.pose("panda_hand")
    direction = np.cos(away) * T[:3, 2] + np.sin(away) * T[:3, 0]
    ready, rows = bound(GazeTask("panda_hand", T[:3, 3] + 0.7 * direction, 0.2), at)
    n = np.cross(T[:3, 2], direction) / np.sin(away)
    turn = np.linalg.lstsq(at.jacobian("panda_hand"), np.concatenate([np.zeros(3), n]), rcond=None)[0]
    assert rows.A[0] @ turn == pytest.approx(-1.0, abs=1e-7)
    assert ready.value[0] == pytest.approx(away, rel=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_exactly_ahead_and_exactly_behind_there_is_still_a_way_to_turn(side):
    """The row is not zero there: the angle can be held, and from behind it can be reduced."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    T = at.pose("panda_hand")
    _, rows = bound(GazeTask("panda_hand", T[:3, 3] + side * 0.7 * T[:3, 2], 0.2), at)
    assert np.isfinite(rows.A).all()
    assert np.linalg.norm(rows.A) > 0.1


def test_what_is_met_asks_for_nothing():
    """Deep inside box and cone, v = 0 is within the bounds and the error is zero."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    T = at.pose("panda_hand")
    p, ahead = T[:3, 3], T[:3, 3] + 0.5 * T[:3, 2]
    for task in (BoxTask("panda_hand", p - 0.1, p + 0.1), GazeTask("panda_hand", ahead, 0.3)):
        ready, rows = bound(task, at)
        assert (rows.lower <= 0.0).all()
        assert (rows.upper >= 0.0).all()
        assert not ready.error.any()


@pytest.mark.parametrize("level", [1, 2])
def test_a_hand_that_is_pulled_out_of_its_box_stays_at_the_edge(level):
    """Above or below the pull in priority: kept inside when above, given up when below."""
    of, dt = robot("panda"), 5e-3
    q = of.posture("default")
    start = Configuration(of, q).pose("panda_hand")[:3, 3]
    keep = BoxTask("panda_hand", start - 0.05, start + 0.05, gain=50.0)
    pull = PositionTask("panda_hand", target=start + [0.0, 0.15, 0.0], gain=5.0)
    levels = [[keep], [pull]] if level == 1 else [[pull], [keep]]
    control = Controller(of, Stack([*levels, [JointTask()]]), dt=dt)
    for k in range(400):
        resolution = control.step(q, k * dt)
        assert resolution.kkt_met()
        q = of.integrate(q, resolution.v, dt)
    moved = Configuration(of, q).pose("panda_hand")[:3, 3] - start
    assert moved[1] == pytest.approx(0.05 if level == 1 else 0.15, abs=1e-4)
    assert (np.abs(moved) < 0.0501).all() or level == 2


def test_eyes_come_back_into_the_cone_and_stay_there():
    """From 1 rad outside, the angle falls to the half angle and the hand holds its place meanwhile."""
    of, dt = robot("panda"), 5e-3
    q = of.posture("default")
    T = Configuration(of, q).pose("panda_hand")
    target = T[:3, 3] + 0.5 * (np.cos(0.6) * T[:3, 2] + np.sin(0.6) * T[:3, 0])
    gaze = GazeTask("panda_hand", target, 0.2, gain=20.0)
    stay = FrameTask("panda_hand", axes="xyz", expressed="world", gain=20.0)
    control = Controller(of, Stack([[gaze], [stay], [JointTask()]]), dt=dt)
    angles = []
    for k in range(400):
        q = of.integrate(q, control.step(q, k * dt).v, dt)
        angles.append(control.plan.tasks[0].value[0])  # type: ignore[attr-defined]
    assert angles[0] == pytest.approx(0.6, abs=1e-9)
    assert (np.diff(angles) <= 1e-9).all()
    assert angles[-1] == pytest.approx(0.2, abs=1e-4)
    np.testing.assert_allclose(Configuration(of, q).pose("panda_hand")[:3, 3], T[:3, 3], atol=1e-4)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: BoxTask("panda_hand", np.ones(3), np.zeros(3)), "lower ≤ upper"),
        (lambda: BoxTask("panda_hand", np.full(3, -np.inf), np.full(3, np.inf)), "side"),
        (lambda: BoxTask("panda_hand", [0.0, np.nan, 0.0], np.ones(3)), "NaN"),
        (lambda: GazeTask("panda_hand", np.zeros(3), 4.0), "half_angle"),
        (lambda: GazeTask("panda_hand", np.zeros(3), -0.1), "half_angle"),
        (lambda: GazeTask("panda_hand", np.zeros(3), 0.1, axis=np.zeros(3)), "direction"),
    ],
)
def test_declarations_that_make_no_sense_are_refused(make, words):
    """Crossed or missing sides, NaN, angles of no cone, an axis without direction."""
    with pytest.raises(InvalidValue, match=words):
        make()


@pytest.mark.parametrize(
    "task", [BoxTask("hand", np.zeros(3), np.ones(3)), GazeTask("hand", np.ones(3), 0.1)]
)
def test_an_unknown_frame_is_refused(task):
    """When the task is bound."""
    with pytest.raises(UnknownName, match="panda_hand"):
        task.bind(robot("panda"), "task")
