"""Accuracy is asked for in q̇: what solvers are asked, and that their raw answers are the closed form."""

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Sphere
from taskopt.kinematics.objective import JointRange, Manipulability, Objective, ObstacleDistance, UserFunction
from taskopt.kinematics.robot import Robot, planar_arm
from taskopt.resolver import solver_accuracy
from taskopt.resolver.closed_form import (
    damped_inverse,
    gradient_motion,
    null_space_motion,
    pseudo_inverse,
    square_inverse,
    weighted_pseudo_inverse,
)
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.registry import resolver, resolver_names
from taskopt.resolver.solver_accuracy import SolverTo
from taskopt.resolver.weighted import WeightedQP
from taskopt.solver import registry
from taskopt.solver.registry import Solver, solver, solvers
from tests.helpers.spectrum import jacobian

EXACT = ("daqp", "clarabel", "proxqp", "quadprog")
OTHERS = tuple(row.name for row in solvers() if row.installed and row.name not in EXACT)
FRAMES = {
    "planar": ("tip",),
    "ur5_robot": ("tool0",),
    "panda": ("panda_hand",),
    "baxter": ("left_gripper", "right_gripper"),
}
ROWS = {"planar": slice(0, 2), "ur5_robot": slice(0, 3), "panda": slice(0, 6), "baxter": slice(0, 6)}
HELD = ("panda_finger", "head_pan", "l_gripper", "r_gripper")


@cache
def robot(name: str) -> Robot:
    """Three, six, seven joints, and two arms of seven; fingers and head do not move."""
    if name == "planar":
        return planar_arm(lower=-3.0, upper=3.0, velocity=2.0, radius=0.02)
    loaded = Robot.load(name)
    return Robot.load(name, lock=tuple(joint for joint in loaded.joints if joint.startswith(HELD)))


def objectives(name: str) -> list[Objective]:
    """(3.56), (3.57), (3.58), one of the user's, and a sum."""
    frame = FRAMES[name][0]
    middle, wave = JointRange(), UserFunction(lambda at: float(np.sin(at.q).sum()), lambda at: np.cos(at.q))
    manipulability = Manipulability(frame, "xy" if name == "planar" else "xyz rpy")
    away = ObstacleDistance([Sphere([0.6, 0.3, 0.4], 0.1)], 0.01)
    return [manipulability, middle, away, wave, 5.0 * middle + 0.1 * manipulability]


def place(name: str, seed: int) -> tuple[Configuration, Array]:
    """A random configuration inside the position limits, and the rows of its hands."""
    of, rng = robot(name), np.random.default_rng(seed)
    lower, upper = np.maximum(of.position_lower, -3.0), np.minimum(of.position_upper, 3.0)
    at = Configuration(of, rng.uniform(lower, upper))
    return at, np.vstack([at.jacobian(frame)[ROWS[name]] for frame in FRAMES[name]])


def smallest(name: str, seed: int) -> float:
    """σ_min of the rows."""
    return float(np.linalg.svd(place(name, seed)[1], compute_uv=False)[-1])


def cases(name: str, seed: int) -> list[tuple[Hierarchy, Array]]:
    """Every objective as a hierarchy, beside its formula; bounds are there and do not bind."""
    at, J = place(name, seed)
    rng, (m, n) = np.random.default_rng(seed + 1), J.shape
    v, v0 = rng.normal(size=m), rng.normal(size=n)
    L = rng.normal(size=(n, n)) + 3.0 * np.eye(n)
    k = 0.05
    damped = np.concatenate([np.ones(m), np.full(n, k**2)])
    told = [
        ([Level(J, v)], None, pseudo_inverse(J) @ v),
        ([Level(J, v)], L.T @ L, weighted_pseudo_inverse(J, L.T @ L) @ v),
        ([Level(J, v)], np.diag(L) ** 2 + 0.1, weighted_pseudo_inverse(J, np.diag(L) ** 2 + 0.1) @ v),
        ([Level(J, v), Level(np.eye(n), v0)], None, null_space_motion(J, v, v0)),
        ([Level(J, np.zeros(m)), Level(np.eye(n), v0)], None, null_space_motion(J, np.zeros(m), v0)),
        ([Level(np.vstack([J, np.eye(n)]), np.concatenate([v, np.zeros(n)]), weight=damped)], None,
         damped_inverse(J, k) @ v),
    ]  # fmt: skip
    square = at.jacobian(FRAMES[name][0])
    if square.shape[1] == len(square) and np.linalg.svd(square, compute_uv=False)[-1] >= 1e-3:
        v6 = rng.normal(size=6)
        told.append(([Level(square, v6)], None, square_inverse(square, v6)))
    for w in objectives(name):
        slope = w.gradient(at)
        told.append(([Level(J, v), Level(np.eye(n), 2.0 * slope)], None, gradient_motion(J, v, slope, 2.0)))
    return [(Hierarchy(levels, inactive(x), norm=norm), x) for levels, norm, x in told]


