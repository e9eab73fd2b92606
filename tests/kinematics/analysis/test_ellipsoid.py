"""Ellipsoids of velocity and force and their ratios, as Sect. 3.9 describes them."""

import numpy as np
import pytest

from taskopt import Configuration, ForceRatio, InvalidValue, Robot, VelocityRatio, planar_arm
from taskopt.kinematics.analysis.ellipsoid import (
    force_ellipsoid,
    force_ratio,
    velocity_ellipsoid,
    velocity_ratio,
)
from taskopt.testing import check_objective

FRAMES = {
    "planar3": "tip",
    "panda": "panda_hand",
    "tiago": "arm_tool_link",
    "talos_reduced": "gripper_left_base_link",
}


@pytest.mark.equation("3.122", "3.123")
@pytest.mark.parametrize(("m", "n"), [(2, 2), (2, 3), (3, 7)])
def test_unit_joint_velocities_lie_on_and_in_the_ellipsoid(m: int, n: int) -> None:
    """J†-images of unit vectors satisfy (3.123); with internal motions the point is inside."""
    rng = np.random.default_rng(1)
    J = rng.normal(size=(m, n))
    found, inner = velocity_ellipsoid(J), np.linalg.inv(J @ J.T)
    for y in rng.normal(size=(100, m)):
        v = found.points([y / np.linalg.norm(y)])[0]
        assert v @ inner @ v == pytest.approx(1.0, rel=1e-12)
        assert np.linalg.norm(np.linalg.pinv(J) @ v) == pytest.approx(1.0, rel=1e-12)
    for q_dot in rng.normal(size=(100, n)):
        v = J @ q_dot / np.linalg.norm(q_dot)
        assert v @ inner @ v <= 1.0 + 1e-12
    np.testing.assert_allclose(found.semi_axes, np.sqrt(np.linalg.eigvalsh(J @ J.T))[::-1], rtol=1e-10)


@pytest.mark.equation("3.125", "3.126")
def test_unit_torques_balance_the_points_of_the_force_ellipsoid() -> None:
    """‖Jᵀ γ‖ = 1 on its surface."""
    rng = np.random.default_rng(2)
    J = rng.normal(size=(3, 6))
    for y in rng.normal(size=(100, 3)):
        force = force_ellipsoid(J).points([y / np.linalg.norm(y)])[0]
        assert np.linalg.norm(J.T @ force) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.equation("3.123", "3.126")
@pytest.mark.problem("3.23")
def test_axes_coincide_and_lengths_are_inverse() -> None:
    """Of random Jacobians, and of a singular one, where the velocity is 0 and the force unbounded."""
    rng = np.random.default_rng(3)
    for trial in range(100):
        J = rng.normal(size=(3, 5))
        if trial % 10 == 0:
            J[2] = J[0] - J[1]
        velocity, force = velocity_ellipsoid(J), force_ellipsoid(J)
        np.testing.assert_array_equal(velocity.axes, force.axes)
        if trial % 10:
            np.testing.assert_allclose(velocity.semi_axes * force.semi_axes, 1.0, rtol=1e-12)
        else:
            assert velocity.semi_axes[-1] == pytest.approx(0.0, abs=1e-14)
            assert np.isinf(force.semi_axes[-1])


def test_limits_scale_the_joints() -> None:
    """A joint of twice the limit counts twice in velocity, and its torque limit likewise in force."""
    J, limits = np.random.default_rng(4).normal(size=(2, 3)), np.array([1.0, 2.0, 0.5])
    np.testing.assert_allclose(
        velocity_ellipsoid(J, limits).semi_axes, velocity_ellipsoid(J * limits).semi_axes
    )
    force = force_ellipsoid(J, limits)
    for y in np.eye(2):
        assert np.linalg.norm(J.T @ force.points([y])[0] / limits) == pytest.approx(1.0)
    with pytest.raises(InvalidValue, match="limits must be > 0"):
        velocity_ellipsoid(J, [1.0, 0.0, 1.0])


