"""Answers of solvers are refined where they miss the accuracy, and are not claimed where they still do."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from taskopt.arrays import Array
from taskopt.bench.exact import exact_optimum
from taskopt.bench.scaled_problems import scaled_problem
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.resolver import level_qp
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.refinement import natural_residual
from taskopt.resolver.registry import resolver
from taskopt.resolver.solver_accuracy import SolverTo
from taskopt.resolver.weighted import weighted_problem
from taskopt.solver.base import Solve
from taskopt.solver.registry import solver

SOLVERS = ("daqp", "clarabel", "proxqp", "quadprog", "piqp")
TIE = QuadraticProgram.checked(np.eye(2), [-2.0, -1.0], box_lower=[-1.0, -1.0], box_upper=[1.0, 1.0])
CORNER = np.ones(2)  # its second bound holds with a multiplier of zero


def wrong(x: Array, exact: list[Fraction]) -> bool:
    """True if an entry is further than 1e-8 · max(1, |x_i|) from the exact one, in rational arithmetic."""
    return any(
        not np.isfinite(value) or abs(Fraction(float(value)) - one) > max(1, abs(one)) * Fraction(1, 10**8)
        for value, one in zip(x, exact, strict=True)
    )


@pytest.mark.parametrize("name", SOLVERS)
def test_a_bound_that_holds_with_a_multiplier_of_zero_is_met_exactly(name: str) -> None:
    """min ½ ‖x − (2, 1)‖² with x ≤ 1, to 1e-11 whatever the solver."""
    found = SolverTo(solver(name), 1e-8)(TIE)
    assert found.status is Status.SOLVED
    np.testing.assert_allclose(found.x, CORNER, rtol=0.0, atol=1e-11)


def test_interior_points_miss_such_a_bound_by_themselves() -> None:
    """The error that is mended is there: PIQP and Clarabel are off by more than 1e-8, and claim it is not."""
    for name in ("clarabel", "piqp"):
        found = solver(name)(TIE, 1e-11)
        assert found.status is Status.SOLVED
        assert np.abs(found.x - CORNER).max() > 1e-8, name


@pytest.mark.parametrize("name", [f"{family}/{name}" for family in ("hqp", "wqp") for name in SOLVERS])
@pytest.mark.parametrize("family", ["ties", "rows 1e±3", "weights 1e±3"])
def test_no_answer_to_an_ordinary_problem_is_claimed_and_wrong(family: str, name: str) -> None:
    """Against exact optima, and within 1,000 iterations; at least nine of ten are right."""
    right = 0
    for seed in range(10):
        problem = scaled_problem(family, seed, most=4)[1]
        found = resolver(name)(problem)[0]
        stated = weighted_problem(problem) if name.startswith("wqp") else problem
        miss = wrong(found.x, exact_optimum(stated))
        assert not (miss and found.claimed), seed
        assert found.iterations <= 1000
        right += not miss
    assert right >= 9


def test_the_residual_is_the_error_at_a_tie() -> None:
    """An error of 1e-6 shows as 1e-6, whether x or the multiplier is off; products would show 1e-12."""
    best = Solution(CORNER, np.zeros(0), np.array([1.0, 0.0]), Status.SOLVED)
    assert natural_residual(TIE, best) == 0.0
    inside = replace(best, x=np.array([1.0, 1.0 - 1e-6]), y_box=np.array([1.0, 1e-6]))
    assert natural_residual(TIE, inside) == pytest.approx(1e-6)
    assert natural_residual(TIE, replace(best, x=np.array([1.0 + 1e-6, 1.0]))) == pytest.approx(1e-6)
    assert natural_residual(TIE, replace(best, y_box=np.array([-1.0, 0.0]))) >= 1.0


def test_rounding_errors_of_large_multipliers_are_no_error_of_x() -> None:
    """Rows that meet at 1e-8 rad hold x with multipliers of 1e8, whose sum is off by 1e-8; x is exact."""
    rows = np.array([[1.0, 0.0], [1.0, 1e-8]])
    qp = QuadraticProgram.checked(np.eye(2), np.zeros(2), rows, [0.0, 1e-8], [0.0, np.inf])
    exact = Solution(np.array([0.0, 1.0]), np.array([1e8, -1e8]), np.zeros(2), Status.SOLVED)
    assert natural_residual(qp, replace(exact, y=exact.y + [1e-6, 0.0])) <= 1e-15
    free = replace(qp, lower=np.array([-np.inf, 1e-8]), upper=np.array([np.inf, np.inf]))
    assert natural_residual(free, replace(exact, y=np.array([1e-6, -1e8]))) > 0.1


def off_by(share: float) -> Solve:
    """A solver that misses x by a share of its own size, and claims the optimum."""

    def solve(qp: QuadraticProgram, accuracy: float) -> Solution:
        found = solver("daqp")(qp, accuracy)
        return replace(found, x=(1.0 + share) * found.x)

    return solve


def test_an_answer_is_refined_until_it_is_exact_or_is_not_claimed() -> None:
    """A relative error of 1e-4 is refined away; one of a half is too far for that, and refused."""
    mended = SolverTo(off_by(1e-4), 1e-8)(TIE)
    assert mended.status is Status.SOLVED
    np.testing.assert_allclose(mended.x, CORNER, rtol=0.0, atol=1e-9)
    assert SolverTo(off_by(0.5), 1e-8)(TIE).status is Status.ITERATION_LIMIT


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("number", [np.inf, np.nan, 1e300])
def test_numbers_that_overflow_are_no_answer(number: float) -> None:
    """What a solver claims with them is a failure, and nothing is computed with them."""

    def diverging(qp: QuadraticProgram, accuracy: float) -> Solution:
        x = np.full(qp.n, number)
        return Solution(x, np.full(len(qp.C), number), -x, Status.SOLVED)

    rows = replace(TIE, C=np.array([[1.0, -1.0]]), lower=np.zeros(1), upper=np.zeros(1))
    found = SolverTo(diverging, 1e-8)(rows)
    assert found.status is Status.FAILED
    assert np.isnan(found.x).all()


def test_no_program_is_started_after_the_last_iteration() -> None:
    """Two programs of 400 iterations reach a limit of 700; the third is not asked."""
    asked = []

    def slow(qp: QuadraticProgram, accuracy: float) -> Solution:
        asked.append(qp)
        return replace(solver("daqp")(qp, accuracy), iterations=400)

    solve = SolverTo(slow, 1e-8, 700)
    assert [solve(TIE).status for _ in range(3)] == [Status.SOLVED, Status.SOLVED, Status.ITERATION_LIMIT]
    assert len(asked) == 2


def test_proximal_steps_that_do_not_converge_are_not_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A level that a bound holds back takes several steps; the answer after the first one is no claim."""
    hierarchy = Hierarchy([Level([[1.0, 0.0, 1e-3]], [2.0])], ([-1.0] * 3, [1.0] * 3))
    assert HierarchicalQP("daqp")(hierarchy)[0].claimed
    monkeypatch.setattr(level_qp, "_REPEATS", 1)
    assert HierarchicalQP("daqp")(hierarchy)[0].status is Status.ITERATION_LIMIT


def test_proximal_steps_end_at_rounding_errors() -> None:
    """An error of 4e-15 / weight in a free direction doubles from step to step; it is no way that is left."""
    exact, asked = SolverTo(solver("daqp"), 1e-8), []

    def rounded(qp: QuadraticProgram) -> Solution:
        asked.append(qp)
        found = exact(qp)
        return replace(found, x=found.x + [0.0, 4e-15 / qp.H[1, 1]])

    level = level_qp.row_svd(np.array([[1.0, 0.0]]), np.array([2.0]), len)
    held = level_qp.RowSet(np.array([[1.0, 1.0]]), np.array([-1.0]), np.array([1.0]), np.arange(1))
    none = level_qp.RowSet(np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.arange(0))
    found = level_qp.least_violation(rounded, level, none, held)
    assert found.complete
    np.testing.assert_allclose(found.z, [2.0, -1.0], atol=1e-9)
    assert len(asked) <= 6