def inactive(x: Array) -> tuple[Array, Array]:
    """Bounds ten times as far as the largest velocity."""
    far = np.full(len(x), 10.0 * np.abs(x).max() + 1.0)
    return -far, far


def apart(x: Array, exact: Array) -> float:
    """Relative to the largest entry, or to 1e-6 where that is less."""
    return float(np.abs(x - exact).max() / max(1e-6, np.abs(exact).max()))


@pytest.mark.slow
@pytest.mark.parametrize("name", FRAMES)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_raw_answers_are_the_closed_form(name: str, seed: int) -> None:
    """Where no row binds and σ_min ≥ 1e-3: to 1e-9 in q̇ for every objective, and none is flagged."""
    assume(smallest(name, seed) >= 1e-3)
    for hierarchy, exact in cases(name, seed):
        for engine in EXACT:
            resolution, _ = HierarchicalQP(engine)(hierarchy)
            assert apart(resolution.x, exact) <= 1e-9, engine
            assert resolution.proven


@pytest.mark.slow
@pytest.mark.parametrize("name", FRAMES)
@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_raw_answers_are_the_closed_form_often(name: str, seed: int) -> None:
    """The same over more configurations, and one weighted QP against its own closed form."""
    assume(smallest(name, seed) >= 1e-3)
    for hierarchy, exact in cases(name, seed):
        for engine in EXACT:
            assert apart(HierarchicalQP(engine)(hierarchy)[0].x, exact) <= 1e-9, engine
            weighted = WeightedQP(engine)
            assert apart(weighted(hierarchy)[0].x, weighted.closed_form(hierarchy)) <= 1e-9, engine


@pytest.mark.slow
@pytest.mark.parametrize("solver", OTHERS)
def test_every_other_solver_agrees_or_is_flagged(solver: str) -> None:
    """No answer is proven that is further from the closed form than was asked for."""
    for name, seed in product(FRAMES, (1, 2)):
        for hierarchy, exact in cases(name, seed):
            resolution, _ = HierarchicalQP(solver)(hierarchy)
            assert not resolution.proven or apart(resolution.x, exact) <= 1.1e-8


@pytest.mark.parametrize(("name", "seed"), [("ur5_robot", 652321466), ("baxter", 16197)])
def test_a_program_that_is_too_large_for_an_interior_point_is_solved_at_unit_size(
    name: str, seed: int
) -> None:
    """Clarabel gives up on weighted programs of these two places; asked again at unit size, it is exact."""
    for hierarchy, _ in cases(name, seed):
        weighted = WeightedQP("clarabel")
        assert apart(weighted(hierarchy)[0].x, weighted.closed_form(hierarchy)) <= 1e-9


def test_the_square_inverse_is_among_the_cases() -> None:
    """Six joints and six rows: (3.47) has one case more than the redundant arms have."""
    assert len(cases("ur5_robot", 1)) == len(cases("panda", 1)) + 1


