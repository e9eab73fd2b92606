"""Orientation errors of the chapter as tasks: their rows, and where they lead at 90°, 180° and beyond."""

import numpy as np
import pytest

from taskopt import (
    RPY,
    ZYZ,
    AngleAxisTask,
    Configuration,
    Controller,
    EulerTask,
    Function,
    InvalidValue,
    OrientationTask,
    PositionTask,
    QuaternionTask,
    Robot,
    Stack,
    UnknownName,
)
from taskopt.kinematics.pose import exp3, log3
from taskopt.testing import check_task

DT, GAIN = 5e-3, 5.0  # [s], [1/s]
KINDS = {
    "zyz": lambda **of: EulerTask("tip", angles=ZYZ, **of),
    "rpy": lambda **of: EulerTask("tip", angles=RPY, **of),
    "angle and axis": lambda **of: AngleAxisTask("tip", **of),
    "quaternion": lambda **of: QuaternionTask("tip", **of),
    "logarithm": lambda **of: OrientationTask("tip", expressed="world", **of),
}
WRIST = Robot.load("spherical_wrist")
ARM = Robot.load("anthropomorphic_with_wrist")


def rows_of(task, at: Configuration, t: float = 0.0):
    """The rows A and b of a task at a configuration, by the plan of a stack."""
    hierarchy = Stack([[task]]).at(at, dt=DT, t=t)
    return hierarchy.A, hierarchy.lower


def angles_on_the_way(kind: str, start: np.ndarray, goal: np.ndarray, seconds: float = 4.0) -> list[float]:
    """Angles ϑ [rad] between the arm's tip and a still goal (3, 3), at every tick."""
    task = KINDS[kind](target=goal, gain=GAIN)
    control, q, angles = Controller(ARM, Stack([[task]]), "active-set", DT), start.copy(), []
    for tick in range(round(seconds / DT)):
        R = Configuration(ARM, q).pose("tip")[:3, :3]
        angles.append(float(np.linalg.norm(log3(goal @ R.T))))
        q = ARM.integrate(q, control.step(q, tick * DT).v, DT)
    return angles


@pytest.mark.equation("3.67", "3.68", "3.69", "3.80", "3.81", "3.86", "3.88")
@pytest.mark.parametrize("kind", ["zyz", "rpy", "angle and axis"])
@pytest.mark.parametrize("name", ["anthropomorphic_with_wrist", "seven_joint_arm"])
def test_rows_are_the_derivative_of_the_error(kind: str, name: str) -> None:
    """ė = ẋ_d − A v by central differences, for a target that turns, up to 60° away from it."""
    of, rng, h = Robot.load(name), np.random.default_rng(2), 1e-6
    for _ in range(20):
        q, v, w = rng.uniform(0.4, 1.2, size=of.nv), rng.normal(size=of.nv), rng.normal(size=3)
        R_d = exp3(0.35 * rng.normal(size=3)) @ Configuration(of, q).pose("tip")[:3, :3]
        target = Function(lambda t, R_d=R_d, w=w: exp3(t * w) @ R_d, lambda t, w=w: w)
        plan = Stack([[KINDS[kind](target=target, gain=GAIN)]]).compile(of, DT)
        plan.start(q, 0.0)

        def rows(s: float, plan=plan, q=q, v=v) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            hierarchy = plan.at(of.integrate(q, v, s), s)
            return plan.tasks[0].error.copy(), hierarchy.A.copy(), hierarchy.lower.copy()

        numeric = (rows(h)[0] - rows(-h)[0]) / (2.0 * h)
        error, A, b = rows(0.0)
        np.testing.assert_allclose(
            b - GAIN * error - A @ v, numeric, atol=1e-6 * max(1.0, np.abs(A).max() ** 3)
        )


@pytest.mark.parametrize("kind", [*KINDS])
def test_the_contract_of_a_task_is_kept(kind: str) -> None:
    """Names, units, repeatability; rows are derivatives for RPY angles and the logarithm at any posture.

    For the others the rows at random postures are no derivatives: the quaternion's never are, angle and axis
    have other rows from 80° on, and ZYZ angles of this arm come near their singularity, where differences
    are coarse. Their rows are compared above, and with the text below.
    """
    exact = kind in ("rpy", "logarithm")
    check_task(KINDS[kind](), ARM, count=4, tolerance=1e-6 if exact else 1e9)


