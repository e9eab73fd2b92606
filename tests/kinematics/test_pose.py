"""Logarithm, exponential and their rates against Pinocchio, against differences, and near 0 and π."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.kinematics import pose
from taskopt.kinematics.lie import jlog6_into, log6_into, log6_jlog6_into

ANGLES = [0.0, 1e-12, 1e-9, 1e-7, 1e-4, 1e-2, 0.3, 0.499, 0.501, 1.0, 2.0, 3.0, 3.1]
NEAR_PI = [np.pi - 1e-3, np.pi - 1e-6, np.pi - 1e-9]
SEEDS = st.integers(0, 2**32 - 1)


def twist(angle: float, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    return np.concatenate([rng.normal(size=3), angle * axis / np.linalg.norm(axis)])


@pytest.mark.parametrize("angle", ANGLES + NEAR_PI)
@given(seed=SEEDS)
@settings(deadline=None, max_examples=20)
def test_all_maps_agree_with_pinocchio(angle, seed):
    """log6, jlog6, exp6 and their rotational parts are Pinocchio's to 1e-12."""
    xi = twist(angle, seed)
    M = pin.exp6(xi)
    T = M.homogeneous
    np.testing.assert_allclose(pose.exp6(xi), T, rtol=0, atol=1e-12)
    np.testing.assert_allclose(pose.exp3(xi[3:]), M.rotation, rtol=0, atol=1e-12)
    np.testing.assert_allclose(pose.log6(T), pin.log6(M).vector, rtol=0, atol=2e-12)
    np.testing.assert_allclose(pose.log3(T[:3, :3]), pin.log3(M.rotation), rtol=0, atol=2e-12)
    np.testing.assert_allclose(pose.jlog6(T), pin.Jlog6(M), rtol=0, atol=2e-12)
    np.testing.assert_allclose(pose.jlog3(T[:3, :3]), pin.Jlog3(M.rotation), rtol=0, atol=2e-12)


@pytest.mark.parametrize("angle", ANGLES + NEAR_PI)
@given(seed=SEEDS)
@settings(deadline=None, max_examples=20)
def test_logarithm_inverts_exponential(angle, seed):
    """log6(exp6(ξ)) = ξ for angles below π."""
    xi = twist(angle, seed)
    np.testing.assert_allclose(pose.log6(pose.exp6(xi)), xi, rtol=0, atol=1e-14 * (1.0 + 1e2 * (angle > 3.0)))


@given(seed=SEEDS)
@settings(deadline=None, max_examples=50)
def test_half_a_turn_has_an_axis_that_turns_back_to_it(seed):
    """At θ = π either sign of the axis is right, and mixing signs of its components is not."""
    T = pose.exp6(twist(np.pi, seed))
    np.testing.assert_allclose(pose.exp6(pose.log6(T)), T, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    "axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, -0.8, 0], [0.6, 0, -0.8], [0, 0.6, -0.8]]
)
def test_exact_half_turns_about_special_axes_come_back(axis):
    """R = 2 a aᵀ − I, exactly symmetric, is where the signs of R − Rᵀ say nothing."""
    R = 2.0 * np.outer(axis, axis) - np.eye(3)
    np.testing.assert_allclose(pose.exp3(pose.log3(R)), R, rtol=0, atol=1e-14)


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.4999, 0.5001, 1.3, 3.0])
def test_jlog6_is_the_right_derivative_of_log6(angle):
    """log6(T exp6(δ)) ≈ log6(T) + jlog6(T) δ, against central differences."""
    T, h = pose.exp6(twist(angle, 7)), 1e-5
    numeric = np.column_stack(
        [(pose.log6(T @ pose.exp6(h * e)) - pose.log6(T @ pose.exp6(-h * e))) / (2 * h) for e in np.eye(6)]
    )
    np.testing.assert_allclose(pose.jlog6(T), numeric, rtol=0, atol=2e-8)
    assert np.abs(pose.jlog6(T).T - numeric).max() > 1e-2  # the left Jacobian would be seen


def test_the_kernels_for_loops_write_the_same():
    """log6_jlog6_into fills what log6_into and jlog6_into do."""
    T = pose.exp6(twist(1.1, 3))
    log, jlog, log_alone, jlog_alone = np.empty(6), np.full((6, 6), np.nan), np.empty(6), np.empty((6, 6))
    log6_jlog6_into(T, log, jlog)
    log6_into(T, log_alone)
    jlog6_into(T, jlog_alone)
    np.testing.assert_array_equal(log, log_alone)
    np.testing.assert_array_equal(jlog, jlog_alone)


def test_adjoint_moves_twists_between_frames():
    """exp6(Ad_T ξ) = T exp6(ξ) T⁻¹, and Ad is Pinocchio's action matrix."""
    T, xi = pose.exp6(twist(1.7, 1)), twist(0.8, 2)
    moved = pose.exp6(pose.adjoint(T) @ xi)
    np.testing.assert_allclose(moved, T @ pose.exp6(xi) @ pose.inverse(T), rtol=0, atol=1e-13)
    np.testing.assert_allclose(pose.adjoint(T), pin.SE3(T).action, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (np.diag([1.0, 1.0, -1.0, 1.0]), "not a rotation"),
        (np.diag([1.0, 1.0, 1.001, 1.0]), "not a rotation"),
        (np.eye(4) + np.eye(4)[::-1] * 1e-3, "not a rotation"),
        (np.vstack([np.eye(4)[:3], [0, 0, 0.1, 1]]), "last row"),
        (np.eye(3), "shape 4×4"),
        (np.full((4, 4), np.nan), "NaN"),
    ],
)
def test_what_is_no_pose_is_refused(value, said):
    """A mirror, a stretch, a skewed matrix, a projective row, a wrong shape and NaN each get their words."""
    with pytest.raises(InvalidValue, match=said):
        pose.checked_pose("target", value)


def test_homogeneous_puts_rotation_and_translation_together():
    """[R p; 0 1]."""
    T = pose.exp6(twist(0.9, 5))
    np.testing.assert_array_equal(pose.homogeneous(T[:3, :3], T[:3, 3]), T)
