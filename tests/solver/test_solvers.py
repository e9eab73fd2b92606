"""Every solver of the table, held to its row: optimum, multipliers, infeasibility, empty parts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.errors import NotInstalled, UnknownName
from taskopt.hierarchy.qp import QuadraticProgram, Solution, kkt_residuals
from taskopt.hierarchy.status import Status
from taskopt.solver.registry import Solver, solver, solvers

INSTALLED = [row for row in solvers() if row.installed]
EXACT = [row for row in INSTALLED if row.accuracy <= 1e-6]


def random_program(seed: int, feasible: bool = True) -> QuadraticProgram:
    """Strictly convex; equality, one- and two-sided rows, a box with an open side; rows 4, 5 may clash."""
    rng = np.random.default_rng(seed)
    n, m = 5, 6
    L = rng.normal(size=(n, n))
    inside = rng.uniform(-0.5, 0.5, n)
    C = rng.normal(size=(m, n))
    value = C @ inside
    lower, upper = value - rng.uniform(0.0, 1.0, m), value + rng.uniform(0.0, 1.0, m)
    lower[0] = upper[0] = value[0]
    lower[1], upper[2] = -np.inf, np.inf
    if not feasible:
        C[4] = C[5]
        lower[4] = upper[5] + 0.5
        upper[4] = lower[4] + 1.0
    box = np.ones(n)
    return QuadraticProgram.checked(
        L.T @ L + 0.1 * np.eye(n), 3.0 * rng.normal(size=n), C, lower, upper, -box, np.append(box[1:], np.inf)
    )


@pytest.mark.parametrize("engine", EXACT, ids=lambda row: row.name)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_optimum_and_multipliers_are_as_accurate_as_the_table_says(engine: Solver, seed: int) -> None:
    """All four KKT residuals, ours, stay below the accuracy in the solver's row."""
    qp = random_program(seed)
    solution = engine(qp)
    assert solution.status is Status.SOLVED
    assert max(kkt_residuals(qp, solution)) < engine.accuracy


@pytest.mark.parametrize("engine", EXACT, ids=lambda row: row.name)
def test_all_solvers_find_one_optimum(engine: Solver) -> None:
    """A strictly convex program has one optimum, so solvers differ by no more than they promise."""
    reference = solver("daqp")
    for seed in range(20):
        qp = random_program(seed)
        apart = np.abs(engine(qp).x - reference(qp).x).max()
        assert apart < 1e2 * engine.accuracy / np.linalg.eigvalsh(qp.H)[0]


@pytest.mark.parametrize("engine", INSTALLED, ids=lambda row: row.name)
def test_contradicting_rows_are_never_solved(engine: Solver) -> None:
    """a x ≤ 1 and a x ≥ 1.5: whoever can prove it says INFEASIBLE, nobody says SOLVED."""
    for seed in range(5):
        status = engine(random_program(seed, feasible=False)).status
        assert status is Status.INFEASIBLE if engine.proves_infeasible else status is not Status.SOLVED


@pytest.mark.parametrize("engine", EXACT, ids=lambda row: row.name)
def test_no_rows_no_box_is_the_unconstrained_minimum(engine: Solver) -> None:
    """Empty parts are no special case: H x = −g."""
    H = np.array([[2.0, 0.5], [0.5, 1.0]])
    g = np.array([-1.0, 3.0])
    solution = engine(QuadraticProgram.checked(H, g))
    np.testing.assert_allclose(solution.x, np.linalg.solve(H, -g), atol=1e-7)
    assert solution.y.shape == (0,)


@pytest.mark.parametrize("engine", EXACT, ids=lambda row: row.name)
def test_the_side_of_a_bound_gives_the_sign_of_its_multiplier(engine: Solver) -> None:
    """min ½x² + ½z² pushed against x ≤ −1 and z ≥ 2: y_x = 1 > 0 above, y_z = −2 < 0 below."""
    qp = QuadraticProgram.checked(np.eye(2), np.zeros(2), box_lower=[-np.inf, 2.0], box_upper=[-1.0, np.inf])
    solution = engine(qp)
    np.testing.assert_allclose(solution.y_box, [1.0, -2.0], atol=1e-6)
    rows = QuadraticProgram.checked(
        np.eye(2), np.zeros(2), np.eye(2), lower=[-np.inf, 2.0], upper=[-1.0, np.inf]
    )
    np.testing.assert_allclose(engine(rows).y, [1.0, -2.0], atol=1e-6)


@pytest.mark.parametrize("engine", EXACT, ids=lambda row: row.name)
def test_the_order_of_arrays_in_memory_does_not_matter(engine: Solver) -> None:
    """The same program with column-major H and C has the same optimum."""
    qp = random_program(3)
    parts = (qp.g, np.asfortranarray(qp.C), qp.lower, qp.upper, qp.box_lower, qp.box_upper)
    turned = QuadraticProgram(np.asfortranarray(qp.H), *parts)
    np.testing.assert_allclose(engine(turned).x, engine(qp).x, atol=1e-7)


def test_a_wrong_sign_is_caught() -> None:
    """min ½x² s.t. x ≤ 1 with x = 1, y = −1: stationary and feasible, but no optimum."""
    qp = QuadraticProgram.checked([[1.0]], [0.0], box_upper=[1.0])
    lie = Solution(np.ones(1), np.empty(0), -np.ones(1), Status.SOLVED)
    assert max(kkt_residuals(qp, lie)) > 0.1


@pytest.mark.parametrize(
    ("x", "y", "which"), [(0.5, 0.0, 0), (2.0, -2.0, 1), (1.0, -1.0, 2), (0.5, -0.5, 2), (-1.0, 1.0, 3)]
)
def test_each_residual_catches_its_own_lie(x: float, y: float, which: int) -> None:
    """Minimise ½x² subject to x ≤ 1; the optimum is (0, 0)."""
    qp = QuadraticProgram.checked([[1.0]], [0.0], box_upper=[1.0])
    assert kkt_residuals(qp, Solution(np.array([x]), np.empty(0), np.array([y]), Status.SOLVED))[which] > 0.1


def test_not_a_number_is_no_answer() -> None:
    """NaN anywhere makes every residual infinite."""
    qp = QuadraticProgram.checked([[1.0]], [0.0])
    assert (
        kkt_residuals(qp, Solution(np.array([np.nan]), np.empty(0), np.zeros(1), Status.SOLVED))
        == (np.inf,) * 4
    )


def test_unknown_solvers_get_the_nearest_match() -> None:
    """A mistyped name is answered with the name that was meant."""
    with pytest.raises(UnknownName, match="did you mean daqp"):
        solver("dapq")


def test_a_missing_package_comes_with_the_line_that_installs_it() -> None:
    """A row of the table whose package cannot be imported says how to get it."""
    absent = Solver("nowhere", "none", 1.0, "no_such_package", "no-such-package")
    with pytest.raises(NotInstalled, match="pip install no-such-package"):
        absent(random_program(0))
