"""The distance of two frames stays between its bounds in every step, and the limit hinders nothing else."""

import numpy as np
import pytest

from taskopt import (
    Configuration,
    Controller,
    FrameDistanceLimit,
    FrameTask,
    InvalidValue,
    JointTask,
    PositionTask,
    Stack,
    UnknownName,
    resolve,
)
from taskopt.testing import check_limit
from tests.helpers.attack import allowed, attacked
from tests.helpers.robots import generic_q, robot

PAIRS = {
    "planar": ("tip", "link1"),
    "panda": ("panda_hand", "panda_link0"),
    "tiago": ("arm_tool_link", "head_2_link"),
    "talos_reduced": ("gripper_left_base_link", "gripper_right_base_link"),
}


def distance(at, name):
    """‖p_a − p_b‖ of the two frames of a robot."""
    first, second = PAIRS[name]
    return float(np.linalg.norm(at.pose(first)[:3, 3] - at.pose(second)[:3, 3]))


def around_middle(name, lower, upper):
    """A limit from `lower` to `upper` times the distance at the middle posture."""
    d = distance(Configuration(robot(name), robot(name).posture("middle")), name)
    return FrameDistanceLimit(*PAIRS[name], lower * d, upper * d, influence=min(0.1, 0.5 * d))


@pytest.mark.parametrize("dt", [1e-3, 2e-2])
@pytest.mark.parametrize("bounds", [(0.8, 1.1), (0.9, 1.01), (0.5, np.inf), (0.0, 1.02)])
@pytest.mark.parametrize("name", PAIRS)
def test_the_limit_keeps_the_contract(name, bounds, dt):
    """v = 0 is always allowed, and the largest allowed steps towards corners stay between the bounds."""
    limit = around_middle(name, *bounds)

    def outside(at):
        d = distance(at, name)
        return max(limit.lower - d, d - limit.upper)

    check_limit(limit, robot(name), dt=dt, outside=outside, count=6)


def attacks(name, dt, side, honest=True):
    """What is left of a bound in runs of extreme steps from six starts a millimetre from it."""
    of, rng, left = robot(name), np.random.default_rng(3), []
    for seed in range(6):
        at = Configuration(of, generic_q(of, seed, 0.5))
        d = distance(at, name)
        bounds = {"lower": d - 1e-3} if side == "lower" else {"upper": d + 1e-3}
        limit = FrameDistanceLimit(*PAIRS[name], influence=0.1, **bounds)
        left.append(attacked(at, limit.bind(of, dt), dt, rng, honest=honest))
    return np.concatenate(left)


@pytest.mark.slow
@pytest.mark.parametrize("side", ["lower", "upper"])
@pytest.mark.parametrize("dt", [2e-3, 2e-2])
@pytest.mark.parametrize("name", ["panda", "talos_reduced"])
def test_no_run_of_extreme_steps_passes_a_bound(name, dt, side):
    """Each bound holds to 1e-9 m after every step to the corner of what is allowed."""
    assert attacks(name, dt, side).min() >= -1e-9


@pytest.mark.slow
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_rows_without_the_bounds_on_speed_are_caught(side):
    """The check above sees that linearised rows alone pass a bound in long steps."""
    assert attacks("panda", 5e-2, side, honest=False).min() < -1e-3


def test_gradients_are_those_of_the_distance():
    """∇g by central differences, for both bounds, on a floating base."""
    of, limit = robot("talos_reduced"), around_middle("talos_reduced", 0.5, 1.5)
    bound, q, h = limit.bind(of, 1e-3), generic_q(of, 2), 1e-6
    at = Configuration(of, q)
    allowed(bound, at)
    gradient = bound._gradient.copy()
    for v in np.random.default_rng(0).normal(size=(5, of.nv)):
        ends = [distance(Configuration(of, of.integrate(q, v, s)), "talos_reduced") for s in (-h, h)]
        rate = (ends[1] - ends[0]) / (2.0 * h)
        np.testing.assert_allclose(gradient @ v, [rate, -rate], atol=1e-7)


