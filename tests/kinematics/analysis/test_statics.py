"""Statics: virtual work, duality, transformation between frames, closed chains, as Sect. 3.8 has them."""

import numpy as np
import pytest

from taskopt import (
    Configuration,
    InvalidValue,
    Robot,
    force_transform,
    joint_torques,
    loop_jacobian,
    parallelogram_arm,
    subspaces,
    transmission,
    velocity_transform,
)
from taskopt.kinematics.analysis.closed_chain import actuated_torques
from taskopt.kinematics.pose import exp6

COUNTS = pytest.mark.parametrize("count", [200, pytest.param(10_000, marks=pytest.mark.slow)])


@pytest.mark.equation("3.105", "3.106", "3.107", "3.108", "3.109", "3.110", "3.111")
@pytest.mark.parametrize("name", ["planar3", "scara", "stanford", "panda", "tiago", "talos_reduced"])
def test_torques_do_the_work_of_the_forces(name: str) -> None:
    """τᵀ δq = fᵀ δp + μᵀ δφ for displacements by differences of poses, and γ ∈ N(Jᵀ) needs no torque."""
    of, rng, h = Robot.load(name), np.random.default_rng(1), 1e-6
    frame = {"panda": "panda_hand", "tiago": "arm_tool_link", "talos_reduced": "gripper_left_base_link"}.get(
        name, "tip"
    )
    for _ in range(20):
        q = of.integrate(of.posture("middle"), rng.normal(size=of.nv), 1.0)
        at, dq, wrench = Configuration(of, q), rng.normal(size=of.nv), rng.normal(size=6)
        ahead, behind = (Configuration(of, of.integrate(q, dq, s * h)).pose(frame) for s in (1.0, -1.0))
        turning = (ahead - behind)[:3, :3] / (2.0 * h) @ at.pose(frame)[:3, :3].T
        dp, turned = (ahead - behind)[:3, 3] / (2.0 * h), [turning[2, 1], turning[0, 2], turning[1, 0]]
        torque = joint_torques(at.jacobian(frame), wrench)
        assert torque @ dq == pytest.approx(wrench[:3] @ dp + wrench[3:] @ turned, abs=1e-7)
        for borne in subspaces(at.jacobian(frame)).null_of_transpose.T:
            np.testing.assert_allclose(joint_torques(at.jacobian(frame), borne), 0.0, atol=1e-13)


@pytest.mark.figure("3.21")
def test_a_stretched_arm_bears_a_force_along_itself() -> None:
    """At the singularity of Example 3.2 the force along the links needs no torque."""
    J = Configuration(Robot.load("planar2"), [0.4, 0.0]).jacobian("tip")[:2]
    np.testing.assert_allclose(joint_torques(J, [np.cos(0.4), np.sin(0.4)]), 0.0, atol=1e-15)


@COUNTS
@pytest.mark.equation("3.112", "3.113", "3.114", "3.115", "3.116")
@pytest.mark.figure("3.22")
def test_velocities_and_forces_change_from_frame_to_frame(count: int) -> None:
    """(3.113) and (3.116), written out, at 10⁴ random points; power is the same in both frames."""
    rng = np.random.default_rng(2)
    Q, _ = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    Q[np.linalg.det(Q) < 0.0, :, 0] *= -1.0
    for R, r, v, wrench in zip(Q, *rng.normal(size=(2, count, 3)), rng.normal(size=(count, 6)), strict=True):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = R, r
        w = v[::-1]
        S = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
        moved = velocity_transform(pose) @ [*v, *w]
        assert np.abs(moved - [*(R.T @ v - R.T @ S @ w), *(R.T @ w)]).max() < 1e-12
        force = force_transform(pose) @ wrench
        assert np.abs(force - [*(R @ wrench[:3]), *(S @ R @ wrench[:3] + R @ wrench[3:])]).max() < 1e-12
        assert abs(moved @ wrench - np.concatenate([v, w]) @ force) < 1e-12


@pytest.mark.equation("3.112", "3.115")
def test_a_tool_is_seen_from_the_hand() -> None:
    """The velocity of a tool point by the transform is that of its own frame, for the Panda's hand."""
    panda, rng = Robot.load("panda"), np.random.default_rng(3)
    at = Configuration(panda, panda.posture("middle"))
    hand, tool = at.pose("panda_hand"), at.pose("panda_hand_tcp")
    of_tool = velocity_transform(np.linalg.inv(hand) @ tool)
    for v in rng.normal(size=(20, panda.nv)):
        seen = of_tool @ (at.jacobian("panda_hand", expressed="own") @ v)
        np.testing.assert_allclose(seen, at.jacobian("panda_hand_tcp", expressed="own") @ v, atol=1e-12)


def test_transforms_compose() -> None:
    """From 1 to 2 to 3 is from 1 to 3."""
    rng = np.random.default_rng(4)
    first, second = (exp6(rng.normal(size=6)) for _ in range(2))
    np.testing.assert_allclose(
        velocity_transform(second) @ velocity_transform(first), velocity_transform(first @ second), atol=1e-13
    )


