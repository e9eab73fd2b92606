"""S(·), Euler angles, angle and axis, quaternions: the formulas of the chapter, and derivatives."""

import numpy as np
import pytest

from taskopt import InvalidValue
from taskopt.kinematics.orientation import (
    RPY,
    XYZ,
    ZYZ,
    EulerAngles,
    angle_axis,
    angle_axis_error,
    error_rate_matrix,
    quaternion,
    quaternion_error,
    quaternion_product,
    quaternion_rate,
    skew,
    unskew,
)
from taskopt.kinematics.orientation.quaternion import angular_velocity_of, quaternion_distance, rotation_of

POINTS = 1000
COUNTS = pytest.mark.parametrize("count", [200, pytest.param(10_000, marks=pytest.mark.slow)])
STEP = 1e-6  # [rad] of central differences: truncation 1e-12, rounding 1e-10
SETS = (ZYZ, RPY, XYZ, EulerAngles("YXY"), EulerAngles("XZY"))


def random_rotations(count: int, seed: int) -> np.ndarray:
    """Rotations (count, 3, 3), uniform, by QR factors of normal matrices."""
    Q, R = np.linalg.qr(np.random.default_rng(seed).normal(size=(count, 3, 3)))
    Q = Q * np.sign(np.diagonal(R, axis1=1, axis2=2))[:, None, :]
    Q[np.linalg.det(Q) < 0.0, :, 0] *= -1.0
    return Q


