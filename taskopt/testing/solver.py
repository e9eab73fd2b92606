"""The check of a solver, on random programs and on programs whose optimum is known."""

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.qp import QuadraticProgram, Solution, kkt_residuals
from taskopt.hierarchy.status import Status
from taskopt.solver.base import Solve, fault_of_solution
from taskopt.testing.sampling import require

_ASKED = 1e-10  # KKT residual that the solver is asked for


def check_solver(
    solve: Solve, *, accuracy: float = 1e-8, proves_infeasible: bool = False, count: int = 20, seed: int = 0
) -> None:
    """Check that a solver fulfils the contract of `taskopt.solver.base.Solve`.

    - It returns a `Solution` with a `Status`, and with arrays of the right shapes.
    - Programs with equalities, one- and two-sided rows, rows without bounds and an open box are solved: it
      claims SOLVED, and the KKT residuals that we compute from x and its multipliers are small.
    - Programs without rows, without a box, or without both are solved, too.
    - A multiplier is positive at an upper bound and negative at a lower one.
    - It never claims SOLVED for a program whose rows contradict each other.
    - The order of arrays in memory does not matter, and the arrays of the program are not changed.
    - The same program gives the same answer again, so that nothing is kept from one call to the next.

    Args:
        solve: The solver.
        accuracy: Largest KKT residual that is accepted, relative to max(1, largest term).
        proves_infeasible: True if the solver must claim INFEASIBLE for infeasible programs; False if it may
            give up.
        count: Number of random programs.
        seed: Seed of the first program; the others follow.

    Raises:
        AssertionError: Something does not hold; the message says what, for which seed, and by how much.
    """
    solve = _of_right_form(solve)
    for index in range(seed, seed + count):
        qp = random_program(index)
        before = [part.copy() for part in _parts(qp)]
        first = solve(qp, _ASKED)
        unchanged = all(np.array_equal(a, b) for a, b in zip(before, _parts(qp), strict=True))
        require(unchanged, f"the solver changed the arrays of random program {index}")
        _check_optimum(qp, first, accuracy, f"random program {index}")
        again = solve(qp, _ASKED)
        distance = float(np.abs(first.x - again.x).max())
        sentence = f"solved a second time, random program {index} has an answer that is {distance:.1e} away"
        require(distance <= 10.0 * accuracy, sentence)
    _check_empty_parts(solve, accuracy)
    _check_signs(solve, accuracy)
    _check_order_in_memory(solve, accuracy)
    for index in range(seed, seed + max(1, count // 4)):
        status = solve(random_program(index, feasible=False), _ASKED).status
        claim = f"the solver claims {status.name} of random program {index}, whose rows contradict each other"
        require(status is Status.INFEASIBLE if proves_infeasible else status is not Status.SOLVED, claim)


def random_program(seed: int, feasible: bool = True) -> QuadraticProgram:
    """Make a strictly convex program of 5 unknowns and 7 rows.

    Row 0 is an equality, row 1 has no lower bound, row 2 no upper bound, and row 3 no bound at all; the box
    is open on one side.

    Args:
        seed: Seed of its numbers.
        feasible: True for a program with a solution; False for one in which rows 4 and 5 contradict each
            other.

    Returns:
        The program.
    """
    rng = np.random.default_rng(seed)
    n, m = 5, 7
    L = rng.normal(size=(n, n))
    inside = rng.uniform(-0.5, 0.5, n)
    C = rng.normal(size=(m, n))
    value = C @ inside
    lower, upper = value - rng.uniform(0.0, 1.0, m), value + rng.uniform(0.0, 1.0, m)
    lower[0] = upper[0] = value[0]
    lower[1], upper[2] = -np.inf, np.inf
    lower[3], upper[3] = -np.inf, np.inf
    if not feasible:
        C[4] = C[5]
        lower[4] = upper[5] + 0.5
        upper[4] = lower[4] + 1.0
    box, H = np.ones(n), L.T @ L + 0.1 * np.eye(n)
    g = 3.0 * rng.normal(size=n)
    return QuadraticProgram.checked(H, g, C, lower, upper, -box, np.append(box[1:], np.inf))


def _of_right_form(solve: Solve) -> Solve:
    """Return the solver with a check of the form of each of its answers."""

    def checking(qp: QuadraticProgram, accuracy: float) -> Solution:
        found = solve(qp, accuracy)
        fault = fault_of_solution(found, qp)
        require(not fault, f"the solver {fault}")
        return found

    return checking


def _parts(qp: QuadraticProgram) -> tuple[Array, ...]:
    """Return the arrays of a program."""
    return qp.H, qp.g, qp.C, qp.lower, qp.upper, qp.box_lower, qp.box_upper


def _check_optimum(qp: QuadraticProgram, solution: Solution, accuracy: float, where: str) -> None:
    """Require a claim of SOLVED and small KKT residuals."""
    require(solution.status is Status.SOLVED, f"the solver claims {solution.status.name} of {where}")
    residuals = kkt_residuals(qp, solution)
    names = ("stationarity", "primal", "dual", "complementarity")
    worst = int(np.argmax(residuals))
    sentence = f"{names[worst]} of {where} is {residuals[worst]:.1e}, more than {accuracy:.1e}"
    require(residuals[worst] <= accuracy, sentence)


def _check_empty_parts(solve: Solve, accuracy: float) -> None:
    """Require the minimum without rows and box, x = −H⁻¹ g, and optima with only one of them."""
    H, g = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([-1.0, 3.0])
    free = QuadraticProgram.checked(H, g)
    solution = solve(free, _ASKED)
    _check_optimum(free, solution, accuracy, "a program without rows and box")
    distance = float(np.abs(solution.x - np.linalg.solve(H, -g)).max())
    require(distance <= 10.0 * accuracy, f"without rows and box x is off by {distance:.1e}")
    boxed = QuadraticProgram.checked(H, g, box_lower=[-1.0, -1.0], box_upper=[1.0, 1.0])
    _check_optimum(boxed, solve(boxed, _ASKED), accuracy, "a program without rows")
    rows = QuadraticProgram.checked(H, g, [[1.0, 1.0]], [0.0], [0.0])
    _check_optimum(rows, solve(rows, _ASKED), accuracy, "a program with one equality and no box")


def _check_signs(solve: Solve, accuracy: float) -> None:
    """Require y = (1, −2) where ½ ‖x‖² is pushed against x₀ ≤ −1 and x₁ ≥ 2, as a box and as rows."""
    lower, upper, zero = [-np.inf, 2.0], [-1.0, np.inf], np.zeros(2)
    boxed = solve(QuadraticProgram.checked(np.eye(2), zero, box_lower=lower, box_upper=upper), _ASKED)
    rows = solve(QuadraticProgram.checked(np.eye(2), zero, np.eye(2), lower, upper), _ASKED)
    for y, what in ((boxed.y_box, "the box"), (rows.y, "the rows")):
        right = float(np.abs(y - [1.0, -2.0]).max()) <= max(1e-6, 100.0 * accuracy)
        require(right, f"multipliers of {what} must be (1, -2): positive at an upper bound, got {y}")


def _check_order_in_memory(solve: Solve, accuracy: float) -> None:
    """Require the same optimum for column-major arrays."""
    qp = random_program(3)
    rest = (qp.lower, qp.upper, qp.box_lower, qp.box_upper)
    turned = QuadraticProgram(np.asfortranarray(qp.H), qp.g, np.asfortranarray(qp.C), *rest)
    _check_optimum(qp, solve(turned, _ASKED), accuracy, "a program with column-major arrays")
