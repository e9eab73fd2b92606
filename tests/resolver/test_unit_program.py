"""Kernels that scale programs to unit size and examine answers, beside NumPy and the natural residual."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import OUT_OF_REACH, SOLVER_SHARE
from taskopt.resolver.refinement import natural_residual
from taskopt.resolver.solver_accuracy import SolverTo
from taskopt.resolver.unit_kernels import COARSE, FAR, FINE, error_at_unit_size, examine_answer
from taskopt.resolver.unit_program import UnitProgram
from taskopt.solver.registry import solver

SEEDS = st.integers(0, 2**32 - 1)
NONE = np.empty((0, 0))


def program(seed: int, *, far: bool = False) -> QuadraticProgram:
    """Return a random program with a diagonal H whose rows and box hold a point in common."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, 7)), int(rng.integers(0, 9))
    C, x = rng.standard_normal((m, n)), rng.standard_normal(n)
    value, room = C @ x, rng.exponential(size=(4, max(m, n)))
    upper = value + np.where(rng.random(m) < 0.2, np.inf, room[1, :m])
    equal = (np.arange(m) < n // 2) & (rng.random(m) < 0.3)
    box = x - room[2, :n], x + room[3, :n] + (1e7 if far else 0.0)
    return QuadraticProgram.checked(
        np.diag(rng.uniform(0.1, 2.0, n)),
        rng.standard_normal(n),
        C,
        np.where(equal, value, value - room[0, :m]),
        np.where(equal, value, upper),
        *box,
    )


def examined(unit: UnitProgram, found: Solution, accuracy: float) -> int:
    """Return what the kernel says of an answer at unit size."""
    numbers = found.x, found.y, found.y_box
    return examine_answer(unit.H, unit.arrays, unit.near, unit.size, numbers, (accuracy, NONE), unit.answer)


@pytest.mark.slow
@given(SEEDS)
def test_a_program_at_unit_size_is_the_program_seen_from_its_free_optimum(seed: int) -> None:
    """Rows, bounds and size are those that NumPy finds from the definitions."""
    qp = program(seed)
    unit = UnitProgram.of(qp)
    free = -qp.g / np.diagonal(qp.H)
    np.testing.assert_allclose(unit.free, free, rtol=1e-15)
    length = np.linalg.norm(qp.C, axis=1)
    parts = [(qp.lower - qp.C @ free) / length, (qp.upper - qp.C @ free) / length]
    parts += [qp.box_lower - free, qp.box_upper - free]
    outside = np.concatenate([parts[0], -parts[1], parts[2], -parts[3]]).max(initial=0.0)
    assert unit.size == pytest.approx(max(outside, 1e-6) if outside > 0.0 else 0.0, rel=1e-9)
    if unit.size > 0.0:
        whole = unit.whole
        np.testing.assert_allclose(whole.C, qp.C / length[:, None], rtol=1e-12, atol=1e-15)
        for name, part in zip(("lower", "upper", "box_lower", "box_upper"), parts, strict=True):
            np.testing.assert_allclose(getattr(whole, name), part / unit.size, rtol=1e-9, atol=1e-12)


@given(SEEDS)
def test_bounds_out_of_reach_are_left_out(seed: int) -> None:
    """The program within reach has exactly those bounds that are not far beyond its size."""
    unit = UnitProgram.of(program(seed, far=True))
    if unit.size > 0.0:
        whole, near = unit.whole, unit.within_reach
        for name in ("lower", "upper", "box_lower", "box_upper"):
            given_, kept = getattr(whole, name), getattr(near, name)
            reached = np.abs(given_) <= OUT_OF_REACH
            np.testing.assert_array_equal(kept[reached], given_[reached])
            assert np.isinf(kept[~reached]).all()


@pytest.mark.slow
@given(SEEDS, st.floats(-14.0, -1.0))
def test_an_answer_is_fine_only_if_its_natural_residual_is_below_the_tolerance(
    seed: int, digits: float
) -> None:
    """The kernel and `natural_residual`, which is NumPy, agree on answers that are off by any amount."""
    qp = program(seed)
    unit = UnitProgram.of(qp)
    if unit.size == 0.0:
        return
    rng = np.random.default_rng(seed + 1)
    found = solver("daqp")(unit.within_reach, 1e-12)
    x = found.x + 10.0**digits * rng.standard_normal(qp.n)
    off = Solution(x, found.y, found.y_box, Status.SOLVED)
    residual = natural_residual(unit.whole, off)
    code = examined(unit, off, 1e-8)
    largest = max(1.0, float(np.abs(unit.free + unit.size * x).max()))
    asked = SOLVER_SHARE * 1e-8 * min(1.0, largest / unit.size)
    if code == FINE:
        assert residual <= 1.01 * max(asked, 1e-14)
        np.testing.assert_allclose(unit.answer[0], unit.free + unit.size * x, rtol=1e-14)
        np.testing.assert_allclose(
            unit.answer[1][: unit.m] * unit.length[: unit.m], unit.size * found.y, rtol=1e-12
        )
    elif code == COARSE:  # the kernel does not look for other multipliers, which makes the residual larger
        assert residual > 0.2 * asked or residual < np.abs(off.y).max(initial=1.0) * 1e-14


def test_answers_that_break_a_bound_that_was_left_out_or_are_no_numbers_are_not_fine() -> None:
    """A bound beyond reach that x breaks is told, and so are NaN and numbers that have diverged."""
    qp = QuadraticProgram.checked(np.eye(2), [-2.0, 0.0], box_lower=[-5.0, -1e5], box_upper=[1.0, 1e5])
    unit = UnitProgram.of(qp)
    right = Solution(np.array([-1.0, 0.0]), np.zeros(0), np.array([1.0, 0.0]), Status.SOLVED)
    assert examined(unit, right, 1e-8) == FINE
    np.testing.assert_allclose(unit.answer[0], [1.0, 0.0], rtol=1e-15)
    for entry, code in ((2e5, FAR), (np.nan, COARSE), (1e16, COARSE), (np.inf, COARSE), (1e-6, COARSE)):
        wrong = Solution(np.array([-1.0, entry]), right.y, right.y_box, Status.SOLVED)
        assert examined(unit, wrong, 1e-8) == code


@pytest.mark.slow
@given(SEEDS, st.floats(1e-6, 1e6))
def test_the_error_at_unit_size_is_relative_to_the_entries_that_are_asked_for(seed: int, size: float) -> None:
    """The kernel gives what NumPy gives."""
    rng = np.random.default_rng(seed)
    matrix, x = 10.0 * rng.standard_normal((3, 2)), rng.standard_normal(4)
    of_x = 1e-8 * min(1.0, max(1.0, float(np.abs(x).max())) / size)
    assert error_at_unit_size(1e-8, size, NONE, x) == pytest.approx(of_x, rel=1e-12)
    largest = max(1.0, float(np.abs(matrix @ x[:2]).max()))
    of_entries = 1e-8 * min(1.0, largest / (float(np.abs(matrix).sum(axis=1).max()) * size))
    assert error_at_unit_size(1e-8, size, matrix, x) == pytest.approx(of_entries, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["daqp", "quadprog", "proxqp"])
@given(SEEDS)
def test_the_arrays_of_a_program_can_be_used_for_the_next_one(name: str, seed: int) -> None:
    """Two programs in the same arrays, one after the other, have the solutions that they have alone."""
    pytest.importorskip("proxsuite" if name == "proxqp" else name)
    solve = SolverTo(solver(name), 1e-8)
    first, second = program(seed), program(seed)
    second = QuadraticProgram(
        second.H, -second.g, second.C, second.lower, second.upper, second.box_lower, second.box_upper
    )
    alone = solve(second).x
    solve(first)
    last_bits = 1e-13 if name == "proxqp" else 0.0  # those of ProxQP depend on where its memory lies
    np.testing.assert_allclose(solve(second).x, alone, rtol=0.0, atol=last_bits)