def turned(R: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """R after a rotation by the vector ω [rad] in the world, by the series of the exponential."""
    S = np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    term, out = np.eye(3), np.eye(3)
    for k in range(1, 25):
        term = term @ S / k
        out = out + term
    return out @ R


@pytest.mark.equation("3.7", "3.9", "3.14", "3.15")
def test_skew_is_the_vector_product() -> None:
    """S(a) b = a × b, S + Sᵀ = 0, and S(a) has the entries of (3.9)."""
    rng = np.random.default_rng(0)
    for a, b in rng.normal(size=(POINTS // 2, 2, 3)):
        S = skew(a)
        assert (S + S.T == 0.0).all()
        assert [S[2, 1], S[0, 2], S[1, 0]] == a.tolist()
        np.testing.assert_allclose(S @ b, np.cross(a, b), atol=1e-14)
        np.testing.assert_allclose(unskew(S + np.outer(b, b)), a, atol=1e-14)


@pytest.mark.equation("3.6", "3.8", "3.10", "3.12", "3.13")
def test_the_derivative_of_a_rotation_is_s_of_omega() -> None:
    """Ṙ Rᵀ = S(ω), and p = o + R p¹ moves with ȯ + R ṗ¹ + ω × R p¹."""
    rng = np.random.default_rng(1)
    for R in random_rotations(200, 1):
        omega, p, p_dot, o_dot = rng.normal(size=(4, 3))
        after, before = turned(R, STEP * omega), turned(R, -STEP * omega)
        R_dot = (after - before) / (2.0 * STEP)
        np.testing.assert_allclose(R_dot, skew(omega) @ R, atol=2e-9)
        np.testing.assert_allclose(unskew(R_dot @ R.T), omega, atol=2e-9)
        ends = [sign * STEP * o_dot + M @ (p + sign * STEP * p_dot) for M, sign in ((after, 1), (before, -1))]
        velocity = (ends[0] - ends[1]) / (2.0 * STEP)
        np.testing.assert_allclose(velocity, o_dot + R @ p_dot + np.cross(omega, R @ p), atol=2e-9)


def test_the_vector_product_needs_three_numbers() -> None:
    """Another shape is named."""
    with pytest.raises(InvalidValue, match="vector must have shape 3, got 2"):
        skew([1.0, 2.0])


@pytest.mark.parametrize("angles", SETS, ids=lambda angles: angles.name)
def test_angles_and_rotations_are_inverse(angles: EulerAngles) -> None:
    """R(φ(R)) = R at random rotations and at the representation singularity, ϑ in its principal range."""
    proper = angles.axes[0] == angles.axes[2]
    singular = [0.0, np.pi] if proper else [np.pi / 2, -np.pi / 2]
    lowest, highest = (0.0, np.pi) if proper else (-np.pi / 2, np.pi / 2)
    free = np.random.default_rng(2).normal(size=(20, 2))
    degenerate = [angles.rotation([phi, theta, psi]) for theta in singular for phi, psi in free]
    for R in [*random_rotations(POINTS // 2, 2), *degenerate]:
        phi = angles.angles(R)
        np.testing.assert_allclose(angles.rotation(phi), R, atol=1e-14)
        assert lowest <= phi[1] <= highest
        assert (np.abs(phi) <= np.pi).all()


def test_rotations_of_the_two_sets_of_the_chapter() -> None:
    """ZYZ is Rz Ry Rz, and RPY turns about the fixed x, then y, then z."""
    a, b, c = 0.3, 0.7, -1.1

    def about(axis: int, t: float) -> np.ndarray:
        return turned(np.eye(3), t * np.eye(3)[axis])

    np.testing.assert_allclose(ZYZ.rotation([a, b, c]), about(2, a) @ about(1, b) @ about(2, c), atol=1e-15)
    np.testing.assert_allclose(RPY.rotation([a, b, c]), about(2, a) @ about(1, b) @ about(0, c), atol=1e-15)


@pytest.mark.parametrize("angles", SETS, ids=lambda angles: angles.name)
def test_angles_follow_a_path_without_jumps(angles: EulerAngles) -> None:
    """With `near`, angles along a path through several turns and both ranges of ϑ change by small steps."""
    t = np.linspace(0.0, 12.0, 2000)
    path = np.column_stack([t, 0.8 * np.sin(0.7 * t) + 4.0, -1.3 * t])
    found = path[0]
    for phi in path:
        found = angles.angles(angles.rotation(phi), near=found)
        np.testing.assert_allclose(found, phi, atol=1e-8)


@pytest.mark.parametrize("angles", SETS, ids=lambda angles: angles.name)
def test_the_free_angle_at_a_singularity_is_the_one_before(angles: EulerAngles) -> None:
    """There only φ ± ψ is determined; φ stays."""
    theta = 0.0 if angles.axes[0] == angles.axes[2] else np.pi / 2
    R = angles.rotation([0.4, theta, 0.9])
    found = angles.angles(R, near=[0.7, theta, 0.0])
    assert found[0] == 0.7
    np.testing.assert_allclose(angles.rotation(found), R, atol=1e-15)


@pytest.mark.figure("3.8", "3.9")
@COUNTS
@pytest.mark.equation("3.64")
@pytest.mark.problem("3.12")
def test_the_rate_map_is_the_one_of_the_text(count: int) -> None:
    """T of ZYZ as printed below (3.64), T of RPY as Problem 3.12 asks, and their determinants."""
    rng = np.random.default_rng(3)
    for f, t, p in rng.uniform(-np.pi, np.pi, size=(count, 3)):
        sf, cf, st, ct = np.sin(f), np.cos(f), np.sin(t), np.cos(t)
        text = np.array([[0.0, -sf, cf * st], [0.0, cf, sf * st], [1.0, 0.0, ct]])
        assert np.abs(ZYZ.rate_map([f, t, p]) - text).max() < 1e-12
        assert abs(ZYZ.determinant([f, t, p]) + st) < 1e-12
        rpy = np.array([[0.0, -sf, cf * ct], [0.0, cf, sf * ct], [1.0, 0.0, -st]])
        assert np.abs(RPY.rate_map([f, t, p]) - rpy).max() < 1e-12
        assert abs(RPY.determinant([f, t, p]) + ct) < 1e-12


@pytest.mark.equation("3.61", "3.64")
@pytest.mark.parametrize("angles", SETS, ids=lambda angles: angles.name)
def test_the_rate_map_is_the_derivative_of_the_rotation(angles: EulerAngles) -> None:
    """Ṙ(φ) R(φ)ᵀ = S(T φ̇), its determinant is `determinant`, and Ṫ is its derivative."""
    rng = np.random.default_rng(4)
    for phi, dot in rng.uniform(-3.0, 3.0, size=(300, 2, 3)):
        ahead, behind = (angles.rotation(phi + sign * STEP * dot) for sign in (1.0, -1.0))
        omega = unskew((ahead - behind) / (2.0 * STEP) @ angles.rotation(phi).T)
        np.testing.assert_allclose(angles.rate_map(phi) @ dot, omega, atol=2e-9)
        assert angles.determinant(phi) == pytest.approx(np.linalg.det(angles.rate_map(phi)), abs=1e-14)
        difference = (angles.rate_map(phi + STEP * dot) - angles.rate_map(phi - STEP * dot)) / (2.0 * STEP)
        np.testing.assert_allclose(angles.rate_map_rate(phi, dot), difference, atol=2e-9)
        if abs(angles.determinant(phi)) > 0.01:
            np.testing.assert_allclose(angles.rates(phi, omega), dot, atol=1e-6)


@pytest.mark.equation("3.64")
def test_a_representation_singularity_is_named() -> None:
    """Where sin ϑ = 0, no rates of ZYZ express a rotation across the plane of their axes."""
    T = ZYZ.rate_map([0.3, 0.0, 0.2])
    assert np.linalg.matrix_rank(T, tol=1e-12) == 2
    with pytest.raises(
        InvalidValue, match=r"ZYZ angles .* representation singularity, sin ϑ = 0; use another"
    ):
        ZYZ.rates([0.3, 0.0, 0.2], [1.0, 0.0, 0.0])
    with pytest.raises(InvalidValue, match=r"RPY angles .* cos ϑ = 0"):
        RPY.rates([0.3, np.pi / 2, 0.2], np.eye(3))


@pytest.mark.parametrize("axes", ["ZZY", "zyz", "XY", "XYYZ", "ABC"])
def test_axes_that_are_no_euler_angles_are_refused(axes: str) -> None:
    """Two neighbours alike, other letters, another number of them."""
    with pytest.raises(InvalidValue, match="three letters of XYZ"):
        EulerAngles(axes)


@COUNTS
@pytest.mark.equation("3.83", "3.84", "3.85")
def test_the_error_is_the_axis_times_the_sine(count: int) -> None:
    """½ Σ n_e × n_d = r sin ϑ for R_d = R(ϑ, r) R_e, at any angle, and ϑ and r are found again."""
    rng = np.random.default_rng(5)
    for R_e in random_rotations(count, 5):
        r, theta = rng.normal(size=3), rng.uniform(0.01, 3.1)
        r /= np.linalg.norm(r)
        R_d = turned(R_e, theta * r)
        np.testing.assert_allclose(angle_axis_error(R_e, R_d), r * np.sin(theta), atol=1e-13)
        angle, axis = angle_axis(R_d @ R_e.T)
        assert angle == pytest.approx(theta, abs=1e-12)
        np.testing.assert_allclose(axis, r, atol=1e-11)


@pytest.mark.equation("3.84")
def test_no_rotation_has_an_axis_all_the_same() -> None:
    """ϑ = 0 has the first axis, and ϑ = π one of the two."""
    assert angle_axis(np.eye(3))[0] == 0.0
    np.testing.assert_array_equal(angle_axis(np.eye(3))[1], [1.0, 0.0, 0.0])
    angle, axis = angle_axis(np.diag([-1.0, 1.0, -1.0]))
    assert angle == pytest.approx(np.pi)
    np.testing.assert_allclose(np.abs(axis), [0.0, 1.0, 0.0], atol=1e-15)


@COUNTS
@pytest.mark.equation("3.86", "3.87")
def test_the_matrix_l_gives_the_rate_of_the_error(count: int) -> None:
    """ė_O = Lᵀ ω_d − L ω_e by differences; L = I where the frames agree; det L = ½ cos ϑ (1 + cos ϑ)."""
    rng = np.random.default_rng(6)
    rotations = random_rotations(2 * count, 6)
    for R_e, R_d in zip(rotations[::2], rotations[1::2], strict=True):
        w_e, w_d = rng.normal(size=(2, 3))
        ahead, behind = (
            angle_axis_error(turned(R_e, s * STEP * w_e), turned(R_d, s * STEP * w_d)) for s in (1.0, -1.0)
        )
        L = error_rate_matrix(R_e, R_d)
        np.testing.assert_allclose(L.T @ w_d - L @ w_e, (ahead - behind) / (2.0 * STEP), atol=2e-9)
        cosine = np.cos(angle_axis(R_d @ R_e.T)[0])
        assert np.linalg.det(L) == pytest.approx(0.5 * cosine * (1.0 + cosine), abs=1e-12)
        np.testing.assert_allclose(error_rate_matrix(R_e, R_e), np.eye(3), atol=1e-14)


def test_quaternions_and_rotations_are_inverse() -> None:
    """R(Q(R)) = R, ‖Q‖ = 1 and η ≥ 0, rotations by π included; Q of the product is the product."""
    half_turns = [2.0 * np.outer(v, v) - np.eye(3) for v in np.eye(3)]
    rotations = [np.eye(3), *half_turns, *random_rotations(POINTS // 2, 7)]
    for R in rotations:
        Q = quaternion(R)
        assert np.linalg.norm(Q) == pytest.approx(1.0, abs=1e-15)
        assert Q[0] >= 0.0
        np.testing.assert_allclose(rotation_of(Q), R, atol=1e-14)
    for first, second in zip(rotations[4:204], rotations[204:404], strict=True):
        product = quaternion_product(quaternion(first), quaternion(second))
        np.testing.assert_allclose(rotation_of(product), first @ second, atol=1e-14)


@COUNTS
@pytest.mark.equation("3.90", "3.91")
def test_the_quaternion_error_is_the_sine_of_half_the_angle(count: int) -> None:
    """Δε = r sin(ϑ/2), the vector part of Q_d * Q_e⁻¹, on the short way round."""
    rng = np.random.default_rng(8)
    for R_e in random_rotations(count, 8):
        r, theta = rng.normal(size=3), rng.uniform(0.0, 3.1)
        r /= np.linalg.norm(r)
        R_d = turned(R_e, theta * r)
        error = quaternion_error(R_e, R_d)
        np.testing.assert_allclose(error, r * np.sin(0.5 * theta), atol=1e-13)
        inverse = quaternion(R_e) * [1.0, -1.0, -1.0, -1.0]
        product = quaternion_product(quaternion(R_d), inverse)
        np.testing.assert_allclose(np.sign(product[0]) * product[1:], error, atol=1e-13)


@COUNTS
@pytest.mark.equation("3.94", "3.95")
def test_the_quaternion_propagates(count: int) -> None:
    """Q̇ by central differences of the rotation at random points; ω is found again from Q̇."""
    rng = np.random.default_rng(9)
    for R in random_rotations(count, 9):
        Q, omega = quaternion(R), rng.normal(size=3)
        rate = quaternion_rate(Q, omega)
        near = [quaternion(turned(R, sign * STEP * omega)) for sign in (1.0, -1.0)]
        near = [sample * np.sign(sample @ Q) for sample in near]
        np.testing.assert_allclose(rate, (near[0] - near[1]) / (2.0 * STEP), atol=2e-9)
        np.testing.assert_allclose(angular_velocity_of(Q, rate), omega, atol=1e-12)


@COUNTS
@pytest.mark.equation("3.93", "3.96", "3.97")
def test_the_lyapunov_function_falls_as_the_text_says(count: int) -> None:
    """Along ω_d − ω_e + K e_O = 0, V̇ = −e_Oᵀ K e_O, by central differences; V = 2 − 2 cos(ϑ/2)."""
    rng = np.random.default_rng(10)
    rotations = random_rotations(2 * count, 10)
    rotations = [
        (a, b) for a, b in zip(rotations[::2], rotations[1::2], strict=True) if np.trace(b @ a.T) > -0.9
    ]
    assert (
        len(rotations) > 0.6 * count
    )  # left out are pairs near a half turn, where the nearer of Q and −Q changes
    for R_e, R_d in rotations:
        K, w_d = np.diag(rng.uniform(0.5, 3.0, size=3)), rng.normal(size=3)
        error = quaternion_error(R_e, R_d)
        w_e = w_d + K @ error
        values = [
            quaternion_distance(turned(R_e, sign * STEP * w_e), turned(R_d, sign * STEP * w_d))
            for sign in (1.0, -1.0)
        ]
        assert (values[0] - values[1]) / (2.0 * STEP) == pytest.approx(-error @ K @ error, abs=2e-9)
        angle, _ = angle_axis(R_d @ R_e.T)
        assert quaternion_distance(R_e, R_d) == pytest.approx(2.0 - 2.0 * np.cos(0.5 * angle), abs=1e-12)
