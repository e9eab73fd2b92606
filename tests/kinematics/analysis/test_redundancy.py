"""Subspaces, redundant degrees of freedom and internal motions, as Sect. 3.4 describes them."""

import numpy as np
import pytest

from taskopt import Configuration, InvalidValue, Robot, internal_motion, planar_arm, subspaces

FINGERS = ("panda_finger_joint1", "panda_finger_joint2")


@pytest.mark.equation("3.45")
@pytest.mark.figure("3.7", "3.21")
@pytest.mark.parametrize(("m", "n"), [(2, 3), (3, 3), (6, 7), (6, 3), (1, 1)])
def test_range_and_null_space_are_complements(m: int, n: int) -> None:
    """dim R(J) + dim N(J) = n whatever the rank; N(J) ⊥ R(Jᵀ) and R(J) ⊥ N(Jᵀ) span their spaces."""
    rng = np.random.default_rng(m + 10 * n)
    for rank in range(min(m, n) + 1):
        J = rng.normal(size=(m, rank)) @ rng.normal(size=(rank, n))
        found = subspaces(J)
        assert found.rank == rank
        assert found.range.shape[1] + found.null.shape[1] == n
        np.testing.assert_allclose(J @ found.null, 0.0, atol=1e-13)
        np.testing.assert_allclose(J.T @ found.null_of_transpose, 0.0, atol=1e-13)
        for pair, size in (
            ((found.null, found.range_of_transpose), n),
            ((found.range, found.null_of_transpose), m),
        ):
            basis = np.hstack(pair)
            np.testing.assert_allclose(basis.T @ basis, np.eye(size), atol=1e-13)
        v = J @ rng.normal(size=n)
        np.testing.assert_allclose(found.range @ (found.range.T @ v), v, atol=1e-12)


@pytest.mark.equation("3.45", "3.46")
def test_an_arm_becomes_redundant_when_rows_are_dropped() -> None:
    """Three planar links are redundant without their orientation; the anthropomorphic arm is not."""
    J = Configuration(planar_arm(), [0.3, 0.8, -0.5]).jacobian("tip")
    assert subspaces(J[[0, 1, 5]]).redundant_dofs == 0
    assert subspaces(J[:2]).redundant_dofs == 1
    assert (
        subspaces(
            Configuration(Robot.load("anthropomorphic"), [0.1, 0.4, 0.9]).jacobian("tip")[:3]
        ).redundant_dofs
        == 0
    )
    free, rng = subspaces(J[:2]).null, np.random.default_rng(1)
    v = rng.normal(size=2)
    one = np.linalg.pinv(J[:2]) @ v
    for q0 in rng.normal(size=(20, 3)):
        np.testing.assert_allclose(J[:2] @ (one + free @ (free.T @ q0)), v, atol=1e-14)


@pytest.mark.equation("3.54")
def test_an_internal_motion_leaves_the_hand_where_it_is() -> None:
    """Over 1.5 rad the Panda's hand stays to 1e-9, and its elbow goes along an arc."""
    panda = Robot.load("panda", lock=FINGERS)
    start = Configuration(panda, [0.3, -0.7, 0.4, -2.3, -0.8, 1.8, 0.2])
    path = internal_motion(start, "panda_hand", length=1.5, step=0.02)
    assert path.shape == (76, 7)
    np.testing.assert_array_equal(path[0], start.q)
    elbow = []
    for q in path:
        at = Configuration(panda, q)
        np.testing.assert_allclose(at.pose("panda_hand"), start.pose("panda_hand"), atol=1e-9)
        elbow.append(at.pose("panda_link4")[:3, 3])
    assert np.linalg.norm(elbow[-1] - elbow[0]) > 0.15
    assert (np.linalg.norm(np.diff(path, axis=0), axis=1) > 0.015).all()  # it never turns back


def test_the_motion_follows_a_direction() -> None:
    """The opposite direction leads the opposite way; rows that are not held may move."""
    arm = planar_arm()
    start = Configuration(arm, [0.3, 0.8, 0.9])
    there = internal_motion(start, "tip", rows=(0, 1), toward=[1.0, 0.0, 0.0], length=0.3)
    back = internal_motion(start, "tip", rows=(0, 1), toward=[-1.0, 0.0, 0.0], length=0.3)
    assert there[-1, 0] > 0.3 > back[-1, 0]
    at = Configuration(arm, there[-1])
    np.testing.assert_allclose(at.pose("tip")[:3, 3], start.pose("tip")[:3, 3], atol=1e-12)
    assert not np.allclose(at.pose("tip")[:3, :3], start.pose("tip")[:3, :3], atol=1e-3)


def test_what_is_not_redundant_has_no_internal_motion() -> None:
    """Three rows of three joints; a direction that moves the frame; lengths that are not positive."""
    at = Configuration(planar_arm(), [0.3, 0.8, 0.9])
    with pytest.raises(InvalidValue, match="no joint motion leaves 3 rows of 'tip' unchanged"):
        internal_motion(at, "tip", rows=(0, 1, 5))
    with pytest.raises(InvalidValue, match="the direction that is to be followed moves 'tip'"):
        internal_motion(at, "tip", rows=(0, 1), toward=at.jacobian("tip")[0])
    with pytest.raises(InvalidValue, match="length must be"):
        internal_motion(at, "tip", rows=(0, 1), length=0.0)


def test_a_motion_that_ends_says_so() -> None:
    """Stretched out, the arm has first-order internal motions but cannot make them."""
    at = Configuration(planar_arm(), [0.3, 0.0, 0.0])
    with pytest.raises(InvalidValue, match="ends after 0 steps, at a singularity"):
        internal_motion(at, "tip", rows=(0, 1), length=1.0, step=0.2)