@pytest.mark.slow
@pytest.mark.equation("3.82", "3.89", "3.92")
@pytest.mark.parametrize("kind", KINDS)
def test_the_velocity_is_that_of_the_text(kind: str) -> None:
    """q̇ of (3.82), (3.89), (3.92), written out, for a moving target, at 50 random postures."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        at = Configuration(ARM, rng.uniform(-1.5, 1.5, size=6) + [0.0, 0.5, 1.5, 0.0, 1.5, 0.0])
        pose, J = at.pose("tip"), at.jacobian("tip")
        p_d, omega, p_rate = pose[:3, 3] + 0.1 * rng.normal(size=3), rng.normal(size=3), rng.normal(size=3)
        R_e, R_d = pose[:3, :3], exp3(0.4 * rng.normal(size=3)) @ pose[:3, :3]
        turning = Function(lambda t, R_d=R_d, w=omega: exp3(t * w) @ R_d, lambda t, w=omega: w)
        moving = Function(lambda t, p=p_d, v=p_rate: p + t * v, lambda t, v=p_rate: v)
        stack = Stack(
            [[PositionTask("tip", target=moving, gain=GAIN), KINDS[kind](target=turning, gain=GAIN)]]
        )
        hierarchy = stack.at(at, dt=DT)
        found = np.linalg.solve(hierarchy.A, hierarchy.lower)
        linear = p_rate + GAIN * (p_d - pose[:3, 3])
        n, s, a = R_e.T
        n_d, s_d, a_d = R_d.T
        if kind == "angle and axis":
            e = 0.5 * (np.cross(n, n_d) + np.cross(s, s_d) + np.cross(a, a_d))
            L = -0.5 * sum(cross(y) @ cross(x) for x, y in ((n, n_d), (s, s_d), (a, a_d)))
            angular = np.linalg.solve(L, L.T @ omega + GAIN * e)
        elif kind == "quaternion":
            vector = log3(R_d @ R_e.T)
            theta = np.linalg.norm(vector)
            angular = omega + GAIN * np.sin(0.5 * theta) * vector / theta
        elif kind == "logarithm":
            continue  # its own tests compare it with differences
        else:
            angles = ZYZ if kind == "zyz" else RPY
            phi = angles.angles(R_e)
            phi_d = angles.angles(R_d, near=phi)
            rate = np.linalg.solve(angles.rate_map(phi_d), omega)
            angular = angles.rate_map(phi) @ (rate + GAIN * (phi_d - phi))
        expected = np.linalg.solve(J, [*linear, *angular])
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())


def cross(v: np.ndarray) -> np.ndarray:
    """S(v)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("angle", [0.5, np.pi / 2, 2.5, np.pi - 1e-9, np.pi])
def test_no_error_stops_short(kind: str, angle: float) -> None:
    """From 30°, 90°, 143° and 180° away each task brings the tip to its goal; nothing stops silently."""
    start = np.array([0.3, 0.4, 1.9, 0.2, 1.1, -0.3])
    R = Configuration(ARM, start).pose("tip")[:3, :3]
    angles = angles_on_the_way(kind, start, exp3(angle * np.array([0.6, 0.0, 0.8])) @ R)
    assert angles[0] == pytest.approx(angle, abs=1e-7)
    assert angles[-1] < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["angle and axis", "quaternion", "logarithm"])
def test_the_frame_turns_by_the_shortest_way(kind: str) -> None:
    """Beyond 90° as before it, the angle never grows: r sin ϑ alone would lead to 180°."""
    start = np.array([0.3, 0.4, 1.9, 0.2, 1.1, -0.3])
    R = Configuration(ARM, start).pose("tip")[:3, :3]
    for angle in (1.0, 1.5, 1.65, 3.0):
        angles = angles_on_the_way(kind, start, exp3(angle * np.array([0.0, 0.6, 0.8])) @ R, seconds=1.0)
        assert (np.diff(angles) < 1e-9).all()


@pytest.mark.slow
@pytest.mark.figure("3.11")
@pytest.mark.equation("3.71", "3.93")
@pytest.mark.parametrize(
    ("kind", "law"),
    [
        ("logarithm", lambda t: 0.4 * np.exp(-GAIN * t)),
        ("angle and axis", lambda t: np.arcsin(np.sin(0.4) * np.exp(-GAIN * t))),
        ("quaternion", lambda t: 4.0 * np.arctan(np.tan(0.1) * np.exp(-0.5 * GAIN * t))),
    ],
)
def test_errors_die_out_as_their_equations_say(kind: str, law) -> None:
    """ϑ of ė = −K e, of sin ϑ likewise, and of ϑ̇ = −K sin(ϑ/2), to first order in Δt."""
    start = np.array([0.3, 0.4, 1.9, 0.2, 1.1, -0.3])
    R = Configuration(ARM, start).pose("tip")[:3, :3]
    angles = angles_on_the_way(kind, start, exp3([0.0, 0.4, 0.0]) @ R, seconds=0.6)
    expected = law(DT * np.arange(len(angles)))
    np.testing.assert_allclose(angles, expected, atol=0.4 * GAIN * DT)


@pytest.mark.parametrize(("angles", "middle"), [(ZYZ, 0.0), (ZYZ, np.pi), (RPY, np.pi / 2)])
def test_a_representation_singularity_is_left(angles, middle: float) -> None:
    """Where J_φ does not exist the rows are J_O v = T(φ) (φ̇_d + K e), which vanish at the goal only."""
    here = angles.rotation([0.4, middle, 0.9])
    at = Configuration(WRIST, ZYZ.angles(here))  # the joints of the wrist are its ZYZ angles
    np.testing.assert_allclose(at.pose("tip")[:3, :3], here, atol=1e-12)
    A, b = rows_of(EulerTask("tip", angles=angles, target=exp3([0.1, 0.2, 0.3]) @ here, gain=GAIN), at)
    np.testing.assert_allclose(A, at.jacobian("tip")[3:], atol=1e-12)
    assert np.linalg.norm(b) > 0.1
    _, b = rows_of(EulerTask("tip", angles=angles, target=here, gain=GAIN), at)
    np.testing.assert_allclose(b, 0.0, atol=1e-12)


def test_mistakes_are_named() -> None:
    """Angles that are none, gains of another number, a frame that is not there."""
    with pytest.raises(InvalidValue, match=r"angles must be EulerAngles such as taskopt\.ZYZ, got 'ZYZ'"):
        EulerTask("tip", angles="ZYZ")  # type: ignore[arg-type]
    with pytest.raises(InvalidValue, match="gain must have shape 3, got 2"):
        QuaternionTask("tip", gain=[1.0, 2.0])
    with pytest.raises(UnknownName, match="hand"):
        Stack([[AngleAxisTask("hand")]]).compile(WRIST, DT)
