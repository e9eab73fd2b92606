"""The acceleration limit: never empty, never outside, not stricter than it must be, back without a spike."""

import numpy as np
import pytest

from taskopt import Controller, JointTask, Robot, Stack
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import (
    BoundLimit,
    JointAccelerationLimit,
    JointPositionLimit,
    JointVelocityLimit,
    Limit,
)
from taskopt.kinematics.limit.acceleration import narrow_by_acceleration
from taskopt.kinematics.limit.base import close_crossed
from taskopt.kinematics.part import RobotState
from taskopt.kinematics.robot import planar_arm
from tests.helpers.robots import robot

MANY = 10_000


def bounds_of(q, v, dt, a, fastest, q_lower, q_upper):
    """(2, N): the kernel's bounds for N joints with one number each."""
    q, v, a, fastest, q_lower, q_upper = np.broadcast_arrays(
        *np.atleast_1d(q, v, a, fastest, q_lower, q_upper)
    )
    of_joint = np.column_stack([v, a * dt, fastest, q_lower, q_upper])
    bounds = np.repeat([[-np.inf], [np.inf], [0.0], [0.0]], q.size, axis=1)
    program = np.repeat(np.arange(q.size), 2)
    state = RobotState(q.astype(float), np.zeros((6, 1), order="F"), np.zeros((1, 12)))
    narrow_by_acceleration(program, np.concatenate([[dt], of_joint.ravel()]), state, bounds, 1)
    return bounds[:2]


def random_joints(seed):
    """N joints: start, range, acceleration and speed over decades."""
    rng = np.random.default_rng(seed)
    q_lower, q_upper = -rng.uniform(0.01, 3.0, MANY), rng.uniform(0.01, 3.0, MANY)
    a, fastest = 10.0 ** rng.uniform(-1, 3, MANY), 10.0 ** rng.uniform(-1, 1, MANY)
    return rng, rng.uniform(q_lower, q_upper), a, fastest, q_lower, q_upper


def chosen(rng, bounds, habit):
    """Velocities within the bounds: always up, always down, anywhere, from one extreme to the other."""
    u = np.select(
        [habit == 0, habit == 1, habit == 2], [1.0, 0.0, rng.random(MANY)], rng.integers(0, 2, MANY)
    )
    return np.clip(bounds[0] + u * (bounds[1] - bounds[0]), bounds[0], bounds[1])


@pytest.mark.parametrize("dt", [1e-4, 1e-3, 1e-2, 0.1])
def test_ten_thousand_random_sequences_stay_inside_and_always_have_a_choice(dt):
    """From rest, whatever is chosen within bounds, 200 steps: never empty, outside, too fast, too hard."""
    rng, q, a, fastest, q_lower, q_upper = random_joints(int(1e4 * dt))
    habit, v = rng.integers(0, 4, MANY), np.zeros(MANY)
    for _ in range(200):
        bounds = bounds_of(q, v, dt, a, fastest, q_lower, q_upper)
        assert (bounds[0] <= bounds[1]).all()
        after = chosen(rng, bounds, habit)
        assert (np.abs(after - v) <= a * dt + 1e-9).all()
        assert (np.abs(after) <= fastest + 1e-9).all()
        v, q = after, q + after * dt
        assert (q <= q_upper + 1e-9).all()
        assert (q >= q_lower - 1e-9).all()


def test_the_bound_of_continuous_time_is_caught():
    """v⁺ ≤ √(2 a (q_max − q)) leaves the range, or asks for harder brakes than there are."""
    q, v, dt, a = 0.0, 0.0, 0.1, 1.0
    outside = False
    for _ in range(100):
        after = min(v + a * dt, np.sqrt(2.0 * a * max(1.0 - q, 0.0)))
        outside |= after < v - a * dt - 1e-9
        q, v = q + after * dt, after
    assert outside or q > 1.0 + 1e-9


def test_a_hair_more_than_the_bound_cannot_be_stopped_in_time():
    """The bound is exact: at v⁺ + 1e-6 the hardest brakes end beyond q_max, at v⁺ they end on it."""
    rng, q, a, _, q_lower, q_upper = random_joints(3)
    dt = 1e-2
    v = np.maximum(bounds_of(q, 0.0, dt, 1e9, 1e9, q_lower, q_upper)[1], 0.0)  # so fast that position binds
    v = np.minimum(v, a * dt * rng.uniform(0.0, 40.0, MANY))
    upper = bounds_of(q, v, dt, a, np.inf, q_lower, q_upper)[1]
    binding = (upper < v + a * dt) & (upper > v - a * dt)
    assert binding.sum() > 100
    for excess, ends_beyond in ((0.0, False), (1e-6, True)):
        speed = upper[binding] + excess
        end = q[binding] + speed * dt
        while (speed > 0.0).any():
            speed = np.maximum(speed - a[binding] * dt, 0.0)
            end = end + speed * dt
        assert ((end > q_upper[binding] + 1e-9) == ends_beyond).all()
        assert (np.abs(end - q_upper[binding]) < 1e-9 + excess * 100).all()


