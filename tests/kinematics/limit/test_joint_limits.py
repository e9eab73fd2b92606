"""Joint limits: zero is always allowed, extremes stay inside, and every bound has its owner."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import JointPositionLimit, JointVelocityLimit
from tests.helpers.robots import FRAMES, generic_q, robot

INSIDE = 1e-9  # what the promise says, in floating point


def box_at(of, q, limits, dt):
    """The box of some limits at q, as a plan builds it."""
    bounds = np.repeat([[-np.inf], [np.inf], [0.0], [0.0]], of.nv, axis=1)
    for index, limit in enumerate(limits, start=1):
        limit.bind(of, dt).narrow(Configuration(of, q), bounds, index)
    return bounds[:2], bounds[2:]


def places(of):
    """Columns with a position limit, and where they stand in q."""
    columns = np.flatnonzero(of.position_index >= 0)
    return columns, of.position_index[columns]


def within(of, seed, edge):
    """A posture inside all limits, some joints exactly on one or `edge` away from it."""
    rng = np.random.default_rng(seed)
    q = generic_q(of, seed)
    columns, at = places(of)
    lower = np.maximum(of.position_lower[columns], -5.0)
    upper = np.minimum(of.position_upper[columns], 5.0)
    inside = np.minimum(edge, 0.5 * (upper - lower))
    spots = np.stack([lower, upper, lower + inside, upper - inside, rng.uniform(lower, upper)])
    q[at] = spots[rng.integers(0, 5, len(at)), np.arange(len(at))]
    return q


@pytest.mark.slow
@pytest.mark.parametrize("name", FRAMES)
@given(
    seed=st.integers(0, 2**32 - 1),
    dt=st.sampled_from([1e-4, 1e-3, 7e-3, 0.1]),
    gain=st.sampled_from([0.1, 0.5, 1.0]),
    edge=st.sampled_from([1e-15, 1e-9, 1e-3]),
)
def test_one_step_at_the_extreme_velocity_stays_inside(name, seed, dt, gain, edge):
    """q ⊕ v dt keeps every position limit to 1e-9 for v at either side of the box, and v = 0 is in it."""
    of = robot(name)
    q = within(of, seed, edge)
    box, _ = box_at(of, q, [JointPositionLimit(gain), JointVelocityLimit()], dt)
    assert (box[0] <= 0.0).all()
    assert (box[1] >= 0.0).all()
    pick = np.random.default_rng(seed).integers(0, 2, of.nv)
    v = np.nan_to_num(box[pick, np.arange(of.nv)], posinf=1.0, neginf=-1.0)
    assert of.outside(of.integrate(q, v, dt), tolerance=INSIDE) == ()
    assert (np.abs(v) <= np.where(np.isfinite(of.velocity_limit), of.velocity_limit, np.inf) + INSIDE).all()


def test_a_damper_at_twice_its_rate_is_caught():
    """The check above sees that 2 (q_max − q)/dt leaves the range."""
    of = robot("panda")
    q = within(of, 1, 1e-3)
    box, _ = box_at(of, q, [JointPositionLimit(1.0)], 1e-3)
    assert of.outside(of.integrate(q, 2.0 * box[1], 1e-3), tolerance=INSIDE) != ()


@pytest.mark.parametrize("name", FRAMES)
def test_a_joint_outside_its_range_may_stop_or_return_but_not_go_on(name):
    """Above q_max the upper bound is 0 and the lower one leads back; below q_min the mirror image."""
    of = robot(name)
    columns, at = places(of)
    j, iq = next((j, i) for j, i in zip(columns, at, strict=True) if np.isfinite(of.position_upper[j]))
    for bound, side in ((of.position_upper[j] + 0.1, 1), (of.position_lower[j] - 0.1, 0)):
        q = of.posture("middle")
        q[iq] = bound
        box, _ = box_at(of, q, [JointPositionLimit()], 1e-2)
        assert box[side, j] == 0.0
        assert abs(box[1 - side, j]) >= 0.1 / 1e-2


def test_what_has_no_limit_gets_none():
    """TIAGo's wheels and TALOS's base are free, whatever numbers stand in the files."""
    for name, free in (("tiago", "wheel_left_joint"), ("talos_reduced", "root_joint")):
        of = robot(name)
        box, owner = box_at(of, generic_q(of, 0), [JointPositionLimit()], 1e-3)
        columns = of.velocity_index(free)
        assert np.isinf(box[:, columns]).all()
        assert not owner[:, columns].any()


def test_the_limit_that_binds_owns_the_bound():
    """Near its upper limit a joint is held by position above and by velocity below."""
    of = robot("panda")
    q = of.posture("middle")
    q[3] = of.position_upper[3] - 1e-4
    box, owner = box_at(of, q, [JointPositionLimit(0.5), JointVelocityLimit()], 1e-3)
    assert (owner[0, 3], owner[1, 3]) == (2, 1)
    assert box[1, 3] == pytest.approx(0.5 * 1e-4 / 1e-3)
    assert box[0, 3] == -of.velocity_limit[3]
    assert (owner[:, [0, 1, 2, 4, 5, 6]] == 2).all()


@pytest.mark.parametrize(
    ("limit", "want"),
    [
        (JointVelocityLimit(0.5), lambda v: 0.5 * v),
        (JointVelocityLimit(velocity=1.5), lambda v: np.full(7, 1.5)),
        (JointVelocityLimit(2.0, velocity=np.arange(7.0)), lambda v: 2.0 * np.arange(7)),
        (
            JointVelocityLimit(velocity={"panda_joint2": np.inf}),
            lambda v: np.where(np.arange(7) == 1, np.inf, v),
        ),
    ],
)
def test_velocity_limits_are_the_robots_or_those_given(limit, want):
    """−s v_max ≤ v ≤ s v_max."""
    of = robot("panda")
    box, _ = box_at(of, generic_q(of, 0), [limit], 1e-3)
    np.testing.assert_array_equal(box[1], want(of.velocity_limit))
    np.testing.assert_array_equal(box[0], -box[1])


@pytest.mark.parametrize("gain", [0.0, -1.0, 1.5, np.nan])
def test_a_gain_outside_its_range_is_refused(gain):
    """Above 1 a joint would overshoot its limit."""
    with pytest.raises(InvalidValue, match="gain"):
        JointPositionLimit(gain)


@pytest.mark.parametrize(
    ("velocity", "error"),
    [
        (-1.0, InvalidValue),
        (np.nan, InvalidValue),
        (np.ones(3), InvalidValue),
        ({"panda_joint22": 1.0}, UnknownName),
    ],
)
def test_velocities_that_do_not_fit_the_robot_are_refused(velocity, error):
    """Negative, NaN, wrong size, unknown joint."""
    with pytest.raises(error):
        JointVelocityLimit(velocity=velocity).bind(robot("panda"), 1e-3)


def test_at_a_tie_the_bound_keeps_its_owner():
    """Where the damper comes to the velocity limit exactly, it does not take the bound over."""
    of = robot("planar")  # upper limit 3 rad, 2 rad/s
    _, owner = box_at(of, np.full(3, 2.0), [JointVelocityLimit(), JointPositionLimit(0.5)], dt=0.25)
    assert (owner[1] == 1).all()