@pytest.mark.parametrize("family", ["wqp", "hqp", "cvxpy"])
@pytest.mark.parametrize("smallest", [1e-1, 1e-3])
def test_any_norm_is_that_of_every_resolver(family: str, smallest: float) -> None:
    """A full W of condition 1e4: exact or flagged, whoever solves; pinv and active-set are exact."""
    J, rng = jacobian(2, smallest), np.random.default_rng(1)
    Q, v = np.linalg.qr(rng.normal(size=(7, 7)))[0], rng.normal(size=6)
    W = Q @ np.diag(np.geomspace(1.0, 1e-4, 7)) @ Q.T
    W = 0.5 * (W + W.T)
    spread = np.linalg.solve(W, J.T)
    exact = spread @ np.linalg.solve(J @ spread, v)  # (3.50), letter by letter
    told = Hierarchy([Level(J, v)], inactive(exact), norm=W)
    for name in ("pinv", "active-set"):
        assert apart(resolver(name)(told)[0].x, exact) <= 1e-9
    engines = [name.split("/")[1] for name in resolver_names() if name.startswith(f"{family}/")]
    for engine in (row for row in engines if solver(row).installed):
        answer = resolver(f"{family}/{engine}")
        found = answer(told)[0]
        goal = exact if answer.strict else answer.closed_form(told)
        assert not found.proven or apart(found.x, goal) <= 2e-8, engine
        assert found.proven or engine not in EXACT


@pytest.mark.parametrize("solver", EXACT)
@pytest.mark.parametrize("size", [1e-5, 1.0, 1e5])
def test_accuracy_is_relative_to_the_velocity(solver: str, size: float) -> None:
    """The same problem in other units has the same relative error: programs are solved at unit size."""
    J, rng = jacobian(2, 1e-2), np.random.default_rng(2)
    v, v0 = size * rng.normal(size=6), size * rng.normal(size=7)
    exact = null_space_motion(J, v, v0)
    hierarchy = Hierarchy([Level(J, v), Level(np.eye(7), v0)], inactive(exact))
    assert apart(HierarchicalQP(solver)(hierarchy)[0].x, exact) <= 1e-9


