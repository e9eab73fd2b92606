"""Conversion of a requested accuracy of x to a tolerance of a solver, and scaling of programs to unit size.

If the active set is right, the error of x is at most the dual residual divided by the least eigenvalue of H.
The tolerance of a solver therefore bounds the error of x only if H and the size of x are known. The cascade
of `hqp` and the weighted problem both solve their programs through this module.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from taskopt.arrays import finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.tolerances import LEAST_ACCURACY, SMALLEST_VELOCITY, SOLVER_SHARE
from taskopt.solver.base import Solve

SolveProgram = Callable[[QuadraticProgram], Solution]


def checked_accuracy(value: float) -> float:
    """Check that double precision can give a relative accuracy, and return it.

    Args:
        value: Accuracy of x, relative to its largest entry.

    Returns:
        The same number as a float.

    Raises:
        InvalidValue: The value is not a number in [1e-13, 1).
    """
    accuracy = float(finite("accuracy", value, ()))
    if not LEAST_ACCURACY <= accuracy < 1.0:
        raise InvalidValue(f"accuracy must be in [{LEAST_ACCURACY:g}, 1), got {accuracy:g}")
    return accuracy


def solve_to(solve: Solve, accuracy: float) -> SolveProgram:
    """Make a function that solves programs with a diagonal H to a given relative accuracy of x.

    Gradient and bounds are divided by the expected size of x, so that the scaled x has about size one. The
    tolerance is `SOLVER_SHARE` · accuracy · min(1, least entry of H).

    Args:
        solve: A solver.
        accuracy: Requested accuracy of x, relative to its largest entry.

    Returns:
        A function from a program to its solution, in the units of that program.
    """

    def solve_at_unit_size(qp: QuadraticProgram) -> Solution:
        """Divide the program by its size, solve it, and multiply the solution."""
        size = _expected_size(qp)
        tolerance = SOLVER_SHARE * accuracy * min(1.0, float(np.diagonal(qp.H).min(initial=1.0)))
        unit = replace(
            qp,
            g=qp.g / size,
            lower=qp.lower / size,
            upper=qp.upper / size,
            box_lower=qp.box_lower / size,
            box_upper=qp.box_upper / size,
        )
        found = solve(unit, tolerance)
        return replace(found, x=size * found.x, y=size * found.y, y_box=size * found.y_box)

    return solve_at_unit_size


def _expected_size(qp: QuadraticProgram) -> float:
    """Return the largest entry of the gradient and of the equalities, 1 if all of them are zero."""
    equal = qp.equality
    largest = max(float(np.abs(qp.g).max(initial=0.0)), float(np.abs(qp.upper[equal]).max(initial=0.0)))
    return max(largest, SMALLEST_VELOCITY) if largest > 0.0 else 1.0