def test_far_from_its_bounds_it_asks_for_nothing():
    """Beyond the influence both rows are open, and no speed that the robot has is bounded at 1 ms."""
    of, limit = robot("panda"), around_middle("panda", 0.5, 1.5)
    rows, bounds = allowed(limit.bind(of, 1e-3), Configuration(of, of.posture("middle")))
    assert np.isneginf(rows.lower).all()
    assert (bounds[1] > of.velocity_limit).all()


@pytest.mark.slow
def test_hands_come_no_nearer_and_the_body_moves_freely():
    """Two hands that are sent to one place stop at 0.3 m; joints that carry both are never bounded."""
    of, dt = robot("talos_reduced"), 5e-3
    left, right = PAIRS["talos_reduced"]
    limit = FrameDistanceLimit(left, right, lower=0.3)
    q = of.posture("half_sitting")
    middle = 0.5 * sum(Configuration(of, q).pose(frame)[:3, 3] for frame in (left, right))
    reach = [PositionTask(frame, target=middle, gain=3.0) for frame in (left, right)]
    control = Controller(of, Stack([[FrameTask("base_link")], reach, [JointTask()]], [limit]), dt=dt)
    for k in range(300):
        resolution = control.step(q, k * dt)
        q = of.integrate(q, resolution.v, dt)
        assert distance(Configuration(of, q), "talos_reduced") >= 0.3 - 1e-9
    assert distance(Configuration(of, q), "talos_reduced") < 0.34
    assert any("frame_distance" in str(active) for active in resolution.active)
    shared = np.intersect1d(of.support(left), of.support(right))
    assert np.isinf(control.plan.limits[0].share[shared]).all()


@pytest.mark.parametrize("resolver", ["hqp/daqp", "cvxpy/clarabel"])
def test_other_resolvers_agree(resolver):
    """A row that binds leads to one answer."""
    of = robot("panda")
    at = Configuration(of, of.posture("default"))
    limit = FrameDistanceLimit("panda_hand", "panda_link0", upper=distance(at, "panda") + 0.01)
    away = PositionTask("panda_hand", target=at.pose("panda_hand")[:3, 3] * 1.5, gain=5.0)
    hierarchy = Stack([[away], [JointTask()]], [limit]).at(at, dt=1e-3)
    ours = resolve(hierarchy, "active-set")
    assert "frame_distance/farthest lower" in [str(active) for active in ours.active]
    np.testing.assert_allclose(resolve(hierarchy, resolver).x, ours.x, atol=1e-7)


def test_frames_that_start_outside_may_return_only():
    """At v = 0, or towards the bounds: no step leads farther outside."""
    of, rng = robot("panda"), np.random.default_rng(1)
    at = Configuration(of, of.posture("default"))
    d = distance(at, "panda")
    for limit in (
        FrameDistanceLimit("panda_hand", "panda_link0", lower=d + 0.05),
        FrameDistanceLimit("panda_hand", "panda_link0", upper=d - 0.05),
    ):
        left = attacked(at, limit.bind(of, 5e-3), 5e-3, rng)[:, 0]
        assert left.min() >= -0.05 - 0.1 * 0.05


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: FrameDistanceLimit("a", "b"), InvalidValue, "a bound that is not 0 or inf"),
        (lambda: FrameDistanceLimit("a", "b", 0.5, 0.4), InvalidValue, "0 ≤ lower ≤ upper"),
        (lambda: FrameDistanceLimit("a", "b", -0.1), InvalidValue, "0 ≤ lower ≤ upper"),
        (lambda: FrameDistanceLimit("a", "b", np.nan), InvalidValue, "NaN"),
        (lambda: FrameDistanceLimit("a", "b", 0.1, gain=1.5), InvalidValue, r"in \(0, 1\]"),
        (lambda: FrameDistanceLimit("a", "b", upper=0.05), InvalidValue, "influence must be less than"),
        (
            lambda: FrameDistanceLimit("panda_hand", "panda_link8", 0.1).bind(robot("panda"), 1e-3),
            InvalidValue,
            "move as one body",
        ),
        (lambda: FrameDistanceLimit("tip", "b", 0.1).bind(robot("planar"), 1e-3), UnknownName, "'b'"),
    ],
)
def test_what_cannot_be_kept_is_refused(make, error, words):
    """Bounds of nothing, crossed or negative ones, one body, a frame that is not there."""
    with pytest.raises(error, match=words):
        make()
