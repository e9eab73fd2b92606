"""Motions of second order: plain loops of (3.102) and (3.104), (3.103) in discrete time, limits, rest."""

from copy import deepcopy

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt import (
    Controller,
    FrameTask,
    Function,
    Hold,
    InvalidValue,
    JointAccelerationLimit,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    PositionTask,
    Scenario,
    Stack,
    planar_arm,
    run,
)
from taskopt.kinematics.configuration import Configuration
from taskopt.loop.one_call import one_call
from taskopt.resolver.active_set.resolver import ActiveSet
from tests.helpers.robots import robot

H = 1e-3
START = np.array([np.pi, -np.pi / 2, -np.pi / 2])  # of Sect. 3.7.5
CLOSE = 1e-8


def circle(t):
    return np.array([0.25 * (1.0 - np.cos(np.pi * t)), 0.25 * (2.0 + np.sin(np.pi * t))])


def circle_rate(t):
    return 0.25 * np.pi * np.array([np.sin(np.pi * t), np.cos(np.pi * t)])


def circle_change(t):
    return 0.25 * np.pi**2 * np.array([np.cos(np.pi * t), -np.sin(np.pi * t)])


def planar(q, dq):
    """Position, Jacobian and J̇ q̇ of the planar arm with three links of 0.5 m, written out."""
    angle, rate = np.cumsum(q), np.cumsum(dq)
    c, s = 0.5 * np.cos(angle), 0.5 * np.sin(angle)
    J = np.array([[-s[i:].sum() for i in range(3)], [c[i:].sum() for i in range(3)]])
    return np.array([c.sum(), s.sum()]), J, np.array([-(c * rate**2).sum(), -(s * rate**2).sum()])


def tip_task(gain):
    """The position of the tip on the circle of Sect. 3.7.5, which moves without end."""
    target = Function(
        lambda t: np.r_[circle(t), 0.0],
        lambda t: np.r_[circle_rate(t), np.zeros(4)],
        lambda t: np.r_[circle_change(t), np.zeros(4)],
    )
    return PositionTask("tip", target=target, gain=gain, axes="xy")


def plain_loop(ticks, gain, secondary, weight):
    """(3.104) with q̈₀ = `secondary(q, q̇)` and a weighted pseudo-inverse, by the formula alone."""
    q, dq = START.copy(), np.zeros(3)
    inverse = np.diag(1.0 / weight)
    for k in range(ticks):
        p, J, bias = planar(q, dq)
        e, de = circle(k * H) - p, circle_rate(k * H) - J @ dq
        task = circle_change(k * H) + 2.0 * gain * de + gain**2 * e - bias
        pseudo = inverse @ J.T @ np.linalg.inv(J @ inverse @ J.T)
        ddq = pseudo @ task + (np.eye(3) - pseudo @ J) @ secondary(q, dq)
        q, dq = q + dq * H + 0.5 * ddq * H * H, dq + ddq * H
    return q, dq


def motion(stack, ticks, resolver="active-set", start=START, of=None):
    """Posture and velocity after some ticks of a controller that is integrated by `after`."""
    control = Controller(planar_arm(lengths=(0.5, 0.5, 0.5)) if of is None else of, stack, resolver, dt=H)
    q, v = start, np.zeros(len(start))
    for k in range(ticks):
        control.step(q, k * H)
        q, v = control.after()
    return q, v


@pytest.mark.equation("3.104")
@pytest.mark.figure("3.14")
@pytest.mark.parametrize("weight", [np.ones(3), np.array([1.0, 4.0, 0.5])])
@pytest.mark.parametrize("resolver", ["active-set", "pinv", "hqp/daqp"])
def test_motion_is_that_of_a_plain_loop_of_3_104(resolver, weight):
    """The arm of Sect. 3.7.5 moves as the formula says, with q̈₀ = −K_v q̇ in any diagonal norm."""
    stack = Stack([[tip_task(20.0)]], norm=weight, order=2, self_motion=3.0)
    ticks = 500 if resolver == "active-set" else 150
    expected = plain_loop(ticks, 20.0, lambda q, dq: -3.0 * dq, weight)
    mine = motion(stack, ticks, resolver)
    for one, theirs in zip(mine, expected, strict=True):
        assert np.abs(one - theirs).max() < CLOSE
    others = plain_loop(ticks, 20.0, lambda q, dq: -2.0 * dq, weight)
    assert np.abs(mine[0] - others[0]).max() > 1e-5


def test_secondary_objective_moves_in_the_null_space_as_in_3_104():
    """A posture on the second level is q̈₀ = K_D ė + K_P e of the posture."""
    posture = np.array([2.0, -1.0, -1.0])
    stack = Stack([[tip_task(20.0)], [JointTask(posture, gain=4.0)]], order=2)
    q, v = motion(stack, 500)
    expected = plain_loop(500, 20.0, lambda q, dq: -8.0 * dq + 16.0 * (posture - q), np.ones(3))
    assert np.abs(q - expected[0]).max() < CLOSE
    assert np.abs(v - expected[1]).max() < CLOSE


