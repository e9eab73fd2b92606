"""Axes that point along a direction or at a point: rank 2 at every angle, 180 degrees included."""

import numpy as np
import pytest

from taskopt import (
    AxisAlignmentTask,
    Configuration,
    Controller,
    Function,
    InvalidValue,
    JointTask,
    JointVelocityLimit,
    Line,
    LookAtTask,
    PositionTask,
    Stack,
    UnknownName,
    WithoutRate,
    resolve,
)
from taskopt.kinematics.pose import exp3
from taskopt.kinematics.task import alignment
from taskopt.kinematics.task.alignment import DirectionSpace
from taskopt.testing import check_task
from tests.helpers.moving import bound
from tests.helpers.robots import FRAMES, generic_q, robot

AXIS = (0.3, -0.5, 0.8)


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (-0.2, 3.0, 0.4), (1.0, 0.0, -1.0)])
@pytest.mark.parametrize("name", FRAMES)
def test_alignment_keeps_the_contract(name, direction):
    """A is the derivative of the turn that is left, on robots of four kinds."""
    check_task(
        AxisAlignmentTask(FRAMES[name], AXIS, direction=direction, gain=3.0, weight=2.0), robot(name), count=6
    )


@pytest.mark.parametrize("name", FRAMES)
def test_looking_keeps_the_contract(name):
    """The same for the line of sight to a point that moves."""
    point, velocity = np.array([1.5, -0.7, 1.9]), np.array([0.3, -0.2, 0.5])
    target = Function(lambda t: point + t * velocity, lambda t: velocity)
    check_task(LookAtTask(FRAMES[name], target, axis=AXIS, gain=3.0, weight=(1.0, 2.0)), robot(name), count=6)


@pytest.mark.parametrize("fault", ["sign", "circle", "angle"])
def test_a_wrong_derivative_is_caught(monkeypatch, fault):
    """The checks fail with a sign, with φ/sin φ taken for 1, and with the derivative of φ left out."""

    def wrong(axis, tangent, seen, error, slope):
        alignment_right(axis, tangent, seen, error, slope)
        s = error / np.linalg.norm(error)
        along = np.outer(s, s) @ slope
        slope[:] = {"sign": -slope, "circle": slope + 0.01 * (slope - along), "angle": slope - along}[fault]

    alignment_right = alignment.turn_into
    monkeypatch.setattr(alignment, "turn_into", wrong)
    with pytest.raises(AssertionError, match="not the derivative"):
        check_task(
            AxisAlignmentTask("panda_hand", AXIS, direction=(0.0, 1.0, 0.0), gain=3.0),
            robot("panda"),
            count=6,
        )
    with pytest.raises(AssertionError, match="not the derivative"):
        check_task(LookAtTask("panda_hand", (0.5, 0.5, 2.0), axis=AXIS, gain=3.0), robot("panda"), count=6)


def facing(of, q, angle, seed=0):
    """A direction in the world at an angle [rad] from the z-axis of the hand, to a generic side."""
    R = Configuration(of, q).pose("panda_hand")[:3, :3]
    side = np.random.default_rng(seed).normal(size=2)
    turn = np.append(side / np.linalg.norm(side), 0.0)
    return R @ exp3(angle * turn) @ [0.0, 0.0, 1.0]


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.5, np.pi / 2, 3.0, np.pi - 1e-4, np.pi - 1e-10, np.pi])
def test_the_rows_have_rank_two_at_every_angle(angle):
    """The error is as long as the angle, and both rows stay between 1 and 400 in size."""
    of = robot("panda")
    q = generic_q(of, 0)
    at = Configuration(of, q)
    ready, rows = bound(AxisAlignmentTask("panda_hand", direction=facing(of, q, angle)), at)
    assert np.linalg.norm(ready.error) == pytest.approx(angle, abs=2e-8)
    turning = rows.A @ np.linalg.pinv(at.jacobian("panda_hand", "own")[3:])
    sizes = np.linalg.svd(turning, compute_uv=False)
    assert sizes.min() > 0.99
    assert sizes.max() < 400.0


