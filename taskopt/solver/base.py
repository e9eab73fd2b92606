"""The protocol of a solver, which is a function from a quadratic program to a solution."""

from typing import Protocol

import numpy as np

from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status


class Solve(Protocol):
    """A function that solves one convex quadratic program.

    It must not change the arrays of the program, and must not keep anything from one call to the next. The
    status is a claim of the solver, which the caller checks. `taskopt.testing.check_solver` tests these
    promises on any implementation.
    """

    def __call__(self, qp: QuadraticProgram, accuracy: float) -> Solution:
        """Solve min ½ xᵀ H x + gᵀ x subject to lower ≤ C x ≤ upper and box_lower ≤ x ≤ box_upper.

        Args:
            qp: The program. Equalities are rows with lower = upper; a bound of ±inf means that there is none.
            accuracy: Largest KKT residual that is asked for, relative to max(1, largest term).

        Returns:
            x with the multipliers y of the rows and y_box of the box, in the sign convention
            H x + g + Cᵀ y + y_box = 0, so that a multiplier is positive at an upper bound.
        """
        ...


def fault_of_solution(found: object, qp: QuadraticProgram) -> str:
    """Describe the fault in the form of a solver's result; its numbers are not checked.

    Args:
        found: The object that a solver returned.
        qp: The program that it was given.

    Returns:
        End of a sentence that says what was found and what was expected; "" for a `Solution` with a `Status`
        and with arrays of the right shapes.
    """
    if not isinstance(found, Solution):
        return f"returned {type(found).__name__} instead of a taskopt.Solution(x, y, y_box, status)"
    if not isinstance(found.status, Status):
        return f"returned the status {found.status!r} instead of a taskopt.Status, such as Status.SOLVED"
    sizes = {"x": qp.n, "y": len(qp.C), "y_box": qp.n}
    for name, part in (("x", found.x), ("y", found.y), ("y_box", found.y_box)):
        if not isinstance(part, np.ndarray):
            return f"returned {name} as {type(part).__name__} instead of an array of shape ({sizes[name]},)"
        if part.shape != (sizes[name],):
            return f"returned {name} of shape {part.shape} instead of ({sizes[name]},)"
    return ""
