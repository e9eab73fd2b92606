"""Velocities asked for outright: given ones, those of the last tick, and who tells a task the last tick."""

import numpy as np
import pytest

from taskopt import (
    Configuration,
    Controller,
    DampingTask,
    During,
    InvalidValue,
    JointTask,
    JointVelocityTask,
    LowAccelerationTask,
    PositionTask,
    Stack,
    UnknownName,
    resolve,
)
from taskopt.kinematics.stack import Plan
from taskopt.testing import check_task
from tests.helpers.moving import bound
from tests.helpers.robots import FRAMES, generic_q, robot

FIRST = {
    "planar": "joint2",
    "panda": "panda_joint4",
    "tiago": "arm_2_joint",
    "talos_reduced": "torso_1_joint",
}


@pytest.mark.parametrize("name", FRAMES)
def test_both_keep_the_contract(name):
    """Unit vectors that stay, units and names that fit, on robots of four kinds."""
    check_task(JointVelocityTask({FIRST[name]: 0.3}, weight=2.0), robot(name), count=4)
    check_task(JointVelocityTask(lambda t: {FIRST[name]: np.sin(t)}), robot(name), count=4)
    check_task(LowAccelerationTask(0.1), robot(name), count=4)


@pytest.mark.parametrize("resolver", ["pinv", "active-set", "hqp/daqp", "cvxpy/clarabel"])
def test_the_joints_move_at_the_given_velocities(resolver):
    """v = q̇_d on the joints that are named, and zero elsewhere, since the norm decides there."""
    of = robot("talos_reduced")
    at = Configuration(of, generic_q(of, 0))
    wanted = {"torso_1_joint": 0.4, "arm_left_4_joint": -0.7}
    v = resolve(Stack([[JointVelocityTask(wanted)]]).at(at, dt=1e-3), resolver).x
    expected = np.zeros(of.nv)
    for joint, speed in wanted.items():
        expected[of.velocity_index(joint)] = speed
    np.testing.assert_allclose(v, expected, atol=1e-9)


