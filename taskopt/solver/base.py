"""The protocol of a solver: one function from a quadratic program to a solution."""

from typing import Protocol

from taskopt.hierarchy.qp import QuadraticProgram, Solution


class Solve(Protocol):
    """A function that solves one convex quadratic program.

    It must not change the arrays of the program, and must not keep anything from one call to the next. The
    status is what the solver claims; whoever calls it checks the claim. `taskopt.testing.check_solver` runs
    these promises on any implementation.
    """

    def __call__(self, qp: QuadraticProgram, accuracy: float) -> Solution:
        """Solve min ½ xᵀ H x + gᵀ x subject to lower ≤ C x ≤ upper and box_lower ≤ x ≤ box_upper.

        Args:
            qp: The program. Equalities are rows with lower = upper; a bound of ±inf is no bound.
            accuracy: Largest KKT residual that is asked for, relative to max(1, largest term).

        Returns:
            x with the multipliers y of the rows and y_box of the box, in the sign convention
            H x + g + Cᵀ y + y_box = 0, so that a multiplier is positive at an upper bound.
        """
        ...