@pytest.mark.example("3.6")
@pytest.mark.figure("3.23", "3.24", "3.25")
def test_the_two_link_arm_moves_best_at_a_right_angle() -> None:
    """w = a₁ a₂ |s₂|, largest at ±π/2, and for a given reach with a₁ = a₂; σ_min = 0 stretched and folded.

    Stretched out, the velocity ellipse is thin along the arm, and the force ellipse long.
    """
    of, bends = planar_arm((1.0, 1.0)), np.linspace(0.0, np.pi, 181)
    w = [
        np.prod(velocity_ellipsoid(Configuration(of, [0.3, b]).jacobian("tip")[:2]).semi_axes) for b in bends
    ]
    np.testing.assert_allclose(w, np.abs(np.sin(bends)), atol=1e-12)
    assert bends[int(np.argmax(w))] == pytest.approx(np.pi / 2)
    shares = np.linspace(0.1, 1.9, 19)
    best = [
        np.prod(
            velocity_ellipsoid(
                Configuration(planar_arm((a, 2.0 - a)), [0.0, 1.0]).jacobian("tip")[:2]
            ).semi_axes
        )
        for a in shares
    ]
    assert shares[int(np.argmax(best))] == pytest.approx(1.0)
    nearly = Configuration(of, [0.0, 0.05]).jacobian("tip")[:2]
    velocity, force = velocity_ellipsoid(nearly), force_ellipsoid(nearly)
    assert np.abs(velocity.axes[:, 0] @ [0.0, 1.0]) > 0.99
    assert velocity.semi_axes[1] < 0.1 * velocity.semi_axes[0]
    assert force.semi_axes[1] > 10.0 * force.semi_axes[0]


@pytest.mark.equation("3.127", "3.128")
def test_ratios_are_where_the_direction_meets_the_ellipsoids() -> None:
    """α u is on (3.126), β u on (3.123); along a principal axis they are 1/σ and σ, elsewhere αβ ≤ 1."""
    rng = np.random.default_rng(5)
    for _ in range(200):
        J, u = rng.normal(size=(3, 6)), rng.normal(size=3)
        u /= np.linalg.norm(u)
        alpha, beta = force_ratio(J, 2.0 * u), velocity_ratio(J, 0.5 * u)
        assert (alpha * u) @ J @ J.T @ (alpha * u) == pytest.approx(1.0, rel=1e-12)
        assert (beta * u) @ np.linalg.solve(J @ J.T, beta * u) == pytest.approx(1.0, rel=1e-10)
        assert alpha * beta <= 1.0 + 1e-12
        U, sigma, _ = np.linalg.svd(J)
        assert force_ratio(J, U[:, 1]) == pytest.approx(1.0 / sigma[1])
        assert velocity_ratio(J, U[:, 1]) == pytest.approx(sigma[1])


def test_ratios_at_a_singularity() -> None:
    """Along the lost direction no velocity and any force; across it both are finite."""
    J = Configuration(planar_arm((1.0, 1.0)), [0.0, 0.0]).jacobian("tip")[:2]
    assert velocity_ratio(J, [1.0, 0.0]) == 0.0
    assert force_ratio(J, [1.0, 0.0]) == np.inf
    assert velocity_ratio(J, [0.0, 1.0]) == pytest.approx(np.sqrt(5.0))
    assert force_ratio(J, [0.0, 1.0]) == pytest.approx(1.0 / np.sqrt(5.0))


@pytest.mark.equation("3.127", "3.128")
@pytest.mark.parametrize("name", FRAMES)
@pytest.mark.parametrize("ratio", [VelocityRatio, ForceRatio])
def test_ratios_are_objectives(ratio, name: str) -> None:
    """They keep the contract, their value is that of the function, and angular rows work as linear ones."""
    of, frame = Robot.load(name), FRAMES[name]
    plane = ratio(frame, (0.6, 0.8), "xy")
    check_objective(plane, of, count=5, tolerance=1e-4)
    at = Configuration(
        of, of.integrate(of.posture("middle"), np.random.default_rng(6).normal(size=of.nv), 0.5)
    )
    function = velocity_ratio if ratio is VelocityRatio else force_ratio
    assert plane.value(at) == pytest.approx(function(at.jacobian(frame)[:2], [0.6, 0.8]), rel=1e-9)
    if name != "planar3":
        turning = ratio(frame, (0.0, 1.0, 2.0), " rpy")
        check_objective(turning, of, count=5, tolerance=1e-4)
        assert turning.unit == ""
        assert turning.value(at) == pytest.approx(function(at.jacobian(frame)[3:], [0.0, 1.0, 2.0]), rel=1e-9)


@pytest.mark.parametrize("bend", [0.0, 1e-12, 1e-6, 0.1])
def test_climbing_leaves_a_singularity(bend: float) -> None:
    """At and near the stretched arm the gradient of β along the arm is finite and bends the elbow."""
    gradient = VelocityRatio("tip", (1.0, 0.0), "xy").gradient(
        Configuration(planar_arm((1.0, 1.0)), [0.0, bend])
    )
    assert np.isfinite(gradient).all()
    assert abs(gradient[1]) > 0.1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("tip", (1.0, 0.0)), "direction must have shape 3, got 2"),
        (("tip", (0.0, 0.0), "xy"), "direction must not be zero"),
        (("tip", (1.0, 0.0), "x y"), "axes must be of one unit"),
    ],
)
def test_ratios_that_make_no_sense_are_refused(arguments, said: str) -> None:
    """A direction that does not fit, none at all, metres beside radians."""
    with pytest.raises(InvalidValue, match=said):
        VelocityRatio(*arguments)
