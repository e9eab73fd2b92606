"""Rank, lost directions, arm and wrist apart, boundary or internal: what Sect. 3.3 says of its arms."""

from functools import cache

import numpy as np
import pytest

from taskopt import (
    Configuration,
    InvalidValue,
    Robot,
    anthropomorphic_with_wrist,
    classify_singularity,
    decouple,
    find_singularity,
    planar_arm,
    scara,
    workspace_map,
)

PLANE, SPACE, TURNS = (0, 1), (0, 1, 2), (3, 4, 5)


@cache
def robot(name: str) -> Robot:
    """The robot of that name."""
    return Robot.load(name)


@pytest.mark.equation("3.39", "3.41")
@pytest.mark.example("3.2")
@pytest.mark.figure("3.3")
def test_a_stretched_two_link_arm_cannot_move_along_itself() -> None:
    """det J = a₁ a₂ s₂ vanishes at ϑ₂ = 0 and π, where the columns are parallel and one direction is lost."""
    of = planar_arm((0.7, 0.4))
    for theta_1 in (-2.0, 0.0, 0.3, 3.0):
        for theta_2 in (0.0, np.pi):
            at = Configuration(of, [theta_1, theta_2])
            found = find_singularity(at.jacobian("tip")[:2])
            assert (found.rank, found.is_singular) == (1, True)
            assert found.distance < 1e-15
            along = np.array([np.cos(theta_1), np.sin(theta_1)])
            np.testing.assert_allclose(np.abs(found.lost[:, 0] @ along), 1.0, atol=1e-14)
            np.testing.assert_allclose(at.jacobian("tip")[:2] @ found.idle, 0.0, atol=1e-15)
            assert classify_singularity(at, "tip", PLANE) == "boundary"
        at = Configuration(of, [theta_1, 0.8])
        assert not find_singularity(at.jacobian("tip")[:2]).is_singular
        assert classify_singularity(at, "tip", PLANE) == "regular"


def test_a_folded_arm_of_equal_links_is_not_at_a_boundary() -> None:
    """With a₁ = a₂ the tip at the base can leave to every side, once the first joint has turned."""
    at = Configuration(planar_arm((0.5, 0.5)), [0.3, np.pi])
    assert classify_singularity(at, "tip", PLANE) == "internal"


@pytest.mark.problem("3.4")
@pytest.mark.parametrize(("theta_2", "theta_3"), [(0.0, 0.0), (np.pi, 0.0), (0.0, np.pi), (np.pi, np.pi)])
def test_singularities_of_the_three_link_planar_arm(theta_2: float, theta_3: float) -> None:
    """Without orientation it is singular where all links are in line; stretched out it is at a boundary.

    With the orientation the determinant is that of the first two links, a₁ a₂ s₂.
    """
    a1, a2, of, rng = 0.5, 0.4, planar_arm((0.5, 0.4, 0.3)), np.random.default_rng(1)
    for theta_1 in rng.uniform(-np.pi, np.pi, size=20):
        at = Configuration(of, [theta_1, theta_2, theta_3])
        assert find_singularity(at.jacobian("tip")[:2]).rank == 1
        kind = classify_singularity(at, "tip", PLANE)
        assert kind == ("boundary" if theta_2 == theta_3 == 0.0 else "internal")
    for q in rng.uniform(0.1, np.pi - 0.1, size=(100, 3)) * rng.choice([-1.0, 1.0], size=(100, 3)):
        J = Configuration(of, q).jacobian("tip")
        assert find_singularity(J[:2]).rank == 2
        assert np.linalg.det(J[[0, 1, 5]]) == pytest.approx(a1 * a2 * np.sin(q[1]), abs=1e-14)


@pytest.mark.equation("3.38")
@pytest.mark.figure("3.5", "3.6")
def test_singularities_of_the_anthropomorphic_arm() -> None:
    """det J_P = −a₂ a₃ s₃ (a₂ c₂ + a₃ c₂₃): elbow (boundary) and shoulder (internal, first column null)."""
    a2 = a3 = 0.5
    of, rng = robot("anthropomorphic"), np.random.default_rng(2)
    for q in rng.uniform(-np.pi, np.pi, size=(1000, 3)):
        at = Configuration(of, q)
        reach = a2 * np.cos(q[1]) + a3 * np.cos(q[1] + q[2])
        assert np.linalg.det(at.jacobian("tip")[:3]) == pytest.approx(
            -a2 * a3 * np.sin(q[2]) * reach, abs=1e-14
        )
    elbow = Configuration(of, [0.3, 0.5, 0.0])
    assert classify_singularity(elbow, "tip", SPACE) == "boundary"
    np.testing.assert_allclose(
        np.abs(find_singularity(elbow.jacobian("tip")[:3]).lost[:, 0] @ elbow.pose("tip")[:3, 3]),
        1.0,
        atol=1e-14,
    )
    shoulder = Configuration(of, [0.3, 0.7, np.pi - 1.4])
    np.testing.assert_allclose(shoulder.pose("tip")[:2, 3], 0.0, atol=1e-15)
    np.testing.assert_allclose(shoulder.jacobian("tip")[:3, 0], 0.0, atol=1e-15)
    assert classify_singularity(shoulder, "tip", SPACE) == "internal"
    lost = find_singularity(shoulder.jacobian("tip")[:3]).lost[:, 0]
    np.testing.assert_allclose(np.abs(lost @ [np.sin(0.3), -np.cos(0.3), 0.0]), 1.0, atol=1e-14)
    upright = Configuration(of, [0.3, np.pi / 2, 0.0])  # elbow and shoulder at once, the highest point
    assert find_singularity(upright.jacobian("tip")[:3]).rank == 1
    assert classify_singularity(upright, "tip", SPACE) == "boundary"