@pytest.mark.slow
@pytest.mark.parametrize("angle", [1.0, 3.0, np.pi - 1e-12, np.pi])
def test_the_axis_goes_to_its_direction_on_the_shortest_way(angle):
    """The angle falls by 1 − K Δt a tick, from exactly the wrong side, too, and the hand keeps its place."""
    of, dt = robot("panda"), 5e-3
    q = of.posture("default")
    goal = facing(of, q, angle) if angle < np.pi else -Configuration(of, q).pose("panda_hand")[:3, 2]
    task = AxisAlignmentTask("panda_hand", direction=goal, gain=4.0)
    control = Controller(of, Stack([[task], [JointTask()]], damping=None), dt=dt)
    angles = []
    for k in range(300):
        z = Configuration(of, q).pose("panda_hand")[:3, 2]
        angles.append(np.arctan2(np.linalg.norm(np.cross(z, goal)), z @ goal))
        q = of.integrate(q, control.step(q, k * dt).v, dt)
    np.testing.assert_allclose(np.array(angles[1:100]) / angles[:99], 0.98, atol=2e-3)
    assert angles[-1] < 0.01


@pytest.mark.slow
def test_eyes_follow_a_moving_point_without_lag():
    """With the velocity of the point fed forward, the axis stays on a moving point to 1e-3 rad."""
    of, dt = robot("panda"), 2e-3
    q = of.posture("default")
    start = Configuration(of, q).pose("panda_hand")
    point = start[:3, 3] + 0.5 * start[:3, 2]
    target = Function(
        lambda t: point + [0.0, 0.1 * np.sin(2.0 * t), 0.0],
        derivative=lambda t: np.array([0.0, 0.2 * np.cos(2.0 * t), 0.0]),
    )
    stay = PositionTask("panda_hand", gain=10.0)
    control = Controller(
        of, Stack([[stay], [LookAtTask("panda_hand", target, gain=20.0)], [JointTask()]]), dt=dt
    )
    for k in range(500):
        q = of.integrate(q, control.step(q, k * dt).v, dt)
        pose, sight = Configuration(of, q).pose("panda_hand"), np.asarray(target.value((k + 1) * dt))
        sight = (sight - pose[:3, 3]) / np.linalg.norm(sight - pose[:3, 3])
        assert np.linalg.norm(np.cross(pose[:3, 2], sight)) < 1e-3


def swung(t):
    """A direction that swings about a generic axis, not of length 1."""
    return exp3(np.array([0.3, -0.2, 0.5]) * np.sin(2.0 * t)) @ [0.2, -0.4, -1.5]


def turning(t):
    """Its angular velocity [rad/s]."""
    return np.array([0.3, -0.2, 0.5]) * 2.0 * np.cos(2.0 * t)


@pytest.mark.slow
@pytest.mark.parametrize("target", [Function(swung), Function(swung, turning), WithoutRate(Function(swung))])
def test_an_axis_follows_a_moving_direction_without_lag(target):
    """With the rate of the direction fed forward; without it the axis lags by its rate through the gain."""
    of, dt = robot("panda"), 2e-3
    q, worst = of.posture("default"), 0.0
    task = AxisAlignmentTask("panda_hand", direction=target, gain=20.0)
    control = Controller(of, Stack([[task], [JointTask()]]), dt=dt)
    for k in range(500):
        q = of.integrate(q, control.step(q, k * dt).v, dt)
        goal, z = swung((k + 1) * dt), Configuration(of, q).pose("panda_hand")[:3, 2]
        if k > 250:
            worst = max(worst, np.linalg.norm(np.cross(z, goal / np.linalg.norm(goal))))
    if isinstance(target, WithoutRate):
        assert worst > 0.02
    else:
        assert worst < 2e-3


