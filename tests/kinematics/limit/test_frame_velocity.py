"""Bounds on the velocity of a frame: rows are its Jacobian, bounds hold, and those of a base never change."""

import numpy as np
import pinocchio as pin
import pytest

from taskopt import (
    Configuration,
    Controller,
    FloatingBaseVelocityLimit,
    FrameTask,
    FrameVelocityLimit,
    InvalidValue,
    JointTask,
    JointVelocityTask,
    PositionTask,
    Robot,
    Stack,
    UnknownName,
    resolve,
)
from taskopt.testing import check_limit
from tests.helpers.robots import FRAMES, generic_q, robot


def velocity_of(of, q, v, frame, expressed):
    """The velocity (6,) of a frame by Pinocchio's forward kinematics."""
    data, seen = of.model.createData(), {"own": pin.LOCAL, "world": pin.LOCAL_WORLD_ALIGNED}[expressed]
    pin.forwardKinematics(of.model, data, q, v)
    return pin.getFrameVelocity(of.model, data, of.model.getFrameId(frame), seen).vector


@pytest.mark.parametrize("expressed", ["own", "world"])
@pytest.mark.parametrize("name", FRAMES)
def test_limits_of_a_frame_keep_the_contract(name, expressed):
    """v = 0 is always allowed, and rows of the plan are those of the method."""
    limit = FrameVelocityLimit(FRAMES[name], 0.25, angular=(0.5, np.inf, 1.0), expressed=expressed)
    check_limit(limit, robot(name), count=4)


def with_probe():
    """A humanoid with a frame that is turned and displaced on its base."""
    model = robot("talos_reduced").model.copy()
    place = pin.exp6(np.array([0.1, -0.2, 0.3, 0.4, 0.5, -0.6]))
    model.addFrame(pin.Frame("probe", 1, 0, place, pin.FrameType.OP_FRAME))
    return Robot(model)


@pytest.mark.parametrize("frame", [None, "base_link", "probe"])
@pytest.mark.parametrize("expressed", ["own", "world"])
def test_limits_of_a_base_keep_the_contract_and_bound_its_velocity(frame, expressed):
    """Rows are the velocity of the frame, of the base's own or of another one that is fixed to it."""
    of = with_probe()
    limit = FloatingBaseVelocityLimit(0.3, angular=(0.5, np.inf, 0.7), frame=frame, expressed=expressed)
    check_limit(limit, of, count=4)
    plan = Stack([[JointTask()]], [limit]).compile(of, 1e-3)
    rng = np.random.default_rng(0)
    for seed in range(3):
        q, v = generic_q(of, seed), rng.normal(size=of.nv)
        rows = plan.at(q, 0.0).limits
        told = velocity_of(of, q, v, frame or "root_joint", expressed)[[0, 1, 2, 3, 5]]
        np.testing.assert_allclose(rows.A @ v, told, atol=1e-10)
        np.testing.assert_array_equal(rows.upper, [0.3, 0.3, 0.3, 0.5, 0.7])
        np.testing.assert_array_equal(rows.lower, -rows.upper)


def test_rows_of_the_base_in_its_own_axes_are_unit_vectors_that_stay():
    """A solver may skip work for them, and nothing is filled from tick to tick."""
    of = robot("talos_reduced")
    bound = FloatingBaseVelocityLimit(linear=0.5).bind(of, 1e-3)
    assert bound.constant
    assert bound.column == (0, 1, 2)
    assert FloatingBaseVelocityLimit(linear=0.5, expressed="world").bind(of, 1e-3).column == (-1, -1, -1)


@pytest.mark.parametrize("resolver", ["active-set", "hqp/daqp", "cvxpy/clarabel"])
def test_a_base_goes_no_faster_than_it_may(resolver):
    """Asked for 1 m/s along x, the base goes at its bound, and the bound is named."""
    of = robot("talos_reduced")
    at = Configuration(of, generic_q(of, 0))
    go = JointVelocityTask(np.concatenate([[1.0], np.zeros(of.nv - 1)]), joints=("root_joint",))
    answer = resolve(Stack([[go]], [FloatingBaseVelocityLimit(linear=0.3)]).at(at, dt=1e-3), resolver)
    np.testing.assert_allclose(answer.x[:6], [0.3, 0.0, 0.0, 0.0, 0.0, 0.0], atol=1e-7)
    assert "base_velocity/x upper" in [str(active) for active in answer.active]


def test_a_hand_keeps_its_speed_limit_on_the_way():
    """0.25 m/s along each axis of the world, as in collaborative work, whatever the gain asks for."""
    of, dt = robot("panda"), 5e-3
    q = of.posture("default")
    goal = Configuration(of, q).pose("panda_hand")[:3, 3] + [0.1, 0.25, -0.2]
    limit = FrameVelocityLimit("panda_hand", linear=0.25)
    reach = PositionTask("panda_hand", target=goal, gain=20.0)
    control = Controller(of, Stack([[reach], [JointTask()]], [limit]), dt=dt)
    fastest = 0.0
    for k in range(400):
        v = control.step(q, k * dt).v
        speed = np.abs(velocity_of(of, q, v, "panda_hand", "world")[:3]).max()
        fastest = max(fastest, speed)
        assert speed <= 0.25 + 1e-9
        q = of.integrate(q, v, dt)
    assert fastest == pytest.approx(0.25, abs=1e-9)
    np.testing.assert_allclose(Configuration(of, q).pose("panda_hand")[:3, 3], goal, atol=1e-4)


def test_another_period_changes_nothing():
    """No row depends on Δt, so that the plan may take another one."""
    of = robot("panda")
    plan = Stack([[FrameTask("panda_hand")]], [FrameVelocityLimit("panda_hand", 0.1)]).compile(of, 1e-3)
    before = plan.at(of.posture("default"), 0.0).limits.A.copy()
    plan.retime(5e-3)
    np.testing.assert_array_equal(plan.at(of.posture("default"), 0.0).limits.A, before)


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: FrameVelocityLimit("tip"), InvalidValue, "needs a bound"),
        (lambda: FrameVelocityLimit("tip", -1.0), InvalidValue, "must be ≥ 0"),
        (lambda: FrameVelocityLimit("tip", (1.0, 2.0)), InvalidValue, "linear must have shape 3"),
        (lambda: FrameVelocityLimit("tip", 1.0, expressed="base"), InvalidValue, "'own' or 'world'"),
        (lambda: FrameVelocityLimit("hand", 1.0).bind(robot("panda"), 1e-3), UnknownName, "'hand'"),
        (
            lambda: FloatingBaseVelocityLimit(1.0).bind(robot("panda"), 1e-3),
            InvalidValue,
            "no floating base.*FrameVelocityLimit",
        ),
        (
            lambda: FloatingBaseVelocityLimit(1.0, frame="left_sole_link").bind(robot("talos_reduced"), 1e-3),
            InvalidValue,
            "'left_sole_link' .* is not fixed to the base",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(make, error, words):
    """No bound, negative bounds, axes of nothing, robots and frames without a base."""
    with pytest.raises(error, match=words):
        make()
