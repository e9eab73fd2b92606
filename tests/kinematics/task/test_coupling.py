"""Linear relations of joints: exact rows, joints that move in a fixed ratio, and what is refused."""

import numpy as np
import pinocchio as pin
import pytest

from taskopt import (
    Configuration,
    Controller,
    InvalidValue,
    JointCouplingTask,
    JointTask,
    JointVelocityLimit,
    LinearHolonomicTask,
    PositionTask,
    Stack,
    UnknownName,
    resolve,
)
from taskopt.testing import check_task
from tests.helpers.moving import bound
from tests.helpers.robots import FRAMES, generic_q, robot

PAIRS = {
    "planar": ("joint1", "joint3"),
    "panda": ("panda_joint2", "panda_joint4"),
    "tiago": ("arm_2_joint", "torso_lift_joint"),
    "talos_reduced": ("leg_left_4_joint", "leg_right_4_joint"),
}


@pytest.mark.parametrize("name", FRAMES)
def test_couplings_keep_the_contract(name):
    """The row of a sum is the derivative of its error on robots of four kinds, floating base included."""
    first, second = PAIRS[name]
    check_task(JointCouplingTask({first: 1.5, second: -2.0}, 0.1, gain=4.0, weight=2.0), robot(name), count=5)


@pytest.mark.parametrize("name", FRAMES)
def test_linear_relations_keep_the_contract(name):
    """Rows over all velocities, of a free-flyer and wheels, too, from a posture that is not neutral."""
    of, rng = robot(name), np.random.default_rng(5)
    A, b = rng.normal(size=(3, of.nv)), rng.normal(size=3)
    task = LinearHolonomicTask(A, b, q0=generic_q(of, 7), gain=(1.0, 2.0, 3.0), weight=0.5)
    check_task(task, of, count=5)


def test_the_rows_are_those_of_the_formula():
    """e = b − A (q ⊖ q₀) and A D, with Pinocchio's difference and its derivative, on a floating base."""
    of = robot("talos_reduced")
    A, q0, q = np.random.default_rng(0).normal(size=(2, of.nv)), generic_q(of, 1), generic_q(of, 2)
    _, rows = bound(LinearHolonomicTask(A, [0.1, 0.2], q0=q0, gain=3.0), Configuration(of, q))
    rate = 3.0 * ([0.1, 0.2] - A @ pin.difference(of.model, q0, q))
    np.testing.assert_allclose(rows.lower, rate, atol=1e-12)
    np.testing.assert_allclose(rows.A, A @ pin.dDifference(of.model, q0, q, pin.ARG1), atol=1e-12)


def test_a_wrong_derivative_of_the_difference_is_caught(monkeypatch):
    """On a floating base the check fails if D is taken for the identity."""
    of = robot("talos_reduced")
    A = np.random.default_rng(0).normal(size=(1, of.nv))
    check_task(LinearHolonomicTask(A), of, count=4)
    monkeypatch.setattr(type(of), "difference_rates", lambda self, q0, q1: (None, np.eye(self.nv)))
    with pytest.raises(AssertionError, match="not the derivative"):
        check_task(LinearHolonomicTask(A), of, count=4)


def test_a_coupling_is_the_linear_relation_of_its_ratios():
    """Both have the same row and rate, and the unit of the joints."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 3))
    A = np.zeros(of.nv)
    A[1], A[3] = 2.0, -1.0
    ready, coupled = bound(JointCouplingTask({"panda_joint2": 2.0, "panda_joint4": -1.0}, 0.3, gain=2.0), at)
    _, linear = bound(LinearHolonomicTask(A, 0.3, gain=2.0), at)
    np.testing.assert_array_equal(coupled.A, linear.A)
    np.testing.assert_allclose(coupled.lower, linear.lower, atol=1e-15)
    assert coupled.lower[0] == pytest.approx(2.0 * (0.3 - 2.0 * at.q[1] + at.q[3]), abs=1e-12)
    assert ready.row_units == ("rad/s",)


@pytest.mark.slow
@pytest.mark.parametrize("resolver", ["pinv", "active-set", "hqp/daqp"])
def test_knees_bend_together_whatever_the_levels_below_ask_for(resolver):
    """A coupling that is met stays met to 1e-9 while the task below pulls its joints apart."""
    of, dt = robot("talos_reduced"), 5e-3
    left, right = PAIRS["talos_reduced"]
    same = JointCouplingTask({left: 1.0, right: -1.0}, gain=10.0)
    apart = JointTask({left: 1.0, right: 0.2}, joints=(left, right), gain=6.0)
    q = of.posture("half_sitting")
    control = Controller(of, Stack([[same], [apart], [JointTask()]]), resolver, dt)
    places = [of.position_index[of.velocity_index(joint).start] for joint in (left, right)]
    for k in range(200):
        q = of.integrate(q, control.step(q, k * dt).v, dt)
        assert q[places[0]] == pytest.approx(q[places[1]], abs=1e-9)
    assert q[places[0]] == pytest.approx(0.6, abs=0.02)


def test_the_model_in_cvxpy_agrees_where_a_limit_binds():
    """A coupling above a hand's task, with slow joints: one answer."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 4))
    couple = JointCouplingTask({"panda_joint2": 1.0, "panda_joint4": 1.0}, gain=1.0)
    hand = PositionTask("panda_hand", target=at.pose("panda_hand")[:3, 3] + 0.2, gain=5.0)
    free = Stack([[couple], [hand]]).at(at, dt=1e-2)
    formula = resolve(free, "pinv").x
    np.testing.assert_allclose(resolve(free, "active-set").x, formula, atol=1e-9)
    slow = JointVelocityLimit(velocity=0.6 * float(np.abs(formula).max()))
    tight = Stack([[couple], [hand]], [slow]).at(at, dt=1e-2)
    ours, told = resolve(tight, "active-set"), resolve(tight, "cvxpy/clarabel")
    assert ours.active
    np.testing.assert_allclose(ours.x, told.x, atol=1e-7)


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: JointCouplingTask({}), InvalidValue, "mapping from joint to coefficient"),
        (lambda: JointCouplingTask({"a": 0.0}), InvalidValue, "ratios must not be 0"),
        (lambda: JointCouplingTask({"a": np.nan}), InvalidValue, "NaN"),
        (lambda: JointCouplingTask({"a": 1.0}).bind(robot("panda"), "t"), UnknownName, "'a'"),
        (
            lambda: JointCouplingTask({"root_joint": 1.0}).bind(robot("talos_reduced"), "t"),
            InvalidValue,
            "one degree of freedom, and 'root_joint' has another",
        ),
        (
            lambda: JointCouplingTask({"wheel_left_joint": 1.0}).bind(robot("tiago"), "t"),
            InvalidValue,
            "turns without end.*LinearHolonomicTask",
        ),
        (lambda: LinearHolonomicTask(np.ones((1, 3))).bind(robot("panda"), "t"), InvalidValue, "7 columns"),
        (lambda: LinearHolonomicTask(np.zeros((1, 7))), InvalidValue, "a number that is not 0"),
        (lambda: LinearHolonomicTask(np.ones((2, 7)), np.ones(3)), InvalidValue, "b must have shape 2"),
    ],
)
def test_what_makes_no_sense_is_refused(make, error, words):
    """Empty, zero or unknown coefficients, joints of another kind, wrong sizes."""
    with pytest.raises(error, match=words):
        make()