@pytest.mark.slow
@pytest.mark.equation("3.42", "3.43", "3.44")
@pytest.mark.parametrize("name", ["stanford", "anthropomorphic_with_wrist"])
def test_arm_and_wrist_come_apart(name: str) -> None:
    """det J = det J₁₁ det J₂₂ at 500 random postures, and J₁₂ = 0 at the wrist centre."""
    of, rng = robot(name), np.random.default_rng(3)
    for q in rng.uniform(-np.pi, np.pi, size=(500, 6)):
        at = Configuration(of, q)
        found = decouple(at, "tip")
        whole = np.linalg.det(at.jacobian("tip"))
        assert found.arm_measure * found.wrist_measure == pytest.approx(whole, abs=1e-12)
        assert abs(found.wrist_measure) == pytest.approx(abs(np.sin(q[4])), abs=1e-12)
        np.testing.assert_allclose(found.centre, at.pose("link5")[:3, 3], atol=1e-12)
        np.testing.assert_allclose(found.arm, at.jacobian("link5")[:3, :3], atol=1e-12)
        np.testing.assert_allclose(found.coupling, at.jacobian("tip")[3:, :3], atol=1e-15)


@pytest.mark.figure("3.4")
def test_a_wrist_singularity_is_internal() -> None:
    """At ϑ₅ = 0, equal and opposite turns of joints 4 and 6 do nothing, and the axis across both is lost."""
    for theta_5 in (0.0, np.pi):
        at = Configuration(robot("spherical_wrist"), [0.4, theta_5, -0.9])
        found = find_singularity(at.jacobian("tip")[3:])
        assert found.rank == 2
        opposite = np.array([1.0, 0.0, -np.cos(theta_5)]) / np.sqrt(2.0)
        np.testing.assert_allclose(np.abs(found.idle[:, 0] @ opposite), 1.0, atol=1e-14)
        z3, z4 = at.jacobian("tip")[3:, :2].T
        np.testing.assert_allclose(np.abs(found.lost[:, 0] @ np.cross(z3, z4)), 1.0, atol=1e-14)
        assert classify_singularity(at, "tip", TURNS) == "internal"


def test_seven_joints_have_an_arm_of_four() -> None:
    """Before a spherical wrist stand four joints; the measure is zero where the elbow is stretched."""
    bent = decouple(Configuration(robot("seven_joint_arm"), [0.1, 0.5, 0.2, 0.9, 0.3, 0.7, 0.1]), "tip")
    assert bent.arm.shape == (3, 4)
    assert bent.arm_measure > 0.01
    stretched = decouple(Configuration(robot("seven_joint_arm"), [0.1, 0.5, 0.2, 0.0, 0.3, 0.7, 0.1]), "tip")
    assert stretched.arm_measure < 1e-9


def test_what_is_no_spherical_wrist_is_refused() -> None:
    """Axes that pass each other (Panda), too few joints, a prismatic joint among the last three."""
    panda = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    with pytest.raises(InvalidValue, match=r"pass each other by 0\.0\d+ m: no spherical wrist"):
        decouple(Configuration(panda, panda.posture("middle")), "panda_hand")
    with pytest.raises(InvalidValue, match="3 joints move 'tip'; arm and wrist need at least six"):
        decouple(Configuration(robot("anthropomorphic"), [0.1, 0.2, 0.3]), "tip")


