"""The runs of Sect. 3.7.5 and Problem 3.22, tick by tick, against loops in plain NumPy that share no code."""

from dataclasses import replace
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from taskopt import JointVelocityLimit, Stack, load_scenario, run
from taskopt.resolver.registry import resolver

TASKS = Path(__file__).parents[2] / "tasks"
DT, TICKS, LINKS = 1e-3, 5000, 0.5
START = np.array([np.pi, -np.pi / 2, -np.pi / 2])


@cache
def paths(name: str, by: str, ticks: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Postures (ticks, nq) and velocities (ticks, nv) of a scenario under a resolver; None: all ticks."""
    steps = list(islice(run(load_scenario(TASKS / f"{name}.py"), resolver(by)), ticks))
    return np.array([step.q.copy() for step in steps]), np.array([step.v.copy() for step in steps])


def planar(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x = (p_x, p_y, φ) of the three-link arm (2.83), and its Jacobian (3.35) without null rows."""
    a = np.cumsum(q)
    x = np.array([LINKS * np.cos(a).sum(), LINKS * np.sin(a).sum(), a[2]])
    rows = [-LINKS * np.sin(a), LINKS * np.cos(a)]
    J = np.array([[r[0] + r[1] + r[2], r[1] + r[2], r[2]] for r in rows] + [[1.0, 1.0, 1.0]])
    return x, J


def circle(t: float) -> tuple[np.ndarray, np.ndarray]:
    """x_d and ẋ_d of Sect. 3.7.5; everything rests from t = 4 s on."""
    s, moving = min(t, 4.0), t < 4.0
    x = np.array([0.25 * (1 - np.cos(np.pi * s)), 0.25 * (2 + np.sin(np.pi * s)), np.sin(np.pi / 24 * s)])
    rate = [0.25 * np.pi * np.sin(np.pi * s), 0.25 * np.pi * np.cos(np.pi * s)]
    return x, moving * np.array([*rate, np.pi / 24 * np.cos(np.pi / 24 * s)])


def plain(algorithm, start: np.ndarray = START, ticks: int = TICKS) -> np.ndarray:
    """Postures (ticks, n) of Euler's method (3.48): q(t_{k+1}) = q(t_k) + q̇(q(t_k), t_k) Δt."""
    q, out = start.copy(), []
    for tick in range(ticks):
        out.append(q.copy())
        q = q + algorithm(q, tick * DT) * DT
    return np.array(out)


def open_loop(q: np.ndarray, t: float) -> np.ndarray:
    """q̇ = J⁻¹ ẋ_d (3.47)."""
    return np.linalg.solve(planar(q)[1], circle(t)[1])


def closed_loop(q: np.ndarray, t: float) -> np.ndarray:
    """q̇ = J_A⁻¹ (ẋ_d + K e) (3.70), K = diag(500, 500, 100)."""
    (x, J), (x_d, rate) = planar(q), circle(t)
    return np.linalg.solve(J, rate + np.array([500.0, 500.0, 100.0]) * (x_d - x))


def pseudo_inverse(q: np.ndarray, t: float, q0: np.ndarray | None = None) -> np.ndarray:
    """q̇ = J†(ẋ_d + K e) + (I − J†J) q̇₀ (3.72) for the position, K = diag(500, 500)."""
    (x, J), (x_d, rate) = planar(q), circle(t)
    J = J[:2]
    inverse = J.T @ np.linalg.inv(J @ J.T)
    out = inverse @ (rate[:2] + 500.0 * (x_d - x)[:2])
    return out if q0 is None else out + (np.eye(3) - inverse @ J) @ q0


def transpose(q: np.ndarray, t: float) -> np.ndarray:
    """q̇ = J_Aᵀ K e (3.76), K = diag(500, 500)."""
    (x, J), (x_d, _) = planar(q), circle(t)
    return J[:2].T @ (500.0 * (x_d - x)[:2])


def manipulable(q: np.ndarray, t: float) -> np.ndarray:
    """(3.72) with the gradient of w = ½ (s₂² + s₃²), k₀ = 50."""
    return pseudo_inverse(q, t, 50.0 * np.array([0.0, *(np.sin(q[1:]) * np.cos(q[1:]))]))


def ranged(q: np.ndarray, t: float) -> np.ndarray:
    """(3.72) with the gradient of (3.57), n = 3, k₀ = 250."""
    lower, upper = np.array([-2.0, -0.5, -1.5]) * np.pi, np.array([2.0, 0.5, -0.5]) * np.pi
    return pseudo_inverse(q, t, -250.0 / 3.0 * (q - 0.5 * (lower + upper)) / (upper - lower) ** 2)


RUNS = {
    "fig_3_15_open_loop": (open_loop, "pinv", 1e-9),
    "fig_3_16_inverse": (closed_loop, "pinv", 1e-9),
    "fig_3_17_pseudo_inverse": (pseudo_inverse, "pinv", 1e-9),
    "fig_3_18_transpose": (transpose, "transpose", 1e-9),
    "planar_circle": (manipulable, "pinv", 1e-9),
    "fig_3_20_joint_limits": (ranged, "pinv", 1e-6),  # it passes a singular posture
}


@pytest.mark.equation("3.47", "3.48", "3.55", "3.57", "3.70", "3.72", "3.76")
@pytest.mark.figure("3.15", "3.16", "3.17", "3.18", "3.19", "3.20")
@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("ticks", [500, pytest.param(TICKS, marks=pytest.mark.slow)])
def test_the_runs_of_the_text(name: str, ticks: int) -> None:
    """Every posture of the scenario is that of the plain loop."""
    algorithm, by, tolerance = RUNS[name]
    found = paths(name, by, None if ticks == TICKS else ticks)[0]
    np.testing.assert_allclose(found, plain(algorithm, ticks=ticks), rtol=0.0, atol=tolerance)


def tracking(q: np.ndarray, x_d: np.ndarray, rate: np.ndarray, K: tuple[float, ...]) -> np.ndarray:
    """J_A⁻¹ (ẋ_d + K e) of (3.70) for any target, rate and gains."""
    x, J = planar(q)
    return np.linalg.solve(J, rate + np.array(K) * (x_d - x))


def range_rate(n: float, factor: float = 2.0):
    """(3.72) with k₀ = 250 and the gradient −factor/(2 n) (q − q̄)/(q_M − q_m)²."""
    lower, upper = np.array([-2.0, -0.5, -1.5]) * np.pi, np.array([2.0, 0.5, -0.5]) * np.pi
    scale = -250.0 * factor / (2.0 * n * (upper - lower) ** 2)
    return lambda q, t: pseudo_inverse(q, t, scale * (q - 0.5 * (lower + upper)))


K = (500.0, 500.0, 100.0)
LIES = {
    "a late stop": ("fig_3_16_inverse", lambda q, t: tracking(q, circle(t)[0], circle(min(t, 4 - DT))[1], K)),
    "the next target": ("fig_3_16_inverse", lambda q, t: tracking(q, circle(t + DT)[0], circle(t)[1], K)),
    "the next rate": ("fig_3_16_inverse", lambda q, t: tracking(q, circle(t)[0], circle(t + DT)[1], K)),
    "both of the next tick": ("fig_3_16_inverse", lambda q, t: closed_loop(q, t + DT)),
    "another sign of the rate": (
        "fig_3_16_inverse",
        lambda q, t: tracking(q, circle(t)[0], -circle(t)[1], K),
    ),
    "gains in another order": ("fig_3_16_inverse", lambda q, t: tracking(q, *circle(t), K[::-1])),
    "no feedback": ("fig_3_16_inverse", open_loop),
    "feedback": ("fig_3_15_open_loop", closed_loop),
    "a factor": ("fig_3_17_pseudo_inverse", lambda q, t: pseudo_inverse(q, t) * (1.0 + 1e-6)),
    "a rate for the transpose": (
        "fig_3_18_transpose",
        lambda q, t: transpose(q, t) + planar(q)[1][:2].T @ circle(t)[1][:2],
    ),
    "another sign of k₀": ("planar_circle", lambda q, t: 2.0 * pseudo_inverse(q, t) - manipulable(q, t)),
    "half of k₀": ("planar_circle", lambda q, t: 0.5 * (pseudo_inverse(q, t) + manipulable(q, t))),
    "n = 2": ("fig_3_20_joint_limits", range_rate(2.0)),
    "a gradient without the factor 2": ("fig_3_20_joint_limits", range_rate(3.0, 1.0)),
    "another sign of the gradient": ("fig_3_20_joint_limits", range_rate(3.0, -2.0)),
}


@pytest.mark.equation("3.71")
@pytest.mark.parametrize(
    "lie", [pytest.param(lie, marks=pytest.mark.slow if lie == "a late stop" else ()) for lie in LIES]
)
def test_the_oracle_tells_a_wrong_index_sign_and_factor(lie: str) -> None:
    """A planted lie moves the path of its run by more than the tolerance of the test above."""
    name, algorithm = LIES[lie]
    _, by, tolerance = RUNS[name]
    ticks = 4100 if lie == "a late stop" else 500
    found = paths(name, by, None if ticks > 500 else ticks)[0][:ticks]
    assert np.abs(found - plain(algorithm, ticks=ticks)).max() > tolerance


def test_the_oracle_of_the_ranges_is_the_one_that_the_runs_use() -> None:
    """Without a lie, n = 3 and the factor 2, the function of the lies is the oracle of Fig. 3.20."""
    q = np.array([3.0, -1.4, -1.7])
    np.testing.assert_allclose(range_rate(3.0)(q, 0.3), ranged(q, 0.3), rtol=1e-12)


def errors(q: np.ndarray) -> np.ndarray:
    """x_d − x (ticks, 3) along a path."""
    return np.array([circle(tick * DT)[0] - planar(row)[0] for tick, row in enumerate(q)])


@pytest.mark.slow
@pytest.mark.figure("3.15", "3.16")
def test_the_open_loop_drifts_and_the_closed_loop_does_not() -> None:
    """Open loop: the position error reaches millimetres and stays constant after 4 s, the orientation's, too.

    Closed loop: the position error stays ten times smaller, and both errors are gone at the end.
    """
    drift, kept = (errors(paths(name, "pinv")[0]) for name in ("fig_3_15_open_loop", "fig_3_16_inverse"))
    position = np.linalg.norm(drift[:, :2], axis=1)
    assert 1e-4 < position[4000] < 1e-2
    np.testing.assert_allclose(position[4000:], position[4000], rtol=1e-9)
    assert abs(drift[-1, 2]) > 1e-6
    np.testing.assert_allclose(drift[4000:, 2], drift[4000, 2], rtol=1e-6)
    assert np.linalg.norm(kept[:, :2], axis=1).max() < 0.1 * position.max()
    assert np.abs(kept[-1]).max() < 1e-12


@pytest.mark.slow
@pytest.mark.figure("3.17", "3.18")
def test_the_transpose_lags_and_arrives() -> None:
    """Its error is bounded, tens of times that of the pseudo-inverse, and tends to zero at rest."""
    follow, lag = (
        np.linalg.norm(errors(paths(name, by)[0])[:, :2], axis=1)
        for name, by in (("fig_3_17_pseudo_inverse", "pinv"), ("fig_3_18_transpose", "transpose"))
    )
    assert follow.max() < 1e-4
    assert 1e-3 < lag.max() < 2e-2
    assert lag[-1] < 1e-9


@pytest.mark.slow
@pytest.mark.figure("3.19")
def test_the_manipulability_constraint_makes_the_path_cyclic() -> None:
    """With k₀ = 50 joints 2 and 3 nearly coincide, all paths repeat after a circle, and w is larger.

    They coincide exactly at rest; on the circle they stay within 0.09 rad, beside 0.6 rad without q̇₀. At one
    moment w is 0.0015 smaller than without, elsewhere larger.
    """
    free, kept = paths("fig_3_17_pseudo_inverse", "pinv")[0], paths("planar_circle", "pinv")[0]
    assert np.abs(kept[:, 1] - kept[:, 2]).max() < 0.09
    assert np.abs(kept[-1, 1] - kept[-1, 2]) < 1e-12
    assert np.abs(kept[4000] - kept[2000]).max() < 1e-3
    assert np.abs(free[4000] - free[2000]).max() > 0.05
    assert np.abs(free[:, 1] - free[:, 2]).max() > 0.2
    w_free, w_kept = (0.5 * (np.sin(q[:, 1:]) ** 2).sum(axis=1) for q in (free, kept))
    assert (w_kept >= w_free - 0.002).all()
    assert w_kept.mean() > w_free.mean() + 0.03
    assert np.linalg.norm(errors(kept)[:, :2], axis=1).max() < 1e-4


@pytest.mark.slow
@pytest.mark.figure("3.20")
def test_the_distance_from_the_limits_keeps_them() -> None:
    """With k₀ = 250 joints 2 and 3 keep their limits, which they violate with q̇₀ = 0, and turn back."""
    lower, upper = np.array([-2.0, -0.5, -1.5]) * np.pi, np.array([2.0, 0.5, -0.5]) * np.pi
    free, kept = paths("fig_3_17_pseudo_inverse", "pinv")[0], paths("fig_3_20_joint_limits", "pinv")[0]
    assert (free[:, 1] < lower[1] - 0.1).any()
    assert (free[:, 2] > upper[2] + 0.1).any()
    assert ((kept >= lower - 1e-12) & (kept <= upper + 1e-12)).all()
    assert kept[10, 1] > kept[0, 1]
    assert kept[10, 2] < kept[0, 2]
    assert np.linalg.norm(errors(kept)[:, :2], axis=1).max() < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", [*sorted(set(RUNS) - {"fig_3_18_transpose"}), "problem_3_22"])
def test_the_qp_keeps_the_limits_that_the_formula_breaks(name: str) -> None:
    """Beside each closed form the QP stays within limits of speed, proven at every tick.

    The limits are those of the scenario; that of Fig. 3.19, which has none, gets 2 rad/s.
    """
    scenario = load_scenario(TASKS / f"{name}.py")
    largest = scenario.robot.velocity_limit
    if name == "planar_circle":
        largest = np.full(3, 2.0)
        limited = Stack(scenario.stack.levels, [JointVelocityLimit(velocity=2.0)], damping=None)
        scenario = replace(scenario, stack=limited)
    steps = list(run(scenario, resolver("active-set")))
    assert all(step.resolution.kkt_met() for step in steps)
    assert (np.abs([step.v for step in steps]).max(axis=0) <= largest * (1.0 + 1e-9)).all()
    assert (np.abs(paths(name, "pinv")[1]).max(axis=0) > largest).any()


def scara_pose(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x = (p, φ) of the SCARA, links of 0.5 m at a height of 1 m, and its Jacobian."""
    a, b = q[0], q[0] + q[1]
    x = np.array([0.5 * (np.cos(a) + np.cos(b)), 0.5 * (np.sin(a) + np.sin(b)), 1.0 + q[2], b + q[3]])
    J = np.zeros((4, 4))
    J[0, :2] = -0.5 * (np.sin(a) + np.sin(b)), -0.5 * np.sin(b)
    J[1, :2] = 0.5 * (np.cos(a) + np.cos(b)), 0.5 * np.cos(b)
    J[2, 2] = 1.0
    J[3, [0, 1, 3]] = 1.0
    return x, J


def line(t: float) -> tuple[np.ndarray, np.ndarray]:
    """x_d and ẋ_d of Problem 3.22: s = ½ (1 − cos(πt/2))."""
    s, rate = 0.5 * (1.0 - np.cos(0.5 * np.pi * min(t, 2.0))), 0.25 * np.pi * np.sin(0.5 * np.pi * t)
    way = np.array([-0.7, 0.8, 0.5, 0.5 * np.pi])
    return np.array([0.7, 0.0, 0.0, 0.0]) + s * way, (t < 2.0) * rate * way


@pytest.mark.slow
@pytest.mark.problem("3.22")
@pytest.mark.parametrize(("name", "by"), [("problem_3_22", "pinv"), ("problem_3_22_transpose", "transpose")])
def test_the_scara_manipulator_goes_its_way(name: str, by: str) -> None:
    """Both algorithms are the plain loops; the inverse tracks to 1e-5 m, and both arrive."""

    def algorithm(q: np.ndarray, t: float) -> np.ndarray:
        (x, J), (x_d, rate) = scara_pose(q), line(t)
        return np.linalg.solve(J, rate + 500.0 * (x_d - x)) if by == "pinv" else J.T @ (300.0 * (x_d - x))

    start = load_scenario(TASKS / f"{name}.py").start
    np.testing.assert_allclose(scara_pose(start)[0], [0.7, 0.0, 0.0, 0.0], atol=1e-15)
    q = paths(name, by)[0]
    np.testing.assert_allclose(q, plain(algorithm, start, 2500), rtol=0.0, atol=1e-9)
    lack = np.array([line(tick * DT)[0] - scara_pose(row)[0] for tick, row in enumerate(q)])
    assert np.abs(lack).max() < (1e-5 if by == "pinv" else 0.02)
    assert np.abs(lack[-1]).max() < 1e-4