@pytest.mark.parametrize("wanted", [-5.0, 0.0, 5.0])
def test_recovery_from_outside_has_no_spike(wanted):
    """Started 0.2 outside and moving outward, a joint brakes as hard as it may, then stays or returns."""
    dt, a, q, v = 1e-2, 3.0, 1.2, 0.5
    path = [q]
    for _ in range(400):
        lower, upper = bounds_of(q, v, dt, a, 2.0, -1.0, 1.0)[:, 0]
        assert lower <= upper
        after = float(np.clip(wanted, lower, upper))
        assert abs(after - v) <= a * dt + 1e-12
        q, v = q + after * dt, after
        path.append(q)
    assert max(path) <= 1.2 + 0.5**2 / (2.0 * a) + 1e-9
    assert path[-1] == pytest.approx(-1.0 if wanted < 0.0 else max(path), abs=1e-9)


def test_too_fast_a_joint_slows_down_as_hard_as_it_may():
    """|v| > v_max is left at a Δt a tick, without a step to v_max at once."""
    lower, upper = bounds_of(0.0, 3.0, 1e-2, 10.0, 1.0, -9.0, 9.0)[:, 0]
    assert (lower, upper) == (pytest.approx(2.9), pytest.approx(2.9))


@pytest.mark.parametrize("name", ["planar", "panda", "tiago", "talos_reduced"])
def test_a_controller_keeps_position_velocity_and_acceleration(name):
    """Sent to and fro against both ends of its range at full speed, no joint breaks any of the three."""
    of = robot(name)
    limit = JointAccelerationLimit(20.0)
    rng, dt = np.random.default_rng(1), 5e-3
    goal = {
        joint: 0.0
        for joint in of.joints
        if of.velocity_index(joint).stop - of.velocity_index(joint).start == 1
    }
    q, v = of.posture("middle"), np.zeros(of.nv)
    fastest = np.where(np.isfinite(of.velocity_limit), of.velocity_limit, 1e9)
    for leg in range(4):
        far = dict.fromkeys(goal, 0.0) | {joint: float(rng.choice([-9.0, 9.0])) for joint in goal}
        control = Controller(of, Stack([[JointTask(far, gain=50.0)]], [limit]), dt=dt)
        control.start(q)
        for k in range(60):
            resolution = control.step(q, k * dt, v if k == 0 else None)
            assert resolution.kkt_met()
            assert (np.abs(resolution.v - v) <= 20.0 * dt + 1e-9).all(), leg
            assert (np.abs(resolution.v) <= fastest + 1e-9).all()
            v = resolution.v.copy()
            q = of.integrate(q, v, dt)
            assert of.outside(q, tolerance=1e-9) == ()


def test_a_bound_says_whether_acceleration_position_or_speed_sets_it():
    """From rest it is the acceleration, at full speed the speed, before the end of the range the position."""
    of = planar_arm(lower=-1.0, upper=1.0, velocity=2.0)
    bound = JointAccelerationLimit(10.0).bind(of, 1e-2)
    for q, v, owner in ((0.0, 0.0, 1), (0.0, 2.0, 3), (0.95, 0.9, 2)):
        bounds = np.repeat([[-np.inf], [np.inf], [0.0], [0.0]], of.nv, axis=1)
        bound.moved(np.full(of.nv, v))
        bound.narrow(Configuration(of, np.full(of.nv, q)), bounds, 1)
        assert (bounds[3] == owner).all()
    assert bound.owners == (
        "joint_acceleration",
        "joint_acceleration (position)",
        "joint_acceleration (velocity)",
    )


@pytest.mark.parametrize(
    ("given", "want"),
    [
        (None, [7.5, np.inf, 2.0]),
        ({"joint2": 3.0}, [7.5, 3.0, 2.0]),
        (5.0, [5.0, 5.0, 5.0]),
        ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
    ],
)
def test_accelerations_are_the_robots_or_those_given(given, want):
    """From rest, the first bounds are ± a Δt, with the robot's own a where none is given."""
    of = planar_arm().with_limits(acceleration={"joint1": 7.5, "joint3": 2.0})
    bounds = np.repeat([[-np.inf], [np.inf], [0.0], [0.0]], of.nv, axis=1)
    JointAccelerationLimit(given).bind(of, 1e-2).narrow(Configuration(of, np.zeros(of.nv)), bounds, 1)
    np.testing.assert_allclose(bounds[:2], np.outer([-1e-2, 1e-2], want))


