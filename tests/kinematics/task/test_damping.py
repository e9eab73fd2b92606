"""Damping as rows of a level: stack and closed form agree for every policy, near singularities too."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue
from taskopt.hierarchy.damping import POLICIES, Chiaverini, ConstantDamping, Damping, NumericalFiltering
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import JointVelocityLimit
from taskopt.kinematics.robot import Robot, planar_arm
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Function
from taskopt.kinematics.task import During, FrameTask, JointTask, LevelDamping, PositionTask
from taskopt.loop.controller import Controller
from taskopt.resolver.closed_form_resolvers import DampedLeastSquares, PseudoInverse
from taskopt.resolver.registry import resolver

DT = 1e-3
EXACT = ("hqp/daqp", "hqp/clarabel", "hqp/proxqp", "hqp/quadprog", "active-set")
BENDS = [1.0, 3e-2, 1e-3, 1e-5, 1e-8, 0.0]


def panda(bend: float) -> Configuration:
    """The shoulder straight up as `bend` goes to zero, where joints 1 and 3 are in line and σ_min is zero."""
    robot = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    rest = [1.7389255734378262, -0.5095477060486204, 0.1851546678810787, 1.1842023925910925, 0.2]
    return Configuration(robot, [0.3, bend, *rest])


def planar(bend: float) -> Configuration:
    """Four links, stretched as `bend` goes to zero."""
    return Configuration(planar_arm([0.5, 0.4, 0.3, 0.2]), [0.4, bend, -bend, 0.5 * bend])


def stack(at: Configuration, *damping: LevelDamping, norm: object = None, rest: float = 0.3) -> Stack:
    """A hand that moves, and a posture below; damping in each level, if any."""
    frame, rows = ("panda_hand", 6) if at.robot.name == "panda" else ("tip", 3)
    start, rate = at.pose(frame)[:3, 3], np.array([0.1, 0.2, -0.1, 0.3, 0.1, -0.2])[:rows]
    path = Function(lambda t: start + t * rate[:3], derivative=lambda t: rate)
    hand = PositionTask(frame, target=path, axes="xy")
    if rows == 6:
        hand = FrameTask(frame, target=path, weight=(2.0, 0.5), expressed="world")
    return Stack([[hand, *damping], [JointTask(at.q + rest), *damping]], norm=norm)  # type: ignore[arg-type]


def norm_of(n: int, kind: str) -> np.ndarray | None:
    L = np.random.default_rng(4).normal(size=(n, n)) + 3.0 * np.eye(n)
    return {"identity": None, "diagonal": np.arange(1.0, n + 1), "full": L.T @ L}[kind]


@pytest.mark.parametrize("kind", ["identity", "diagonal", "full"])
@pytest.mark.parametrize("make", [panda, planar])
@pytest.mark.parametrize("policy", POLICIES, ids=lambda policy: policy.name)
def test_the_stack_is_the_closed_form_for_every_policy(policy: Damping, make: object, kind: str) -> None:
    """Damping rows in each level, any solver, any norm: `dls` of the stack without them, (3.59).

    At a bend of 1e-8 a null space is known to some roundings divided by 1e-8, which moves `dls` by 2e-8.
    """
    for bend in BENDS:
        allowed = 1e-7 if bend == 1e-8 else 1e-8
        at = make(bend)  # type: ignore[operator]
        norm = norm_of(at.robot.nv, kind)
        exact = DampedLeastSquares(policy)(stack(at, norm=norm).at(at, DT))[0].x
        told = stack(at, LevelDamping(policy), norm=norm).at(at, DT)
        for name in EXACT:
            found = resolver(name)(told)[0]
            np.testing.assert_allclose(
                found.x,
                exact,
                rtol=0.0,
                atol=allowed * max(1.0, np.abs(exact).max()),
                err_msg=f"{name} at {bend}",
            )
            assert found.kkt_met(), f"{name} at {bend}"
        np.testing.assert_allclose(
            PseudoInverse()(told)[0].x, exact, rtol=0.0, atol=allowed * max(1.0, np.abs(exact).max())
        )


@pytest.mark.parametrize("policy", POLICIES, ids=lambda policy: policy.name)
def test_the_height_of_a_planar_arm_is_no_singularity(policy: Damping) -> None:
    """The position in x, y, z is damped as that in x and y.

    Else Chiaverini's policy would damp a planar arm everywhere, since the third row is zero.
    """
    for bend, tilt in ((1.0, 0.0), (1.0, 0.7), (1e-2, 0.7)):
        at = Configuration(planar_arm([0.5, 0.4, 0.3]), [tilt, bend, bend])
        target = at.pose("tip")[:3, 3] + [0.01, -0.02, 0.05]
        answers = []
        for axes in ("xyz", "xy"):
            task = PositionTask("tip", target=target, axes=axes, gain=3.0)
            told = Stack([[task, LevelDamping(policy)]]).at(at, DT)
            answers.append(resolver("active-set")(told)[0].x)
            formula = DampedLeastSquares(policy)(Stack([[task]]).at(at, DT))[0].x
            np.testing.assert_allclose(answers[-1], formula, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(answers[0], answers[1], rtol=1e-9, atol=1e-12)


def test_what_the_level_leaves_free_stays_free() -> None:
    """Damping never enters the projector: another posture below moves the elbow, and not the hand."""
    at = panda(1e-3)
    J = at.jacobian("panda_hand")
    free = np.linalg.svd(J)[2][-1]
    damped = resolver("active-set")(stack(at, LevelDamping(ConstantDamping(0.1))).at(at, DT))[0].x
    other = resolver("active-set")(stack(at, LevelDamping(ConstantDamping(0.1)), rest=-0.3).at(at, DT))[0].x
    assert abs(free @ (damped - other)) > 0.05
    np.testing.assert_allclose(J @ damped, J @ other, atol=1e-12)


def test_filtering_damps_the_singular_direction_only() -> None:
    """Along the others the hand does what it is told, exactly."""
    at = panda(1e-3)
    one = Stack(stack(at).levels[:1])
    told = Stack([[*one.levels[0], LevelDamping(NumericalFiltering(0.05, 0.02))]])
    x, rows = resolver("hqp/daqp")(told.at(at, DT))[0].x, one.at(at, DT).level(1)
    root = np.sqrt(rows.weight)[:, None]
    missed = np.linalg.svd(root * rows.A)[0].T @ (root[:, 0] * (rows.A @ x - rows.upper))
    assert np.abs(missed[:5]).max() < 1e-10
    assert abs(missed[5]) > 1e-3


def test_far_from_a_singularity_the_rows_are_empty() -> None:
    """A policy that says k = 0 changes nothing."""
    at = panda(1.0)
    one = stack(at, LevelDamping(Chiaverini(0.05, 1e-3))).at(at, DT)
    assert not one.A[one.layout.blocks[1].rows].any()
    np.testing.assert_allclose(
        PseudoInverse()(one)[0].x, PseudoInverse()(stack(at).at(at, DT))[0].x, atol=1e-13
    )


def test_damping_works_inside_limits_and_in_a_control_loop() -> None:
    """Limits bind, and every tick is proven; a loop of one's own sees the same rows."""
    at = panda(1e-3)
    levels = stack(at, LevelDamping(Chiaverini())).levels
    limited = Stack(levels, [JointVelocityLimit(velocity=0.2)], damping=None)
    control = Controller(at.robot, limited, dt=DT)
    control.start(at.q)
    resolution = control.step(at.q, 0.0)
    assert resolution.active
    assert resolution.kkt_met()
    again = resolver("hqp/clarabel")(limited.at(at, DT))[0]
    np.testing.assert_allclose(resolution.x, again.x, atol=1e-8)


def test_a_target_that_moves_changes_the_damping_with_the_tick() -> None:
    """Nothing of the rows of the last tick stays in the next one."""
    at, near = panda(1.0), panda(1e-3)
    plan = stack(at, LevelDamping(Chiaverini())).compile(at.robot, DT)
    plan.start(at.q)
    plan.at(near.q, 0.0)
    np.testing.assert_array_equal(
        plan.at(at.q, 0.0).buffer, stack(at, LevelDamping(Chiaverini())).at(at, DT).buffer
    )


@pytest.mark.parametrize(
    "make",
    [
        lambda: LevelDamping(0.05),  # type: ignore[arg-type]
        lambda: During(LevelDamping(), end=1.0),
        lambda: Stack([[LevelDamping()]]).compile(planar_arm(), DT),
        lambda: Stack([[JointTask(), LevelDamping(), LevelDamping()]]).compile(planar_arm(), DT),
    ],
)
def test_damping_without_a_meaning_is_refused(make: object) -> None:
    """A number for a policy, a time of its own, nothing to damp, damping of damping."""
    with pytest.raises(InvalidValue, match=r"damp"):
        make()  # type: ignore[operator]