def test_full_norm_weighs_self_motion():
    """With a full norm W the pseudo-inverse is that of W."""
    root = np.array([[2.0, 0.3, 0.1], [0.0, 1.0, 0.4], [0.0, 0.0, 0.7]])
    W = root.T @ root
    arm, dq = planar_arm(lengths=(0.5, 0.5, 0.5)), np.array([0.3, -0.5, 0.7])
    control = Controller(arm, Stack([[tip_task(5.0)]], norm=W, order=2, self_motion=3.0), dt=H)
    a = control.step(START, 0.0, v=dq).a
    p, J, bias = planar(START, dq)
    task = circle_change(0.0) + 10.0 * (circle_rate(0.0) - J @ dq) + 25.0 * (circle(0.0) - p) - bias
    inverse = np.linalg.inv(W)
    pseudo = inverse @ J.T @ np.linalg.inv(J @ inverse @ J.T)
    assert np.abs(a - pseudo @ task - (np.eye(3) - pseudo @ J) @ (-3.0 * dq)).max() < 1e-10


@pytest.mark.equation("3.103")
def test_error_follows_the_discrete_form_of_3_103():
    """Errors of joints follow the discrete form of (3.103) to 1e-9."""
    arm, gain = robot("panda"), 8.0
    q, goal = arm.posture("middle"), arm.posture("middle") + np.linspace(-0.4, 0.4, arm.nv)
    for rate_gain in (None, 30.0):
        damping = 2.0 * gain if rate_gain is None else rate_gain
        task = JointTask(Hold(goal), gain=gain, rate_gain=rate_gain)
        control = Controller(arm, Stack([[task]], order=2), dt=H)
        at, e, de = q, goal - q, np.zeros(arm.nv)
        for k in range(1000):
            control.step(at, k * H)
            at, v = control.after()
            dde = -damping * de - gain**2 * e
            e, de = e + de * H + 0.5 * dde * H * H, de + dde * H
        assert np.abs(goal - at - e).max() < 1e-9
        assert np.abs(v + de).max() < 1e-9
        assert 1e-6 < np.abs(e).max() < 0.2


def test_error_of_a_pose_follows_3_103_to_first_order_of_the_step():
    """Half the step halves the distance from the solution of (3.103)."""
    arm, gain = robot("panda"), 4.0
    q = arm.posture("middle")
    goal = Configuration(arm, q + 0.2).pose("panda_hand")
    apart = []
    for h in (4e-3, 2e-3, 1e-3):
        control = Controller(arm, Stack([[FrameTask("panda_hand", target=goal, gain=gain)]], order=2), dt=h)
        at, first, worst = q, None, 0.0
        for k in range(round(1.0 / h)):
            control.step(at, k * h)
            e = control.plan.tasks[0].error.copy()
            first = e if first is None else first
            t = k * h
            worst = max(worst, np.abs(e - (1.0 + gain * t) * np.exp(-gain * t) * first).max())
            at, _ = control.after()
        apart.append(worst)
    assert apart[-1] < 2e-3
    assert 1.8 < apart[0] / apart[1] < 2.2
    assert 1.8 < apart[1] / apart[2] < 2.2


SOLVERS = ["active-set", "hqp/daqp", "hqp/clarabel", "hqp/proxqp", "hqp/quadprog", "cvxpy/clarabel"]


@pytest.mark.equation("3.104")
@pytest.mark.parametrize("resolver", SOLVERS)
def test_every_resolver_has_the_answer_of_the_closed_form(resolver):
    """Where nothing binds and σ_min ≥ 1e-3, answers are those of pseudo-inverses to 1e-9 of their size."""
    arm, rng = robot("panda"), np.random.default_rng(1)
    levels = [[FrameTask("panda_hand", gain=2.0)], [JointTask(arm.posture("middle"), gain=2.0)]]
    control = Controller(arm, Stack(levels, [JointVelocityLimit()], order=2), resolver, dt=H)
    for _ in range(5):
        q, v = arm.posture("middle") + rng.uniform(-0.6, 0.6, arm.nv), rng.uniform(-0.2, 0.2, arm.nv)
        control.start(q + 0.02)
        a = control.step(q, 0.0, v=v).a
        J, asked = control.plan.hierarchy.A[:6], control.plan.hierarchy.lower[:6]
        assert np.linalg.svd(J, compute_uv=False)[-1] > 1e-3
        assert (np.abs(v + H * a) < arm.velocity_limit).all()
        secondary = 4.0 * (arm.posture("middle") - q) - 4.0 * v
        expected = np.linalg.pinv(J) @ asked + (np.eye(arm.nv) - np.linalg.pinv(J) @ J) @ secondary
        assert np.abs(a - expected).max() <= 1e-9 * np.abs(expected).max()
        assert np.abs(a - np.linalg.pinv(J) @ asked).max() > 1e-3