def test_all_forms_of_a_velocity_mean_the_same():
    """A mapping, one number a joint, all velocities, and a function of time."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    two, whole = ("panda_joint2", "panda_joint6"), np.array([0.0, 0.5, 0.0, 0.0, 0.0, -0.2, 0.0])
    for task in (
        JointVelocityTask({"panda_joint2": 0.5, "panda_joint6": -0.2}),
        JointVelocityTask([0.5, -0.2], joints=two),
        JointVelocityTask(whole, joints=two),
        JointVelocityTask(lambda t: [t, -0.2], joints=two),
    ):
        ready, rows = bound(task, at, 0.5)
        assert ready.row_names == two
        np.testing.assert_array_equal(rows.lower, [0.5, -0.2])
        np.testing.assert_array_equal(rows.A, np.eye(7)[[1, 5]])


def test_the_six_velocities_of_a_floating_base_may_be_asked_for():
    """A free-flyer that is named has six rows, from all velocities (nv,)."""
    of = robot("talos_reduced")
    v = np.zeros(of.nv)
    v[:6] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    _, rows = bound(JointVelocityTask(v, joints=("root_joint",)), Configuration(of, generic_q(of, 0)))
    np.testing.assert_array_equal(rows.lower, v[:6])


def first_order(ticks, low, damping=0.0, during=False, resolver="active-set"):
    """Velocities of a hand that is sent away, with a cost of changes in the same level."""
    of, dt = robot("panda"), 5e-3
    q = of.posture("default")
    goal = Configuration(of, q).pose("panda_hand")[:3, 3] + [0.0, 0.2, 0.0]
    task = LowAccelerationTask(low)
    level = [PositionTask("panda_hand", target=goal, gain=5.0), During(task) if during else task]
    if damping:
        level.append(DampingTask(damping))
    control = Controller(of, Stack([level]), resolver, dt)
    out = []
    for k in range(ticks):
        out.append(control.step(q, k * dt).v.copy())
        q = of.integrate(q, out[-1], dt)
    return np.array(out)


@pytest.mark.parametrize("resolver", ["pinv", "active-set", "hqp/daqp"])
def test_changes_of_velocity_cost(resolver):
    """v minimises ‖J v − b‖² + w ‖v − v_last‖², by elementary algebra, tick after tick from rest."""
    of, dt, w = robot("panda"), 5e-3, 0.3
    q, last = of.posture("default"), np.zeros(7)
    goal = Configuration(of, q).pose("panda_hand")[:3, 3] + [0.0, 0.2, 0.0]
    for v in first_order(30, w, resolver=resolver):
        at = Configuration(of, q)
        J, b = at.jacobian("panda_hand")[:3], 5.0 * (goal - at.pose("panda_hand")[:3, 3])
        expected = np.linalg.solve(J.T @ J + w * np.eye(7), J.T @ b + w * last)
        np.testing.assert_allclose(v, expected, atol=1e-8)
        q, last = of.integrate(q, v, dt), v


def test_the_first_tick_starts_from_rest_or_from_the_velocity_that_is_given():
    """A restart forgets the last velocity, and `step(v=…)` sets it."""
    of = robot("panda")
    q = of.posture("default")
    control = Controller(of, Stack([[LowAccelerationTask(joints=("panda_joint1",))]]), dt=1e-3)
    assert not control.step(q, 0.0).v.any()
    given = np.full(7, 0.2)
    np.testing.assert_allclose(control.step(q, 0.001, v=given).v, [0.2, 0, 0, 0, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(control.step(q, 0.002).v, [0.2, 0, 0, 0, 0, 0, 0], atol=1e-12)
    control.start(q)
    assert not control.step(q, 0.0).v.any()


def test_a_task_that_is_not_told_is_caught(monkeypatch):
    """The algebra above fails if the plan tells limits only."""
    told = first_order(10, 0.3)
    monkeypatch.setattr(Plan, "moved", lambda self, v: [part.moved(v) for part in self.rate_limits])
    assert np.abs(first_order(10, 0.3) - told)[1:].max() > 1e-2


def test_a_timed_task_is_told_too():
    """`During` hands the velocity on."""
    np.testing.assert_allclose(first_order(20, 0.3, during=True), first_order(20, 0.3), atol=1e-12)


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: JointVelocityTask([1.0], joints="joint1"), InvalidValue, "different names in a list"),
        (lambda: LowAccelerationTask(joints=("a", "a")), InvalidValue, "different names in a list"),
        (lambda: JointVelocityTask({"a": 1.0}).bind(robot("panda"), "t"), UnknownName, "'a'"),
        (lambda: JointVelocityTask(np.ones(3)).bind(robot("panda"), "t"), InvalidValue, "7 numbers"),
        (lambda: JointVelocityTask({"panda_joint1": np.nan}).bind(robot("panda"), "t"), InvalidValue, "NaN"),
        (lambda: JointVelocityTask({}).bind(robot("panda"), "t"), InvalidValue, "has no joint"),
        (lambda: LowAccelerationTask(-1.0).bind(robot("panda"), "t"), InvalidValue, "weight must be ≥ 0"),
    ],
)
def test_what_makes_no_sense_is_refused(make, error, words):
    """Names that are no list, unknown joints, wrong sizes, no number."""
    with pytest.raises(error, match=words):
        make()


def test_a_function_that_returns_no_velocity_is_named():
    """At the tick at which it does so."""
    plan = Stack([[JointVelocityTask(lambda t: [np.inf] * 7, name="spin")], [JointTask()]]).compile(
        robot("panda"), 1e-3
    )
    with pytest.raises(InvalidValue, match="target of 'spin' has a value that is not finite"):
        plan.at(robot("panda").posture("default"), 0.0)
