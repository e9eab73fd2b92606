"""Rows of second order: J̇ v against differences of the error along a motion, refusals, units, gains."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt import (
    BatchController,
    Circle,
    Controller,
    FrameTask,
    Function,
    GazeTask,
    InvalidValue,
    JointAccelerationLimit,
    JointPositionLimit,
    JointTask,
    Latest,
    Line,
    OrientationTask,
    PositionTask,
    Robot,
    Stack,
)
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.log_rate import jlog6_rate
from taskopt.kinematics.pose import exp6, jlog6
from taskopt.kinematics.space import PoseSpace
from taskopt.kinematics.target import TIMING
from tests.helpers.robots import robot

H = 1e-3
GAIN = 3.0
KINDS = {
    "pose, own": lambda frame, **more: FrameTask(frame, **more),
    "pose, world": lambda frame, **more: FrameTask(frame, expressed="world", **more),
    "position, own": lambda frame, **more: PositionTask(frame, expressed="own", **more),
    "position, world": lambda frame, **more: PositionTask(frame, **more),
    "orientation, own": lambda frame, **more: OrientationTask(frame, **more),
    "orientation, world": lambda frame, **more: OrientationTask(frame, expressed="world", **more),
    "some axes": lambda frame, **more: FrameTask(frame, axes="xzy", **more),
}
TIPS = {"panda": "panda_hand", "ur10_robot": "tool0"}


def moving_target(T, rng) -> Function:
    """A target that moves and turns with accelerations, as a function of the time alone."""
    at = T @ exp6(0.5 * rng.normal(size=6))
    first, second = 0.3 * rng.normal(size=6), rng.normal(size=6)

    def path(t):
        out, xi = at.copy(), first * t + 0.5 * second * t * t
        out[:3, 3] += xi[:3]
        out[:3, :3] = exp6(np.r_[0.0, 0.0, 0.0, xi[3:]])[:3, :3] @ at[:3, :3]
        return out

    return Function(path)


def rates_of_error(arm, task, q, v, a, t):
    """Error with its first two derivatives along q ⊕ (v s + ½ a s²), by differences of fourth order."""
    plan = Stack([[task]]).compile(arm, H)
    plan.start(q, 0.0)
    step, error = 4e-4, []
    for s in (-2.0 * step, -step, 0.0, step, 2.0 * step):
        plan.at(arm.integrate(q, v * s + 0.5 * a * s * s, 1.0), t + s)
        error.append(plan.tasks[0].error.copy())
    first = (8.0 * (error[3] - error[1]) - (error[4] - error[0])) / (12.0 * step)
    second = (16.0 * (error[3] + error[1]) - error[4] - error[0] - 30.0 * error[2]) / (12.0 * step**2)
    return error[2], first, second


@pytest.mark.equation("3.99", "3.100", "3.101", "3.102")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", TIPS)
def test_error_of_a_frame_follows_the_linear_system_of_second_order(name, kind):
    """Along the motion with the answer q̈ the differences of e keep ë + K_D ė + K_P e = 0."""
    arm, rng = robot(name), np.random.default_rng(3)
    q, v = arm.posture("middle") + 0.3, rng.normal(size=arm.nv)
    target = moving_target(Configuration(arm, q).pose(TIPS[name]), rng)
    for rate_gain in (None, 4.0):
        task = KINDS[kind](TIPS[name], target=target, gain=GAIN, rate_gain=rate_gain)
        control = Controller(arm, Stack([[task]], order=2), dt=H)
        control.start(q)
        resolution = control.step(q, 0.2, v=v)
        e, de, dde = rates_of_error(arm, task, q, v, resolution.a, 0.2)
        damping = 2.0 * GAIN if rate_gain is None else rate_gain
        assert np.abs(dde + damping * de + GAIN**2 * e).max() < 1e-6 * max(1.0, np.abs(dde).max())
        # Without J̇ v the acceleration would be another one, which the differences would notice.
        lacking = resolution.a + np.linalg.pinv(control.plan.hierarchy.A[: len(e)]) @ (0.01 * dde)
        _, de, dde = rates_of_error(arm, task, q, v, lacking, 0.2)
        assert np.abs(dde + damping * de + GAIN**2 * e).max() > 1e-4


@given(
    st.lists(st.floats(-1.0, 1.0), min_size=18, max_size=18),
    st.sampled_from([0.0, 1e-9, 1e-3, 0.5, 2.0, 3.1, np.pi]),
)
def test_rate_of_jlog6_is_its_derivative(numbers, angle):
    """The series agrees with differences of Jlog6 from θ = 0 to θ = π."""
    xi, rate, u = np.array(numbers).reshape(3, 6)
    xi = xi + np.r_[np.zeros(5), 2.0]
    xi[3:] *= angle / np.linalg.norm(xi[3:])
    inside = xi.copy()
    inside[3:] *= 1.0 - 1e-5  # beyond π the logarithm of the pose is another one
    step = 1e-6
    ahead, behind = jlog6(exp6(inside + step * rate)), jlog6(exp6(inside - step * rate))
    expected = (ahead - behind) @ u / (2.0 * step)
    assert np.abs(np.array(jlog6_rate(inside, rate, u)) - expected).max() < 1e-7


@pytest.mark.parametrize(
    "target",
    [
        *(Line(by=(0.1, 0.2, -0.1, 0.3, 0.1, 0.2), duration=1.0, timing=law) for law in TIMING),
        Circle(radius=0.1, period=2.0),
        Function(lambda t: (0.1 * np.sin(2.0 * t), 0.2 * np.cos(t), t**3)),
        Function(
            lambda t: (0.1 * np.sin(2.0 * t), 0.2 * np.cos(t), t**3),
            lambda t: np.array([0.2 * np.cos(2.0 * t), -0.2 * np.sin(t), 3.0 * t * t, 0.0, 0.0, 0.0]),
        ),
        Function(
            lambda t: (0.1 * np.sin(2.0 * t), 0.2 * np.cos(t), t**3),
            lambda t: np.array([0.2 * np.cos(2.0 * t), -0.2 * np.sin(t), 3.0 * t * t, 0.0, 0.0, 0.0]),
            lambda t: np.array([-0.4 * np.sin(2.0 * t), -0.2 * np.cos(t), 6.0 * t, 0.0, 0.0, 0.0]),
        ),
    ],
)
def test_acceleration_of_a_target_is_the_derivative_of_its_rate(target):
    """ẍ_d is the derivative of ẋ_d, exactly for declared paths."""
    course = target.start(PoseSpace("target"), np.eye(4), 0.0)
    for t in (0.1, 0.4, 0.61, 0.9):
        rates = []
        for s in (t - 1e-5, t + 1e-5):
            rate = np.zeros(6)
            assert course(s, np.eye(4), rate)
            rates.append(rate)
        acceleration = np.full(6, np.nan)
        course(t, np.eye(4), np.zeros(6), acceleration)
        expected = (rates[1] - rates[0]) / 2e-5
        assert np.abs(acceleration - expected).max() < 1e-3
        if not isinstance(target, Function):
            assert np.abs(acceleration - expected).max() < 1e-8


def test_latest_feeds_its_acceleration_forward():
    """`Latest` adds the ẍ_d that was set, and forgets it with the next value."""
    arm, target = robot("panda"), Latest()
    control = Controller(arm, Stack([[JointTask(target=target)]], order=2))
    q = arm.posture("middle")
    control.start(q)
    assert np.abs(control.step(q, 0.0).a).max() < 1e-12
    target.set(q, np.zeros(arm.nv), np.full(arm.nv, 0.7))
    assert np.allclose(control.step(q, 0.0, v=np.zeros(arm.nv)).a, 0.7)
    target.set(q)
    assert np.abs(control.step(q, 0.0, v=np.zeros(arm.nv)).a).max() < 1e-12
    with pytest.raises(InvalidValue, match="needs its velocity"):
        target.set(q, acceleration=np.zeros(arm.nv))


class ThreeArguments:
    """A target as a user may have written it for stacks of first order."""

    def start(self, space, start, t):
        def course(t, value, rate):
            value[...] = start
            return False

        return course


def test_what_order_2_does_not_have_is_refused_by_name():
    """Each part without a second order is named in the error."""
    arm = robot("panda")
    hand = FrameTask("panda_hand")
    with pytest.raises(InvalidValue, match=r"'panda_hand gaze'.*order 2"):
        Stack([[GazeTask("panda_hand", (1.0, 0.0, 0.0), 0.5)]], order=2).compile(arm, H)
    with pytest.raises(InvalidValue, match="order must be 1"):
        Stack([[hand]], order=3)
    with pytest.raises(InvalidValue, match="leave JointPositionLimit out"):
        Stack([[hand]], [JointPositionLimit(), JointAccelerationLimit(5.0)], order=2).compile(arm, H)
    control = Controller(arm, Stack([[FrameTask("panda_hand", target=ThreeArguments())]], order=2))
    with pytest.raises(InvalidValue, match="fourth argument"):
        control.start(arm.posture("middle"))
    stack = Stack([[hand]], order=2)
    with pytest.raises(InvalidValue, match="BatchController does not know"):
        BatchController(arm, stack)
    floating = Robot.load("panda", floating=True)
    with pytest.raises(InvalidValue, match="order 2"):
        Stack([[JointTask(joints=[floating.joints[0]])]], order=2).compile(floating, H)


def test_gains_that_would_not_converge_are_refused():
    """K_D Δt < 1 and K_P Δt < 2 K_D are asked for, and said."""
    arm = robot("panda")

    def compiled(**gains):
        return Stack([[FrameTask("panda_hand", **gains)]], order=2).compile(arm, 1e-2)

    compiled(gain=49.0)
    with pytest.raises(InvalidValue, match="K_D · dt < 1"):
        compiled(gain=50.0)
    compiled(gain=140.0, rate_gain=99.0)
    with pytest.raises(InvalidValue, match="rate_gain 100 1/s"):
        compiled(gain=10.0, rate_gain=100.0)
    with pytest.raises(InvalidValue, match="2 rate_gain"):
        compiled(gain=142.0, rate_gain=99.0)
    with pytest.raises(InvalidValue, match="rate_gain must be ≥ 0"):
        compiled(gain=1.0, rate_gain=-1.0)


@settings(max_examples=40)
@given(st.floats(0.1, 300.0), st.floats(1e-4, 1e-2))
def test_accepted_gains_give_stable_steps(gain, dt):
    """Every gain that is accepted gives a discrete form of (3.103) whose poles are inside the unit circle."""
    arm = robot("planar")
    for rate_gain in (None, 0.9 / dt, 0.2 / dt):
        try:
            Stack([[JointTask(gain=gain, rate_gain=rate_gain)]], order=2).compile(arm, dt)
        except InvalidValue:
            continue
        d, p = 2.0 * gain if rate_gain is None else rate_gain, gain**2
        step = np.array([[1.0 - 0.5 * p * dt * dt, dt - 0.5 * d * dt * dt], [-p * dt, 1.0 - d * dt]])
        assert np.abs(np.linalg.eigvals(step)).max() < 1.0


def test_units_and_the_names_of_unknowns_are_those_of_accelerations():
    """Units are those of accelerations, and self-motion is the last block."""
    arm = robot("panda")
    layout = Stack([[FrameTask("panda_hand")]], order=2).compile(arm, H).layout
    assert layout.unknown_units[0] == "rad/s²"
    assert layout.blocks[0].row_units == ("m/s²",) * 3 + ("rad/s²",) * 3
    assert layout.blocks[-1].name == "self-motion"


def test_answers_of_each_order_have_a_name_of_their_own():
    """No acceleration can be taken for a velocity."""
    arm = robot("panda")
    q = arm.posture("middle")
    second = Controller(arm, Stack([[FrameTask("panda_hand")]], order=2)).step(q, 0.0)
    first = Controller(arm, Stack([[FrameTask("panda_hand")]])).step(q, 0.0)
    with pytest.raises(InvalidValue, match=r"take resolution\.a"):
        _ = second.v
    with pytest.raises(InvalidValue, match=r"take resolution\.v"):
        _ = first.a
    assert second.a is second.x