def test_an_answer_is_proven_and_a_wrong_one_is_not():
    """The certificate proves an answer at limits, and refutes one that is 1e-5 rad/s² off."""
    arm = robot("panda")
    stack = Stack([[FrameTask("panda_hand", gain=30.0)]], [JointAccelerationLimit(8.0)], order=2)
    control = Controller(arm, stack, dt=H)
    q = arm.posture("middle")
    control.start(q)
    answer = control.step(q + 0.05, 0.0)
    assert answer.proven
    assert any("joint_acceleration" in active.name for active in answer.active)
    wrong = answer.replaced()
    wrong.x[0] += 1e-5
    assert not wrong.proven


def test_self_motion_comes_to_rest_and_would_not_without_its_level():
    """Self-motion of 1 rad/s dies out with K_v, and lives on without."""
    arm = robot("panda")
    q = arm.posture("middle")
    control = Controller(arm, Stack([[FrameTask("panda_hand", gain=4.0)]], order=2), dt=H)
    control.start(q)
    J = Configuration(arm, q).jacobian("panda_hand")
    v = np.linalg.svd(J)[2][-1]  # self-motion of 1 rad/s
    control.step(q, 0.0, v=v)
    for k in range(1, 6000):
        q, v = control.after()
        control.step(q, k * H)
    assert np.abs(v).max() < 1e-6
    plain = Controller(arm, Stack([[FrameTask("panda_hand", gain=4.0)]], order=2, self_motion=1e-9), dt=H)
    q = arm.posture("middle")
    plain.start(q)
    plain.step(q, 0.0, v=np.linalg.svd(J)[2][-1])
    for k in range(1, 500):
        q, v = plain.after()
        plain.step(q, k * H)
    assert np.abs(v).max() > 0.3


unit = st.floats(0.0, 1.0)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    st.lists(unit, min_size=12, max_size=12),
    st.floats(2.0, 40.0),
    st.sampled_from([1e-3, 5e-3, 2e-2]),
    st.booleans(),
)
def test_limits_hold_at_every_tick(numbers, acceleration, dt, bounded_acceleration):
    """Positions, velocities and accelerations stay within their limits to 1e-9 whatever a task asks for."""
    arm = robot("planar")
    n, (here, there, speed) = arm.nv, np.array(numbers).reshape(3, 4)
    lower, upper = arm.position_lower, arm.position_upper
    q = lower + 0.1 + here[:n] * (upper - lower - 0.2)
    v = (2.0 * speed[:n] - 1.0) * np.sqrt(0.1 * acceleration) * 0.9
    v = np.clip(v, -arm.velocity_limit, arm.velocity_limit)
    far = lower - 1.0 + there[:n] * (upper - lower + 2.0)
    limits = [JointAccelerationLimit(acceleration)]
    if not bounded_acceleration:
        limits, acceleration, v = [JointPositionLimit(), JointVelocityLimit()], np.inf, 0.0 * v
    task = JointTask(Function(lambda t: far * np.cos(9.0 * t)), gain=0.4 / dt)
    control = Controller(arm, Stack([[task]], limits, order=2), dt=dt)
    control.step(q, 0.0, v=v)
    for k in range(1, 150):
        before = v
        q, v = control.after()
        assert (q >= lower - 1e-9).all()
        assert (q <= upper + 1e-9).all()
        assert (np.abs(v) <= arm.velocity_limit + 1e-9).all()
        assert (np.abs(v - before) <= acceleration * dt + 1e-9 * dt).all()
        control.step(q, k * dt)


def test_a_start_outside_the_limits_is_braked_and_comes_back():
    """A joint beyond its limits brakes with the whole acceleration, and comes back."""
    arm, acceleration = robot("planar"), 5.0
    stack = Stack(
        [[JointTask(arm.posture("middle"), gain=2.0)]], [JointAccelerationLimit(acceleration)], order=2
    )
    control = Controller(arm, stack, dt=H)
    q, v = arm.position_upper + 0.1, 1.5 * arm.velocity_limit
    control.step(q, 0.0, v=v)
    stop = q + v**2 / (2.0 * acceleration)
    for k in range(1, 4000):
        q, v = control.after()
        assert (q <= stop + 1e-3).all()
        control.step(q, k * H)
    assert (q <= arm.position_upper).all()