@pytest.mark.equation("3.117", "3.118", "3.119", "3.120", "3.121")
@pytest.mark.example("3.5")
def test_the_parallelogram_of_the_text() -> None:
    """Υ = [[1, 0], [0, 1], [−1, 1], [1, −1]] in the text's order, and τ_a as (3.121), at random postures."""
    arm, rng = parallelogram_arm(a1=0.3, a2=0.6, a4=0.4), np.random.default_rng(5)
    order = [arm.joints.index(name) for name in ("joint1'", "joint1''", "joint2'", "joint3'")]
    text = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 1.0], [1.0, -1.0]])
    for inner, outer in rng.uniform(-np.pi, np.pi, size=(200, 2)):
        if abs(np.sin(outer - inner)) < 0.05:  # near the dead centre, where all links are in line
            continue
        q = np.empty(4)
        q[order] = [inner, outer, outer - inner, np.pi - (outer - inner)]  # (2.64)
        at = Configuration(arm, q)
        np.testing.assert_allclose(at.pose("loop_a")[:3, 3], at.pose("loop_b")[:3, 3], atol=1e-15)
        found = transmission(loop_jacobian(at, "loop_a", "loop_b", (0, 1)), order[:2])
        np.testing.assert_allclose(found[order], text, atol=1e-12)
        t1, t11, t2, t3 = torques = rng.normal(size=4)
        tree = np.empty(4)
        tree[order] = torques
        np.testing.assert_allclose(actuated_torques(found, tree), [t1 - t2 + t3, t11 + t2 - t3], atol=1e-11)


@pytest.mark.equation("3.120")
def test_actuated_torques_do_the_work_at_the_tip() -> None:
    """Υᵀ Jᵀ γ is what virtual work asks for along motions that keep the loop closed."""
    arm, rng = parallelogram_arm(), np.random.default_rng(6)
    at = Configuration(arm, arm.posture("closed"))
    move = transmission(loop_jacobian(at, "loop_a", "loop_b", (0, 1)), (0, 3))
    for dq, wrench in zip(rng.normal(size=(20, 2)), rng.normal(size=(20, 6)), strict=True):
        work = wrench @ at.jacobian("tip") @ move @ dq
        assert actuated_torques(move, joint_torques(at.jacobian("tip"), wrench)) @ dq == pytest.approx(work)


@pytest.mark.equation("3.118", "3.119")
def test_a_four_bar_moves_as_its_loop_says() -> None:
    """∂q_u/∂q_a of a general four-bar by differences of a closed loop that Newton's method finds."""
    crank, coupler, rocker, ground, rng = 0.2, 0.5, 0.45, 0.55, np.random.default_rng(7)

    def closed(theta: float, guess: np.ndarray) -> np.ndarray:
        x = guess.copy()
        for _ in range(50):
            a, b = theta + x[0], x[1]
            gap = np.array(
                [
                    crank * np.cos(theta) + coupler * np.cos(a) - ground - rocker * np.cos(b),
                    crank * np.sin(theta) + coupler * np.sin(a) - rocker * np.sin(b),
                ]
            )
            slope = np.array(
                [[-coupler * np.sin(a), rocker * np.sin(b)], [coupler * np.cos(a), -rocker * np.cos(b)]]
            )
            x -= np.linalg.solve(slope, gap)
        return x

    for theta in rng.uniform(-np.pi, np.pi, size=20):
        x = closed(theta, np.array([0.7 - theta, 1.5]))
        h = 1e-6
        slopes = (closed(theta + h, x) - closed(theta - h, x)) / (2.0 * h)
        a = theta + x[0]
        closure = np.array(  # columns: crank, coupler relative to it, rocker
            [
                [-crank * np.sin(theta) - coupler * np.sin(a), -coupler * np.sin(a), rocker * np.sin(x[1])],
                [crank * np.cos(theta) + coupler * np.cos(a), coupler * np.cos(a), -rocker * np.cos(x[1])],
            ]
        )
        np.testing.assert_allclose(transmission(closure, (0,))[:, 0], [1.0, *slopes], atol=1e-7)


def test_joints_that_do_not_determine_a_loop_are_refused() -> None:
    """A dead centre, too few actuated joints, and too many."""
    arm = parallelogram_arm()
    at = Configuration(arm, arm.posture("closed"))
    closure = loop_jacobian(at, "loop_a", "loop_b", (0, 1))
    with pytest.raises(InvalidValue, match="do not determine the others"):
        transmission(closure, (0,))
    with pytest.raises(
        InvalidValue, match="3 actuated joints cannot move independently in this loop; actuate 2"
    ):
        transmission(closure, (0, 1, 3))
    folded = Configuration(arm, [0.5, 0.0, np.pi, 0.5])
    with pytest.raises(InvalidValue, match="dead centre"):
        transmission(loop_jacobian(folded, "loop_a", "loop_b", (0, 1)), (0, 3))