def test_a_robot_without_acceleration_limits_needs_an_acceleration():
    """The error says why there is none, and both ways to give one."""
    with pytest.raises(InvalidValue, match=r"no acceleration limits, since.*acceleration=….*with_limits"):
        JointAccelerationLimit().bind(planar_arm(), 1e-2)


@pytest.mark.parametrize(
    ("acceleration", "error"),
    [
        (0.0, InvalidValue),
        (-1.0, InvalidValue),
        (np.nan, InvalidValue),
        ({"panda_joint22": 1.0}, UnknownName),
    ],
)
def test_accelerations_that_make_no_sense_are_refused(acceleration, error):
    """Not positive, NaN, unknown joint."""
    with pytest.raises(error):
        JointAccelerationLimit(acceleration).bind(Robot.load("panda"), 1e-3)


class PositionLimitInPython(Limit):
    """q_min ≤ q + v Δt ≤ q_max, as an own limit states it."""

    name = "own"

    def bind(self, robot, dt):
        return BoundPositionInPython(robot, dt)


class BoundPositionInPython(BoundLimit):
    """Its bounds, without a kernel."""

    def __init__(self, robot, dt):
        super().__init__("own")
        self._robot, self._dt = robot, dt

    def narrow(self, configuration, bounds, owner):
        room = self._robot.position_lower - configuration.q, self._robot.position_upper - configuration.q
        lower, upper = room[0] / self._dt, room[1] / self._dt
        bounds[2][lower > bounds[0]], bounds[3][upper < bounds[1]] = owner, owner
        bounds[0], bounds[1] = np.maximum(bounds[0], lower), np.minimum(bounds[1], upper)


@pytest.mark.parametrize("position", [JointPositionLimit, PositionLimitInPython])
@pytest.mark.parametrize(("end", "seed"), [(5.0, 0), (-5.0, 1), (5.0, 2), (-5.0, 3), (5.0, 4), (-5.0, 5)])
def test_limits_that_leave_one_velocity_do_not_contradict_each_other_by_rounding(position, end, seed):
    """A joint that brakes as hard as it may ends on its range: both limits ask for the same velocity."""
    rng, dt = np.random.default_rng(seed), 1e-2
    arm = planar_arm(lower=-rng.uniform(0.3, 1.0), upper=rng.uniform(0.3, 1.0), velocity=2.0)
    a = rng.uniform(0.5, 3.0)
    limits = [position(), JointVelocityLimit(), JointAccelerationLimit(a)]
    stack = Stack([[JointTask(np.full(arm.nv, end), gain=50.0)]], limits=limits)
    control, q, v = Controller(arm, stack, dt=dt), np.zeros(arm.nv), np.zeros(arm.nv)
    for k in range(200):
        found = control.step(q, k * dt)
        assert found.claimed
        assert (np.abs(found.v - v) <= a * dt + 1e-9).all()
        q, v = arm.integrate(q, found.v, dt), found.v
        assert (arm.position_lower - 1e-9 <= q).all()
        assert (q <= arm.position_upper + 1e-9).all()
    assert np.abs(q).max() == pytest.approx(arm.position_upper[0] if end > 0.0 else -arm.position_lower[0])


@pytest.mark.parametrize(("lower", "upper"), [(1.0, 1.0 - 1e-13), (-1e-12, -2e-12), (300.0, 300.0 - 1e-8)])
def test_bounds_that_cross_by_rounding_meet_in_the_middle(lower, upper):
    """Both bounds become the same number between the two, so that an equality is left."""
    bounds = np.array([[lower], [upper], [1.0], [2.0]])
    close_crossed(bounds)
    assert bounds[0, 0] == bounds[1, 0]
    assert upper <= bounds[0, 0] <= lower
    assert bounds[2:].ravel().tolist() == [1.0, 2.0]


@pytest.mark.parametrize(("lower", "upper"), [(1e-8, 0.0), (0.0, 1e-13), (2.0, 1.0), (-np.inf, np.inf)])
def test_bounds_that_contradict_each_other_stay(lower, upper):
    """More than rounding is a contradiction, which is reported; bounds that do not cross are kept."""
    bounds = np.array([[lower], [upper], [1.0], [2.0]])
    close_crossed(bounds)
    assert bounds[:2].ravel().tolist() == [lower, upper]