def test_a_direction_follows_a_line_and_holds_what_was_at_the_start():
    """A quarter turn in 2 s is an eighth at 1 s; None holds the direction that the axis had at the start."""
    of = robot("panda")
    q = of.posture("default")
    z = Configuration(of, q).pose("panda_hand")[:3, 2]
    side = np.cross(z, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    moves = AxisAlignmentTask("panda_hand", direction=Line(to=side, duration=2.0), name="axis")
    plan = Stack([[moves]]).compile(of, 1e-3)
    plan.start(q, 3.0)
    plan.at(q, 4.0)
    assert np.linalg.norm(plan.tasks[0].error) == pytest.approx(np.pi / 4, abs=1e-9)
    held = Stack([[AxisAlignmentTask("panda_hand", direction=None)]]).compile(of, 1e-3)
    np.testing.assert_allclose(held.at(q, 4.0).lower, 0.0, atol=1e-12)


@pytest.mark.parametrize("degrees", [0.0, 1e-7, 30.0, 179.9, 180.0])
def test_the_turn_between_two_directions_leads_from_one_to_the_other(degrees):
    """exp(difference(a, b)) a = b, by the shortest way, also at exactly 180°."""
    space = DirectionSpace("direction")
    a = np.array([1.0, 2.0, -2.0]) / 3.0
    b = exp3(np.radians(degrees) * np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0)) @ a
    turn, out = space.difference(a, b), np.empty(3)
    assert np.linalg.norm(turn) == pytest.approx(np.radians(degrees), abs=1e-9)
    space.move(a, turn, out)
    np.testing.assert_allclose(out, b, atol=1e-9)


@pytest.mark.parametrize("kind", ["alignment", "look"])
def test_the_closed_form_and_the_model_in_cvxpy_agree(kind):
    """Without limits the answer is that of task priority; with a limit that binds, that of CVXPY."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 4))
    task = (
        AxisAlignmentTask("panda_hand", AXIS, direction=(0.0, 1.0, 0.5), gain=3.0)
        if kind == "alignment"
        else LookAtTask("panda_hand", (1.0, 1.0, 0.2), axis=AXIS, gain=3.0)
    )
    free = Stack([[task], [JointTask(of.posture("default"))]]).at(at, dt=1e-2)
    formula = resolve(free, "pinv").x
    np.testing.assert_allclose(resolve(free, "active-set").x, formula, atol=1e-9)
    slow = JointVelocityLimit(velocity=0.5 * float(np.abs(formula).max()))
    tight = Stack([[task], [JointTask(of.posture("default"))]], [slow]).at(at, dt=1e-2)
    ours, told = resolve(tight, "active-set"), resolve(tight, "cvxpy/clarabel")
    assert ours.active
    np.testing.assert_allclose(ours.x, told.x, atol=1e-7)


def test_a_point_at_the_eye_asks_for_no_turn():
    """Where there is no line of sight, the error is zero and the rows are finite."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    ready, rows = bound(LookAtTask("panda_hand", at.pose("panda_hand")[:3, 3]), at)
    assert not ready.error.any()
    assert np.isfinite(rows.A).all()


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: AxisAlignmentTask("tip", axis=np.zeros(3)), InvalidValue, "axis must be a direction"),
        (lambda: AxisAlignmentTask("tip", direction=(0.0, 1e-12, 0.0)), InvalidValue, "direction must be"),
        (lambda: LookAtTask("tip", np.ones(3), axis=(1.0, 0.0)), InvalidValue, "axis must have shape 3"),
        (lambda: AxisAlignmentTask("hand").bind(robot("panda"), "t"), UnknownName, "'hand'"),
        (lambda: LookAtTask("hand", np.ones(3)).bind(robot("panda"), "t"), UnknownName, "'hand'"),
    ],
)
def test_what_makes_no_sense_is_refused(make, error, words):
    """Vectors without direction, a frame that is not there."""
    with pytest.raises(error, match=words):
        make()
