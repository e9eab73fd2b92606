"""Damping that grows with the error of its task: the formula, its contract, and what it does out of reach."""

import numpy as np
import pytest

from taskopt import (
    BoxTask,
    Configuration,
    Controller,
    DampedTask,
    DampingTask,
    During,
    FrameTask,
    GazeTask,
    InvalidValue,
    LevelDamping,
    LowAccelerationTask,
    PositionTask,
    Stack,
    resolve,
)
from taskopt.testing import check_task
from tests.helpers.moving import bound, tumbling
from tests.helpers.robots import FRAMES, generic_q, robot


@pytest.mark.parametrize("name", FRAMES)
def test_a_damped_task_keeps_the_contract(name):
    """The rows of the task stay its rows, with and without a kernel; the others are k times unit vectors."""
    of = robot(name)
    target = tumbling(Configuration(of, of.posture("middle")).pose(FRAMES[name]), 1)
    check_task(DampedTask(FrameTask(FRAMES[name], target=target, gain=4.0, weight=0.3), 0.1), of, count=5)
    check_task(DampedTask(BoxTask(FRAMES[name], [9.0] * 3, [9.5] * 3), 0.1), of, count=5)


@pytest.mark.parametrize("resolver", ["pinv", "active-set", "hqp/daqp", "cvxpy/clarabel"])
def test_the_answer_is_damped_least_squares_with_the_error_as_damping(resolver):
    """v = (JᵀWJ + μ eᵀWe I)⁻¹ JᵀW K e, by elementary algebra."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    goal = at.pose("panda_hand")[:3, 3] + [0.3, -0.2, 0.4]
    task = PositionTask("panda_hand", target=goal, gain=3.0, weight=(1.0, 2.0, 0.5))
    v = resolve(Stack([[DampedTask(task, 0.7)]]).at(at, dt=1e-3), resolver).x
    J, e, W = at.jacobian("panda_hand")[:3], np.array([0.3, -0.2, 0.4]), np.diag([1.0, 2.0, 0.5])
    expected = np.linalg.solve(J.T @ W @ J + 0.7 * (e @ W @ e) * np.eye(7), J.T @ W @ (3.0 * e))
    np.testing.assert_allclose(v, expected, atol=1e-7 if resolver.startswith("cvxpy") else 1e-10)


def test_an_inequality_stays_one_sided():
    """A gaze that is damped bounds the angle from above, as it does alone."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    gaze = GazeTask("panda_hand", (0.3, 0.4, 5.0), half_angle=0.01, axis=(0.0, 1.0, 0.2), gain=2.0)
    check_task(DampedTask(gaze, 0.5), of, count=5)
    _, alone = bound(gaze, at)
    _, damped = bound(DampedTask(gaze, 0.5), at)
    np.testing.assert_array_equal(damped.lower[:1], -np.inf)
    np.testing.assert_array_equal(damped.upper[:1], alone.upper)


def test_at_the_target_nothing_is_damped():
    """With e = 0 the damping rows are zero, and levels below get what the task leaves."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    task = DampedTask(FrameTask("panda_hand"), 10.0)
    ready, rows = bound(task, at)
    assert not rows.A[6:].any()
    assert ready.frame == "panda_hand"
    np.testing.assert_array_equal(ready.desired, ready.actual)


def test_out_of_reach_it_moves_less():
    """A target two metres away: the stretched arm is slower than without damping, and ends at least as near.

    Undamped it chatters at full stretch, so how near it ends there hangs on rounding; damped it may only be
    nearer.
    """
    of, dt = robot("panda"), 5e-3
    far = Configuration(of, of.posture("default")).pose("panda_hand")[:3, 3] + [2.0, 0.0, 0.0]
    task = PositionTask("panda_hand", target=far, gain=2.0)
    fastest, last = [], []
    for level in ([task, DampingTask(1e-6)], [DampedTask(task, 0.02)]):
        q = of.posture("default")
        control = Controller(of, Stack([level], damping=None), dt=dt)
        speeds = []
        for k in range(400):
            v = control.step(q, k * dt).v
            speeds.append(np.abs(v).max())
            q = of.integrate(q, v, dt)
        fastest.append(max(speeds))
        last.append(np.linalg.norm(Configuration(of, q).pose("panda_hand")[:3, 3] - far))
    assert fastest[1] < 0.2 * fastest[0]
    assert last[1] < last[0] + 0.05


def test_damping_that_does_not_grow_is_caught(monkeypatch):
    """The algebra above fails if the damping rows keep the size of the first tick."""
    monkeypatch.setattr("taskopt.kinematics.task.damped.np.fill_diagonal", lambda A, k: None)
    with pytest.raises(AssertionError):
        test_the_answer_is_damped_least_squares_with_the_error_as_damping("active-set")


def test_a_damped_task_may_be_timed_and_may_follow_the_velocity():
    """`During` opens the damping rows, too, and closes them again; the last velocity is handed on."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    timed = During(DampedTask(PositionTask("panda_hand", target=np.ones(3)), 1.0), begin=1.0, blend=0.5)
    ready, rows = bound(timed, at)
    assert np.isinf(rows.lower).all()
    ready.fill(at, 2.0, rows)
    np.testing.assert_array_equal(rows.lower[3:], 0.0)
    plan = Stack([[DampedTask(LowAccelerationTask(), 1.0)]]).compile(of, 1e-3)
    plan.start(at.q)
    plan.moved(np.arange(7.0))
    np.testing.assert_array_equal(plan.at(at.q, 0.0).lower[:7], np.arange(7.0))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: DampedTask(During(FrameTask("tip")), 1.0), "During takes a damped task"),
        (lambda: DampedTask(LevelDamping(), 1.0), "neither timed nor damping"),
        (lambda: DampedTask("tip", 1.0), "task must be a task"),
        (lambda: DampedTask(FrameTask("tip"), -1.0), "factor must be ≥ 0"),
        (lambda: DampedTask(FrameTask("tip"), np.nan), "factor has NaN"),
    ],
)
def test_what_makes_no_sense_is_refused(make, words):
    """Tasks that cannot be damped, negative factors."""
    with pytest.raises(InvalidValue, match=words):
        make()
