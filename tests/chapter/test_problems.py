"""The problems of the chapter that no other test solves: each statement at random and degenerate points."""

import numpy as np
import pytest

from taskopt import (
    Circle,
    Configuration,
    Controller,
    PositionTask,
    Robot,
    Sphere,
    Stack,
    WithoutRate,
    planar_arm,
)
from taskopt.kinematics.objective import ObstacleDistance
from taskopt.kinematics.orientation import (
    XYZ,
    ZYZ,
    EulerAngles,
    angle_axis_error,
    error_rate_matrix,
    quaternion,
    quaternion_error,
    quaternion_rate,
    skew,
    unskew,
)
from taskopt.kinematics.orientation.quaternion import angular_velocity_of, rotation_of
from taskopt.kinematics.pose import exp3
from taskopt.resolver import closed_form

POINTS = 300
COUNTS = pytest.mark.parametrize("count", [POINTS, pytest.param(10_000, marks=pytest.mark.slow)])


def rotations(count: int, seed: int) -> np.ndarray:
    """Random rotations, and those by 0 and π about the axes (count + 4, 3, 3)."""
    Q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(count, 3, 3)))
    Q[np.linalg.det(Q) < 0.0, :, 0] *= -1.0
    return np.concatenate([Q, [np.eye(3)], [2.0 * np.outer(v, v) - np.eye(3) for v in np.eye(3)]])


@pytest.mark.problem("3.1")
@pytest.mark.equation("3.11")
def test_problem_3_1() -> None:
    """R S(ω) Rᵀ = S(R ω)."""
    rng = np.random.default_rng(1)
    for R in rotations(POINTS, 1):
        for omega in (rng.normal(size=3), np.zeros(3)):
            np.testing.assert_allclose(R @ skew(omega) @ R.T, skew(R @ omega), atol=1e-13)


@pytest.mark.problem("3.9")
@pytest.mark.equation("3.58")
def test_problem_3_9() -> None:
    """The distance of a planar arm from a circle is the least of those of its links, less both radii."""
    rng, radius = np.random.default_rng(2), 0.01
    arm = planar_arm((0.5, 0.3, 0.3), radius=radius)
    for _ in range(50):
        q, centre = rng.uniform(-3.0, 3.0, size=3), np.array([*rng.uniform(-1.0, 1.0, size=2), 0.0])
        angles = np.cumsum(q)
        ends = np.cumsum(
            np.array([0.5, 0.3, 0.3])[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]), axis=0
        )
        least = np.inf
        for begin, end in zip([np.zeros(2), *ends[:-1]], ends, strict=True):
            share = np.clip((centre[:2] - begin) @ (end - begin) / ((end - begin) @ (end - begin)), 0.0, 1.0)
            least = min(least, float(np.linalg.norm(begin + share * (end - begin) - centre[:2])))
        objective = ObstacleDistance([Sphere(centre, 0.1)], temperature=1e-6)
        assert objective.value(Configuration(arm, q)) == pytest.approx(least - 0.1 - radius, abs=2e-5)


@pytest.mark.problem("3.10")
@pytest.mark.equation("3.59")
def test_problem_3_10() -> None:
    """Jᵀ(J Jᵀ + k² I)⁻¹ v minimises ½‖v − J q̇‖² + ½ k² ‖q̇‖²: the gradient is zero, at any rank of J."""
    rng = np.random.default_rng(3)
    for trial in range(200):
        J, v, k = rng.normal(size=(3, 5)), rng.normal(size=3), rng.uniform(0.01, 2.0)
        if trial % 5 == 0:
            J[2] = J[0] + J[1]
        q_dot = closed_form.damped_inverse(J, k) @ v
        np.testing.assert_allclose(J.T @ (J @ q_dot - v) + k**2 * q_dot, 0.0, atol=1e-11)
        np.testing.assert_allclose(q_dot, J.T @ np.linalg.solve(J @ J.T + k**2 * np.eye(3), v), atol=1e-9)