@pytest.mark.problem("3.5")
def test_singularities_of_the_spherical_arm() -> None:
    """|det J_P| = d₃² |s₂|: at the shoulder, and where d₃ = 0."""
    of, rng = robot("spherical"), np.random.default_rng(4)
    for q in rng.uniform(-2.0, 2.0, size=(500, 3)):
        J = Configuration(of, q).jacobian("tip")[:3]
        assert abs(np.linalg.det(J)) == pytest.approx(q[2] ** 2 * abs(np.sin(q[1])), abs=1e-13)
    for q in ([0.3, 0.0, 0.5], [0.3, np.pi, 0.5], [0.3, 0.7, 0.0]):
        assert find_singularity(Configuration(of, q).jacobian("tip")[:3]).is_singular
    assert not find_singularity(Configuration(of, [0.3, 0.7, 0.5]).jacobian("tip")[:3]).is_singular


@pytest.mark.problem("3.6")
def test_singularities_of_the_cylindrical_arm() -> None:
    """|det J_P| = |d₃|: singular only on the axis of the first joint, inside the workspace."""
    of, rng = robot("cylindrical"), np.random.default_rng(5)
    for q in rng.uniform(-2.0, 2.0, size=(500, 3)):
        assert abs(np.linalg.det(Configuration(of, q).jacobian("tip")[:3])) == pytest.approx(
            abs(q[2]), abs=1e-14
        )
    on_axis = Configuration(of, [0.3, 0.7, 0.0])
    assert find_singularity(on_axis.jacobian("tip")[:3]).rank == 2
    assert classify_singularity(on_axis, "tip", SPACE) == "internal"


@pytest.mark.problem("3.7")
def test_singularities_of_the_scara() -> None:
    """det of rows x, y, z, ω_z is a₁ a₂ s₂: as for two planar links."""
    of, rng = scara(0.5, 0.4), np.random.default_rng(6)
    for q in rng.uniform(-np.pi, np.pi, size=(500, 4)):
        J = Configuration(of, q).jacobian("tip")[[0, 1, 2, 5]]
        assert np.linalg.det(J) == pytest.approx(0.5 * 0.4 * np.sin(q[1]), abs=1e-14)
    for theta_2 in (0.0, np.pi):
        at = Configuration(of, [0.3, theta_2, -0.5, 0.2])
        assert find_singularity(at.jacobian("tip")[[0, 1, 2, 5]]).rank == 3
        assert classify_singularity(at, "tip", (0, 1, 2, 5)) == "boundary"


@pytest.mark.equation("3.124")
@pytest.mark.problem("3.8")
def test_manipulability_is_the_product_of_the_singular_values() -> None:
    """√det(J Jᵀ) for wide and square matrices, rank-deficient ones included; |det J| where J is square."""
    rng = np.random.default_rng(7)
    for m, n in [(2, 3), (3, 3), (6, 7), (3, 7), (1, 4)]:
        for trial in range(50):
            J = rng.normal(size=(m, n))
            if trial % 5 == 0:
                J[-1] = J[0] if m > 1 else 0.0
            found = find_singularity(J)
            assert found.manipulability**2 == pytest.approx(np.linalg.det(J @ J.T), rel=1e-9, abs=1e-8)
            if m == n:
                assert found.manipulability == pytest.approx(abs(np.linalg.det(J)), abs=1e-12)


def test_distances_from_a_singularity() -> None:
    """σ_min is the size of the smallest change that makes J singular, and the ratio is 1/cond(J)."""
    J = np.random.default_rng(8).normal(size=(3, 5))
    found = find_singularity(J)
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    assert np.linalg.matrix_rank(J - sigma[-1] * np.outer(U[:, -1], Vt[-1]), tol=1e-12) == 2
    assert found.distance == pytest.approx(sigma[-1])
    assert found.ratio == pytest.approx(1.0 / np.linalg.cond(J))
    assert find_singularity(np.zeros((2, 3))).ratio == 0.0


def test_the_map_of_a_workspace() -> None:
    """Points lie in the ring that two links reach, and w = a₁ a₂ |s₂| at each."""
    found = workspace_map(planar_arm((0.6, 0.4)), "tip", PLANE, count=256)
    radius = np.linalg.norm(found.points, axis=1)
    assert radius.min() >= 0.2 - 1e-12
    assert radius.max() <= 1.0 + 1e-12
    np.testing.assert_allclose(found.manipulability, 0.24 * np.abs(np.sin(found.q[:, 1])), atol=1e-14)
    assert (found.distance <= found.singular_values[:, 0]).all()
    limited = workspace_map(anthropomorphic_with_wrist(lower=-0.1, upper=0.2), "tip", count=64)
    assert ((limited.q >= -0.1) & (limited.q <= 0.2)).all()


def test_a_map_needs_limits_of_sliding_joints() -> None:
    """Nobody knows how far a quill without limits goes; a floating base has no uniform posture."""
    with pytest.raises(InvalidValue, match="joint3 of scara can slide without limit"):
        workspace_map(robot("scara"), "tip")
    with pytest.raises(InvalidValue, match="joints of several coordinates"):
        workspace_map(robot("talos_reduced"), "gripper_left_base_link")
