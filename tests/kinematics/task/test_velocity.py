"""Tasks that ask for a velocity: the climb of an objective, and standing still."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective import JointRange, Manipulability
from taskopt.kinematics.task import DampingTask, GradientTask
from tests.helpers.moving import bound
from tests.helpers.robots import FRAMES, generic_q, robot


@pytest.mark.parametrize("name", FRAMES)
def test_a_gradient_task_asks_for_k0_times_the_gradient(name):
    """A = I and b = k0 ∇w (3.55)."""
    of = robot(name)
    at = Configuration(of, generic_q(of, 0))
    climb = 5.0 * JointRange()
    task, rows = bound(GradientTask(climb, gain=3.0), at)
    np.testing.assert_array_equal(rows.A, np.eye(of.nv))
    np.testing.assert_allclose(rows.lower, 3.0 * climb.gradient(at))
    np.testing.assert_array_equal(rows.lower, rows.upper)
    assert task.column == tuple(range(of.nv))


def test_a_small_step_along_a_gradient_task_climbs():
    """w(q + b dt) > w(q): the sign is that of ascent."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    climb = JointRange() + 0.1 * Manipulability("panda_hand")
    _, rows = bound(GradientTask(climb), at)
    higher = Configuration(of, of.integrate(at.q, rows.lower, 1e-3))
    assert climb.value(higher) > climb.value(at)


def test_damping_is_the_identity_and_zero():
    """v = 0, one row a velocity, never filled again; weight 0 takes a row out."""
    of = robot("talos_reduced")
    task, rows = bound(DampingTask(1e-6), Configuration(of, generic_q(of, 0)))
    np.testing.assert_array_equal(rows.A, np.eye(of.nv))
    assert not rows.lower.any()
    assert task.constant
    assert task.row_units[:6] == ("m/s",) * 3 + ("rad/s",) * 3
    legs_only = DampingTask(np.r_[np.zeros(6), np.ones(of.nv - 6)]).bind(of, "legs")
    assert legs_only.column == tuple(range(6, of.nv))


def test_senseless_declarations_are_refused():
    """What is no objective, a gain that is no number, a weight of zero, a frame that is not there."""
    with pytest.raises(InvalidValue, match="objective"):
        GradientTask(lambda q: 0.0)
    with pytest.raises(InvalidValue, match="gain"):
        GradientTask(JointRange(), gain=np.nan)
    with pytest.raises(InvalidValue, match="weight"):
        DampingTask(0.0).bind(robot("planar"), "damping")
    of = robot("panda")
    with pytest.raises(UnknownName, match="panda_hand"):
        bound(GradientTask(Manipulability("panda_hnd")), Configuration(of, of.posture("middle")))