@pytest.mark.problem("3.11")
@pytest.mark.equation("3.64")
def test_problem_3_11() -> None:
    """S(ω) = Ṙ(φ) Rᵀ with the entries of (2.18) differentiated by hand gives ω = T(φ) φ̇."""
    rng = np.random.default_rng(4)
    for (f, t, p), rates in zip(
        rng.uniform(-3.0, 3.0, size=(POINTS, 3)), rng.normal(size=(POINTS, 3)), strict=True
    ):

        def about(axis: int, angle: float, by: int = 0) -> np.ndarray:
            c, s = np.cos(angle + by * np.pi / 2), np.sin(angle + by * np.pi / 2)
            out = np.zeros((3, 3))
            i, j = [(1, 2), (2, 0), (0, 1)][axis]
            out[i, i] = out[j, j] = c
            out[j, i], out[i, j] = s, -s
            out[axis, axis] = 1.0 - by
            return out

        R = about(2, f) @ about(1, t) @ about(2, p)
        R_dot = (
            rates[0] * about(2, f, 1) @ about(1, t) @ about(2, p)
            + rates[1] * about(2, f) @ about(1, t, 1) @ about(2, p)
            + rates[2] * about(2, f) @ about(1, t) @ about(2, p, 1)
        )
        np.testing.assert_allclose(R, ZYZ.rotation([f, t, p]), atol=1e-14)
        np.testing.assert_allclose(unskew(R_dot @ R.T), ZYZ.rate_map([f, t, p]) @ rates, atol=1e-13)


@pytest.mark.problem("3.13")
@pytest.mark.equation("3.64")
def test_problem_3_13() -> None:
    """T(0) = I for the angles about x, y and z of the current frame, and for no other set of twelve."""
    np.testing.assert_array_equal(XYZ.rate_map([0.0, 0.0, 0.0]), np.eye(3))
    sets = [a + b + c for a in "XYZ" for b in "XYZ" for c in "XYZ" if b not in (a, c)]
    assert len(sets) == 12
    others = [name for name in sets if np.array_equal(EulerAngles(name).rate_map([0.0] * 3), np.eye(3))]
    assert others == ["XYZ"]


@pytest.mark.slow
@pytest.mark.problem("3.14")
@pytest.mark.equation("3.70", "3.82")
def test_problem_3_14() -> None:
    """With a spherical wrist the arm alone solves the position, and the wrist angles are ZYZ of R_Wᵀ R_d.

    Three joints are inverted instead of six, and no error is fed back for the orientation, which is exact at
    every tick.
    """
    arm, wrist_length, dt = Robot.load("anthropomorphic_with_wrist"), 0.1, 1e-3
    q = np.array([0.3, 0.4, 2.8, 0.2, 1.1, -0.3])
    start = Configuration(arm, q).pose("tip")

    def desired(t: float) -> np.ndarray:
        pose = start.copy()
        pose[:3, :3] = exp3(np.array([0.3, -0.2, 0.5]) * t) @ start[:3, :3]
        pose[:3, 3] += 0.03 * np.array([np.sin(t), 1.0 - np.cos(t), -t])
        return pose

    for tick in range(1000):
        goal, later = desired(tick * dt), desired((tick + 1) * dt)
        centre = goal[:3, 3] - wrist_length * goal[:3, 2]
        rate = (later[:3, 3] - wrist_length * later[:3, 2] - centre) / dt
        at = Configuration(arm, q)
        J = at.jacobian("link5")[:3, :3]  # the wrist centre
        q[:3] += dt * np.linalg.solve(J, rate + 500.0 * (centre - at.pose("link5")[:3, 3]))
        R_W = Configuration(arm, q).pose("link3")[:3, :3]
        q[3:] = ZYZ.angles(R_W.T @ later[:3, :3], near=q[3:])
        pose = Configuration(arm, q).pose("tip")
        np.testing.assert_allclose(pose[:3, :3], later[:3, :3], atol=1e-13)
        np.testing.assert_allclose(pose[:3, 3], later[:3, 3], atol=1e-5)


@pytest.mark.slow
@pytest.mark.problem("3.15")
@pytest.mark.equation("3.76", "3.77")
def test_problem_3_15() -> None:
    """With K = k I and e(0) = 0, ‖e‖ ≤ ‖ẋ_d‖_max/(k σ_min²), since V̇ < 0 beyond it; more k, less error."""
    arm, dt, q0 = planar_arm((0.5, 0.5)), 1e-3, np.array([0.4, 1.2])
    circle = Circle(radius=0.1, period=1.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2)
    speed, largest = 2.0 * np.pi * 0.1, []
    for gain in (20.0, 100.0, 500.0):
        stack = Stack([[PositionTask("tip", target=WithoutRate(circle), gain=gain, axes="xy")]], damping=None)
        control, q, errors, sigmas = Controller(arm, stack, "transpose", dt), q0.copy(), [], []
        centre = Configuration(arm, q0).pose("tip")[:2, 3] + [0.1, 0.0]
        for tick in range(2000):
            at, t = Configuration(arm, q), tick * dt
            goal = centre + 0.1 * np.array([-np.cos(2.0 * np.pi * t), np.sin(2.0 * np.pi * t)])
            errors.append(float(np.linalg.norm(goal - at.pose("tip")[:2, 3])))
            sigmas.append(np.linalg.svd(at.jacobian("tip")[:2], compute_uv=False)[-1])
            q = arm.integrate(q, control.step(q, t).v, dt)
        assert max(errors) <= speed / (gain * min(sigmas) ** 2) * (1.0 + 20.0 * dt)
        largest.append(max(errors))
    assert largest == sorted(largest, reverse=True)


