"""The chapter's problems as CVXPY states them, against the formulas and against what defines an optimum."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.arrays import Array
from taskopt.errors import NotSolved
from taskopt.hierarchy.status import Status
from taskopt.resolver.closed_form import (
    damped_inverse,
    null_space_motion,
    pseudo_inverse,
    weighted_pseudo_inverse,
)
from taskopt.solver import cvxpy as chapter
from taskopt.solver.cvxpy import ENGINES

SEEDS = st.integers(0, 2**32 - 1)
EXACT = ("clarabel", "daqp", "proxqp", "piqp")  # DAQP regularises what CVXPY hands it, by 1e-6 of its own


def problem(seed: int, smallest: float = 0.1) -> tuple[Array, Array, Array, Array]:
    """J (6, 7) with singular values from 1 to `smallest`, v in its range, q̇₀, W full and definite."""
    rng = np.random.default_rng(seed)
    U, V = (np.linalg.qr(rng.normal(size=(size, size)))[0] for size in (6, 7))
    J = U @ np.diag(np.geomspace(1.0, smallest, 6)) @ V[:6]
    L = rng.normal(size=(7, 7)) + 3.0 * np.eye(7)
    return J, J @ rng.normal(size=7), rng.normal(size=7), L.T @ L


def relative(x: Array, expected: Array) -> float:
    return float(np.abs(x - expected).max() / np.abs(expected).max())


@pytest.mark.slow
@given(seed=SEEDS, exponent=st.floats(-4.0, -0.5))
@settings(max_examples=30, deadline=None)
def test_each_statement_has_its_formula_as_answer(seed: int, exponent: float) -> None:
    """(3.50), (3.51), (3.54) and (3.59) solve the problems that they come from, near singularities too."""
    J, v, v0, W = problem(seed, 10.0**exponent)
    wide = (np.full(7, -1e3), np.full(7, 1e3))
    assert relative(chapter.least_norm(J, v, W), weighted_pseudo_inverse(J, W) @ v) < 1e-9
    assert relative(chapter.least_norm(J, v, np.diag(W)), weighted_pseudo_inverse(J, np.diag(W)) @ v) < 1e-9
    assert relative(chapter.least_norm(J, v, bounds=wide), pseudo_inverse(J) @ v) < 1e-9
    assert relative(chapter.nearest(J, v, v0), null_space_motion(J, v, v0)) < 1e-9
    assert relative(chapter.nearest(J, 0.0 * v, v0), null_space_motion(J, 0.0 * v, v0)) < 1e-9
    assert relative(chapter.damped(J, v, 0.1), damped_inverse(J, 0.1) @ v) < 1e-9


@pytest.mark.parametrize("engine", EXACT)
def test_solvers_of_cvxpy_give_the_same_answer(engine: str) -> None:
    """One optimum, whoever finds it."""
    for seed in range(5):
        J, v, v0, W = problem(seed)
        assert relative(chapter.least_norm(J, v, W, engine=engine), weighted_pseudo_inverse(J, W) @ v) < 1e-6
        assert relative(chapter.nearest(J, v, v0, engine=engine), null_space_motion(J, v, v0)) < 1e-6
        assert relative(chapter.damped(J, v, 0.1, engine=engine), damped_inverse(J, 0.1) @ v) < 1e-6


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_bounds_are_kept_and_have_the_multipliers_of_an_optimum(seed: int) -> None:
    """W q̇ = Jᵀ λ but for joints at a bound, whose multiplier has the sign of its side."""
    J, v, _, W = problem(seed)
    free = chapter.least_norm(J, v, W)
    bound = 0.9 * np.abs(free).max()
    try:
        x = chapter.least_norm(J, v, W, (np.full(7, -bound), np.full(7, bound)))
    except NotSolved:
        return  # six of seven joints are decided: not every bound can be kept
    assert np.abs(x).max() <= bound + 1e-9
    np.testing.assert_allclose(J @ x, v, atol=1e-9)
    at = np.abs(x) > bound - 1e-8
    assert at.any()
    rows = np.hstack([J.T, np.eye(7)[:, at]])
    multipliers = np.linalg.lstsq(rows, W @ x, rcond=None)[0]
    np.testing.assert_allclose(rows @ multipliers, W @ x, atol=1e-6 * np.abs(W).max())
    assert (multipliers[6:] * np.sign(x[at]) < 1e-6).all()


def test_a_wrong_weight_is_caught() -> None:
    """The formula with another W is not the answer, so the agreement means something."""
    J, v, v0, W = problem(1)
    assert relative(chapter.least_norm(J, v, W), pseudo_inverse(J) @ v) > 1e-2
    assert relative(chapter.nearest(J, v, v0), pseudo_inverse(J) @ v) > 1e-2
    assert relative(chapter.damped(J, v, 0.1), damped_inverse(J, np.sqrt(0.1)) @ v) > 1e-2


def test_statements_are_compiled_once() -> None:
    """Every statement is a parametrised program by CVXPY's rules, and is kept for its sizes."""
    for program in (
        chapter.least_norm_program(7, 6, 14),
        chapter.nearest_program(7, 6, 14),
        chapter.damped_program(7, 6, 14),
        chapter.least_squares_program(7, 6, 14, 3, 2),
    ):
        assert program.problem.is_dpp()
        assert program.problem.is_qp()
    assert chapter.nearest_program(7, 6, 14) is chapter.nearest_program(7, 6, 14)


@pytest.mark.parametrize("engine", EXACT)
def test_a_solve_does_not_depend_on_the_one_before(engine: str) -> None:
    """New numbers, and the old ones again, give the bits of the first time: nothing is warm-started."""
    (J, v, v0, _), (J2, v2, v02, _) = problem(1), problem(2)
    first = chapter.nearest(J, v, v0, engine=engine)
    chapter.nearest(J2, v2, v02, engine=engine)
    np.testing.assert_array_equal(chapter.nearest(J, v, v0, engine=engine), first)


def test_what_cannot_be_had_is_said() -> None:
    """v out of reach within the bounds is infeasible, not answered."""
    J, v, _, _ = problem(3)
    with pytest.raises(NotSolved, match="cvxpy/clarabel: infeasible"):
        chapter.least_norm(J, 100.0 * v, bounds=(-np.ones(7), np.ones(7)))


def test_every_engine_of_the_table_has_its_tolerances() -> None:
    """The names that the registry offers are those that can be asked for an accuracy."""
    J, v, v0, _ = problem(0)
    program = chapter.nearest_program(7, 6, 0)
    for engine in ENGINES:
        found = program.solve(engine, {"C": J, "c": v, "v0": v0})
        assert found.status is Status.SOLVED
        assert relative(found.x, null_space_motion(J, v, v0)) < 1e-5