@pytest.mark.parametrize("smallest", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("solver", EXACT)
def test_a_level_that_bounds_forbid_is_right_near_a_singularity_too(solver: str, smallest: float) -> None:
    """Half the velocity that the closed form wants: least squares inside bounds, as the active set has it."""
    for seed in range(5):
        J, v = jacobian(seed, smallest), np.random.default_rng(seed).normal(size=6)
        far = np.full(7, 0.5 * np.abs(pseudo_inverse(J) @ v).max())
        resolution, _ = HierarchicalQP(solver)(Hierarchy([Level(J, v)], (-far, far)))
        assert resolution.proven
        assert resolution.kkt_met()
        assert resolution.active


def test_a_tighter_accuracy_asks_the_solver_for_less_residual() -> None:
    """Tolerance follows accuracy and λ_min(H), and sizes come out as they went in."""
    spy = Spy()
    for H, accuracy in ((1.0, 1e-8), (1.0, 1e-6), (0.01, 1e-6)):
        qp = QuadraticProgram.checked(H * np.eye(2), [300.0, -40.0], [[0.0, 10.0]], [7e5])
        np.testing.assert_allclose(SolverTo(spy, accuracy)(qp).x, [-300.0 / H, 7e4], rtol=1e-15)
    first, second, third = spy.asked
    assert second == pytest.approx(100.0 * first)
    assert third == pytest.approx(0.01 * second)
    for unit in spy.programs:
        np.testing.assert_array_equal(unit.C, [[0.0, 1.0]])
        np.testing.assert_allclose(unit.lower, 1.0)
        assert not unit.g.any()


def test_rounding_errors_are_no_scale() -> None:
    """A gradient of 1e-17 beside bounds of size one leaves them of size one; it is no number to divide by."""
    spy = Spy()
    qp = QuadraticProgram.checked(np.eye(2), [1e-17, 0.0], box_lower=[1.0, -2.0], box_upper=[2.0, 2.0])
    SolverTo(spy, 1e-8)(qp)
    np.testing.assert_allclose(spy.programs[0].box_upper, [2.0, 2.0])


def test_an_optimum_without_bounds_that_keeps_them_needs_no_solver() -> None:
    """It is the optimum with them; the solver is asked as soon as one bound is broken."""
    spy = Spy()
    qp = QuadraticProgram.checked(np.eye(2), [-3.0, 0.0], box_lower=[-1.0, -2.0], box_upper=[3.0, 2.0])
    found = SolverTo(spy, 1e-8)(qp)
    assert found.status is Status.SOLVED
    assert not spy.programs
    np.testing.assert_array_equal(found.x, [3.0, 0.0])
    SolverTo(spy, 1e-8)(replace(qp, box_upper=np.array([2.999, 2.0])))
    assert spy.programs


@pytest.mark.parametrize("far", [1e6, 1e9, 1e19, np.inf])
def test_a_bound_that_nothing_reaches_is_none(far: float) -> None:
    """A solver never sees it; one that the first answer breaks is put back, so that the answer keeps it."""
    spy = Spy()
    SolverTo(spy, 1e-8)(QuadraticProgram.checked(np.eye(2), [3.0, 0.0], box_lower=[2.0, -far]))
    assert [list(unit.box_lower) for unit in spy.programs] == [[1.0, -np.inf]]


def test_a_far_bound_that_the_answer_needs_is_put_back() -> None:
    """x₁ + 1e-6 x₂ + 1e-7 x₃ ≥ 1 with x₁ ≤ 0 takes x₂ to 1e6 / 1.01, or, from x₂ = 5e5, x₃ to 5e6."""
    engine, row = SolverTo(solver("daqp"), 1e-8), [[1.0, 1e-6, 1e-7]]
    for most, optimum in ((1e9, [0.0, 1e6 / 1.01, 1e5 / 1.01]), (5e5, [0.0, 5e5, 5e6])):
        qp = QuadraticProgram.checked(
            np.eye(3), np.zeros(3), row, [1.0], [np.inf], [-1e9] * 3, [0.0, most, 1e9]
        )
        np.testing.assert_allclose(engine(qp).x, optimum, rtol=1e-6, atol=1e-9)


class Spy:
    """A solver that keeps what it was given, and puts x at its lower bounds."""

    def __init__(self) -> None:
        self.asked: list[float] = []
        self.programs: list[QuadraticProgram] = []

    def __call__(self, qp: QuadraticProgram, accuracy: float) -> Solution:
        self.asked.append(accuracy)
        self.programs.append(qp)
        least = qp.lower[0] * qp.C[0] if len(qp.C) else np.maximum(qp.box_lower, 0.0)
        return Solution(least, np.zeros(len(qp.C)), np.zeros(qp.n), Status.SOLVED)


def test_what_misses_the_accuracy_is_never_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver is off by 1e-7 and claims an optimum: not refined, that is proven for 1e-5, not for 1e-8."""

    def sloppy(qp: QuadraticProgram, accuracy: float) -> Solution:
        found = solver("daqp")(qp, accuracy)
        return replace(found, x=found.x + np.where(np.arange(qp.n) == 6, 1e-7, 0.0))

    monkeypatch.setitem(registry._known, "sloppy", Solver("sloppy", "test", 1e-6, function=sloppy))
    J, v = jacobian(0), np.random.default_rng(0).normal(size=6)
    far = np.full(7, 5.0 * np.abs(pseudo_inverse(J) @ v).max())
    problem = Hierarchy([Level(J, v)], (-far, far))
    assert HierarchicalQP("sloppy")(problem)[0].proven
    monkeypatch.setattr(solver_accuracy, "refined", lambda solve, qp, found, accuracy: found)
    for accuracy, proven in ((1e-5, True), (1e-8, False)):
        resolution, _ = HierarchicalQP("sloppy", accuracy)(problem)
        assert resolution.claimed
        assert resolution.proven is proven
        assert ("Certificate: proven." in resolution.explain()) is proven


@pytest.mark.parametrize("wrong", [0.0, -1e-8, 1e-14, 1.0, np.nan])
def test_an_accuracy_that_cannot_be_had_is_refused(wrong: float) -> None:
    """It must be above rounding, and a number."""
    for family in (HierarchicalQP, WeightedQP):
        with pytest.raises(InvalidValue, match="accuracy"):
            family("daqp", accuracy=wrong)