def test_run_takes_the_same_steps():
    """`run` and `Controller.after` agree."""
    arm = planar_arm(lengths=(0.5, 0.5, 0.5))
    stack = Stack([[tip_task(20.0)]], order=2)
    scenario = Scenario(robot=arm, q0=START, stack=stack, duration=0.1)
    steps = list(run(scenario))
    q, v = motion(stack, 100)
    assert np.array_equal(steps[-1].q_next, q)
    assert np.array_equal(steps[-1].v, v)
    assert max(step.closed_form_distance for step in steps) < 1e-9 * max(np.abs(s.x).max() for s in steps)


@pytest.mark.parametrize("resolver", ["active-set", "pinv", "hqp/daqp", "cvxpy/clarabel"])
def test_the_norm_of_inertia_is_that_of_the_present_posture(resolver):
    """(3.104) with the pseudo-inverse that M(q) weighs, from differences of the kinetic energy."""
    arm, v = robot("panda"), np.linspace(-0.3, 0.5, 7)
    stack = Stack([[PositionTask("panda_hand", gain=3.0)]], norm="inertia", order=2, self_motion=3.0)
    control = Controller(arm, stack, resolver, dt=H)
    control.start(arm.posture("middle") - 0.1)
    for q in (arm.posture("middle"), arm.posture("middle") + 0.4):
        a = control.step(q, 0.0, v=v).a
        J, asked = control.plan.hierarchy.A[:3], control.plan.hierarchy.lower[:3]
        inverse = np.linalg.inv(mass_matrix(arm, q))
        pseudo = inverse @ J.T @ np.linalg.inv(J @ inverse @ J.T)
        expected = pseudo @ asked + (np.eye(7) - pseudo @ J) @ (-3.0 * v)
        tolerance = 1e-6 if resolver == "cvxpy/clarabel" else 1e-9
        assert np.abs(a - expected).max() < tolerance * np.abs(a).max()
        other = np.linalg.pinv(J) @ asked + (np.eye(7) - np.linalg.pinv(J) @ J) @ (-3.0 * v)
        assert np.abs(a - other).max() > 0.1


def mass_matrix(arm, q):
    """M(q) from the kinetic energy alone, which is a quadratic form of v."""
    data, eye = arm.model.createData(), np.eye(arm.nv)

    def energy(v):
        return pin.computeKineticEnergy(arm.model, data, q, v)  # pyright: ignore[reportAttributeAccessIssue]

    single = np.array([energy(e) for e in eye])
    pairs = np.array([[energy(a + b) for b in eye] for a in eye])
    return pairs - single[:, None] - single[None, :]


def test_the_norm_of_inertia_is_refused_where_it_cannot_be_had():
    """An arm without masses has no such norm, and order 1 has none; other words are unknown."""
    with pytest.raises(InvalidValue, match="needs masses"):
        Stack([[JointTask()]], norm="inertia", order=2).compile(planar_arm(), H)
    for norm, order in (("inertia", 1), ("mass", 2)):
        with pytest.raises(InvalidValue, match='or "inertia" at order=2'):
            Stack([[JointTask()]], norm=norm, order=order)


def test_a_full_norm_is_resolved_in_one_call():
    """Norms of every kind take the compiled path, since the last level holds them."""
    W = np.diag(np.linspace(1.0, 2.0, 7)) + 0.1
    for norm in (None, W, "inertia"):
        plan = Stack([[JointTask()]], norm=norm, order=2).compile(robot("panda"), H)
        assert one_call(plan, ActiveSet(), None) is not None


def test_a_copy_goes_on_as_the_original_does():
    """A copied controller has the velocity of the original."""
    arm, q = robot("panda"), robot("panda").posture("middle")
    stack = Stack([[FrameTask("panda_hand", target=(0.4, 0.2, 0.5))]], [JointAccelerationLimit(9.0)], order=2)
    control = Controller(arm, stack, dt=H)
    for k in range(50):
        control.step(q, k * H)
        q, _ = control.after()
    copy = deepcopy(control)
    assert np.array_equal(copy.step(q, 0.05).a, control.step(q, 0.05).a)
    assert np.array_equal(copy.after()[1], control.after()[1])


def test_a_task_is_switched_off_without_a_jump_of_the_acceleration():
    """A task that is switched off over a time leaves no jump, and the robot comes to rest."""
    arm, q = robot("panda"), robot("panda").posture("middle")
    levels = [[FrameTask("panda_hand", target=(0.4, 0.2, 0.5), gain=3.0, axes="xyz")]]
    control = Controller(arm, Stack(levels, order=2), dt=H)
    last, jump = None, 0.0
    for k in range(1500):
        if k == 200:
            control.set({"panda_hand.enabled": False}, over=0.5)
        a = control.step(q, k * H).a
        jump = max(jump, 0.0 if last is None else np.abs(a - last).max())
        last = a
        q, v = control.after()
    assert jump < 0.3
    assert np.abs(v).max() < 0.02