@COUNTS
@pytest.mark.problem("3.16")
@pytest.mark.equation("3.83", "3.85")
def test_problem_3_16(count: int) -> None:
    """½ (n_e × n_d + s_e × s_d + a_e × a_d) is r sin ϑ, the off-diagonal terms of R_d R_eᵀ."""
    pairs = rotations(count, 5)
    for R_e, R_d in zip(pairs, pairs[::-1], strict=True):
        left = R_d @ R_e.T
        off = 0.5 * np.array([left[2, 1] - left[1, 2], left[0, 2] - left[2, 0], left[1, 0] - left[0, 1]])
        np.testing.assert_allclose(angle_axis_error(R_e, R_d), off, atol=1e-14)


@COUNTS
@pytest.mark.problem("3.17")
@pytest.mark.equation("3.86", "3.87")
def test_problem_3_17(count: int) -> None:
    """ė_O = Lᵀ ω_d − L ω_e with ė from the derivative of each product, ṅ = ω × n."""
    pairs, rng = rotations(count, 6), np.random.default_rng(6)
    for R_e, R_d in zip(pairs, pairs[::-1], strict=True):
        w_e, w_d = rng.normal(size=(2, 3))
        rate = 0.5 * sum(
            np.cross(np.cross(w_e, R_e[:, k]), R_d[:, k]) + np.cross(R_e[:, k], np.cross(w_d, R_d[:, k]))
            for k in range(3)
        )
        L = error_rate_matrix(R_e, R_d)
        np.testing.assert_allclose(L.T @ w_d - L @ w_e, rate, atol=1e-13)


@COUNTS
@pytest.mark.problem("3.18", "3.19")
@pytest.mark.equation("3.94", "3.95")
def test_problems_3_18_and_3_19(count: int) -> None:
    """ω = 2 S(ε) ε̇ + 2 η ε̇ − 2 η̇ ε, and (3.94), (3.95): each the inverse of the other, and of Ṙ = S(ω) R."""
    rng = np.random.default_rng(7)
    for R in rotations(count, 7):
        Q, omega = quaternion(R), rng.normal(size=3)
        rate = quaternion_rate(Q, omega)
        assert Q @ rate == pytest.approx(0.0, abs=1e-15)  # ‖Q‖ stays 1
        np.testing.assert_allclose(angular_velocity_of(Q, rate), omega, atol=1e-13)
        eta, epsilon, (eta_dot, *epsilon_dot) = Q[0], Q[1:], rate
        R_dot = 4.0 * eta * eta_dot * np.eye(3) + 2.0 * (
            np.outer(epsilon_dot, epsilon)
            + np.outer(epsilon, epsilon_dot)
            + eta_dot * skew(epsilon)
            + eta * skew(epsilon_dot)
        )
        np.testing.assert_allclose(R_dot, skew(omega) @ rotation_of(Q), atol=1e-13)


@COUNTS
@pytest.mark.problem("3.20")
@pytest.mark.equation("3.96", "3.97")
def test_problem_3_20(count: int) -> None:
    """V̇ = −e_Oᵀ K_O e_O for (3.96) along (3.93), with both rates by quaternion propagation."""
    pairs, rng = rotations(count, 8), np.random.default_rng(8)
    for R_e, R_d in zip(pairs, pairs[::-1], strict=True):
        Q_e, Q_d = quaternion(R_e), quaternion(R_d)
        Q_d = Q_d if Q_d @ Q_e >= 0.0 else -Q_d
        K, w_d, e = np.diag(rng.uniform(0.5, 3.0, size=3)), rng.normal(size=3), quaternion_error(R_e, R_d)
        w_e = w_d + K @ e
        slope = 2.0 * (Q_d - Q_e) @ (quaternion_rate(Q_d, w_d) - quaternion_rate(Q_e, w_e))
        assert slope == pytest.approx(-e @ K @ e, abs=1e-12)
