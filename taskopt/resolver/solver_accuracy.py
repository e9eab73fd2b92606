"""Conversion of a requested accuracy of x to a tolerance of a solver, and scaling of programs to unit size.

If the active set is right, the error of x is at most the dual residual divided by the least eigenvalue of H.
The tolerance of a solver therefore bounds the error of x only if H and the size of x are known. The cascade
of `hqp` and the weighted problem both solve their programs through this module.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from taskopt.arrays import Array, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.tolerances import LEAST_ACCURACY, OUT_OF_REACH, SMALLEST_VELOCITY, SOLVER_SHARE
from taskopt.solver.base import Solve

SolveProgram = Callable[[QuadraticProgram], Solution]
_BOUNDS = ("lower", "upper", "box_lower", "box_upper")


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

    The unknowns are counted from the optimum without any bound, −H⁻¹ g, which leaves no linear term: rounding
    errors in g are no scale then. Rows are divided by their length, and bounds by the largest distance of
    that point to them, so that what is left has about size one. Bounds far beyond that size are left out
    first, whatever the solver, and those that the answer breaks are put back. An answer that keeps all of
    them is the optimum with them, too. The tolerance is `SOLVER_SHARE` · accuracy ·
    min(1, least entry of H).

    Args:
        solve: A solver.
        accuracy: Requested accuracy of x, relative to its largest entry.

    Returns:
        A function from a program to its solution, in the units of that program.
    """

    def solve_at_unit_size(qp: QuadraticProgram) -> Solution:
        """Solve for the distance from the free optimum, at unit size."""
        diagonal = np.diagonal(qp.H)
        free = -qp.g / diagonal
        unit, length, size = _around(qp, free)
        tolerance = SOLVER_SHARE * accuracy * min(1.0, float(diagonal.min(initial=1.0)))
        found = _solve_within_reach(solve, unit, tolerance)
        return replace(found, x=free + size * found.x, y=size * found.y / length, y_box=size * found.y_box)

    return solve_at_unit_size


def _around(qp: QuadraticProgram, free: Array) -> tuple[QuadraticProgram, Array, float]:
    """Return the program in (x − free) / size with rows of length one, the lengths (m,), and the size.

    The size is the largest distance of the free optimum to an interval; 1 if it is inside all of them.
    """
    length = np.linalg.norm(qp.C, axis=1)
    length[length == 0.0] = 1.0
    value = qp.C @ free
    rows = (qp.lower - value) / length, (qp.upper - value) / length
    bounds = [*rows, qp.box_lower - free, qp.box_upper - free]
    outside = np.concatenate([bounds[0], -bounds[1], bounds[2], -bounds[3]]).max(initial=0.0)
    size = max(float(outside), SMALLEST_VELOCITY) if outside > 0.0 else 1.0
    scaled = {name: bound / size for name, bound in zip(_BOUNDS, bounds, strict=True)}
    return replace(qp, g=np.zeros(qp.n), C=qp.C / length[:, None], **scaled), length, size


def _solve_within_reach(solve: Solve, unit: QuadraticProgram, tolerance: float) -> Solution:
    """Solve a program of unit size without the bounds that its x does not reach."""
    bounds = [unit.lower, unit.upper, unit.box_lower, unit.box_upper]
    free = [-np.inf, np.inf, -np.inf, np.inf]
    near = [np.abs(bound) <= OUT_OF_REACH for bound in bounds]
    iterations = 0
    while True:
        kept = (np.where(*part) for part in zip(near, bounds, free, strict=True))
        found = solve(replace(unit, **dict(zip(_BOUNDS, kept, strict=True))), tolerance)
        iterations += found.iterations
        value = unit.C @ found.x
        broken = [value < unit.lower, value > unit.upper, found.x < unit.box_lower, found.x > unit.box_upper]
        if not any((out & ~held).any() for out, held in zip(broken, near, strict=True)):
            return replace(found, iterations=iterations)
        near = [held | out for held, out in zip(near, broken, strict=True)]
