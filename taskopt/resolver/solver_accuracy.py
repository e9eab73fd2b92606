"""Conversion of a requested accuracy of x to a tolerance of a solver, and scaling of programs to unit size.

If the active set is right, the error of x is at most the dual residual divided by the least eigenvalue of H.
The tolerance of a solver therefore bounds the error of x only if H and the size of x are known. The cascade
of `hqp` and the weighted problem both solve their programs through this module.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from taskopt.arrays import Array, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import (
    DIVERGED,
    LEAST_ACCURACY,
    OUT_OF_REACH,
    SMALLEST_VELOCITY,
    SOLVER_SHARE,
)
from taskopt.resolver.refinement import has_numbers, refined
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


def solve_to(
    solve: Solve,
    accuracy: float,
    most: float = math.inf,
    inverse: Array | None = None,
    *,
    refine: bool = True,
) -> SolveProgram:
    """Make a function that solves programs with a diagonal H to a given relative accuracy of x.

    The unknowns are counted from the optimum without any bound, −H⁻¹ g, which leaves no linear term: rounding
    errors in g are no scale then. If it keeps all bounds, it is the optimum. Otherwise rows are divided by
    their length, and bounds by the largest distance of that point to them, so that what is left has about
    size one. Bounds far beyond that size are left out first, whatever the solver, and those that the answer
    breaks are put back. An answer that keeps all of them is the optimum with them, too. The tolerance is
    `SOLVER_SHARE` · accuracy · min(1, least entry of H). Answers that miss the accuracy are refined, and what
    is missed even so is not claimed, see `taskopt.resolver.refinement`.

    Args:
        solve: A solver.
        accuracy: Accuracy of x that is asked for, relative to its largest entry, or to one if that is more.
        most: Iterations, over all programs that the function solves, after which it starts no other one and
            returns the status ITERATION_LIMIT.
        inverse: Matrix of the entries for which the accuracy is asked, (p, n), inverse · x; None for x.
        refine: False to take the answers of the solver as they are, with what it claims.

    Returns:
        A function from a program to its solution, in the units of that program.
    """
    within_reach = partial(_solve_within_reach, _Guarded(solve, most))
    gain = 1.0 if inverse is None else float(np.abs(inverse).sum(axis=1).max(initial=0.0))

    def solve_at_unit_size(qp: QuadraticProgram) -> Solution:
        """Solve for the distance from the free optimum, at unit size."""
        diagonal = np.diagonal(qp.H)
        free = -qp.g / diagonal
        unit, length, size = _around(qp, free)
        if size == 0.0:
            return Solution(free, np.zeros(len(length)), np.zeros(qp.n), Status.SOLVED)
        tolerance = SOLVER_SHARE * accuracy * min(1.0, float(diagonal.min(initial=1.0)))
        found = within_reach(unit, tolerance)
        x = free + size * found.x
        wanted = x if inverse is None else inverse @ x[: inverse.shape[1]]
        largest = max(1.0, float(np.abs(wanted).max(initial=0.0)))
        if refine:
            found = refined(within_reach, unit, found, accuracy * min(1.0, largest / (gain * size)))
        return replace(found, x=free + size * found.x, y=size * found.y / length, y_box=size * found.y_box)

    return solve_at_unit_size


@dataclass
class _Guarded:
    """A solver whose iterations are limited, and whose answers are numbers or NaN.

    Attributes:
        solve: The solver.
        most: Iterations after which no other program is started.
        spent: Iterations so far.
    """

    solve: Solve
    most: float
    spent: int = 0

    def __call__(self, qp: QuadraticProgram, accuracy: float) -> Solution:
        """Solve a program of unit size; an answer that is larger than rounding allows has diverged."""
        if self.spent >= self.most:
            return _nothing(qp, Status.ITERATION_LIMIT)
        found = self.solve(qp, accuracy)
        self.spent += found.iterations
        if all(bool((np.abs(part) < DIVERGED).all()) for part in (found.x, found.y, found.y_box)):
            return found
        status = Status.FAILED if found.status is Status.SOLVED else found.status
        return _nothing(qp, status, found.iterations)


def _nothing(qp: QuadraticProgram, status: Status, iterations: int = 0) -> Solution:
    """Return an answer of NaN."""
    x = np.full(qp.n, np.nan)
    return Solution(x, np.full(len(qp.C), np.nan), x, status, iterations)


def _around(qp: QuadraticProgram, free: Array) -> tuple[QuadraticProgram, Array, float]:
    """Return the program in (x − free) / size with rows of length one, the lengths (m,), and the size.

    The size is the largest distance of the free optimum to an interval; 0 if it is inside all of them.
    """
    length = np.linalg.norm(qp.C, axis=1)
    length[length == 0.0] = 1.0
    value = qp.C @ free
    rows = (qp.lower - value) / length, (qp.upper - value) / length
    bounds = [*rows, qp.box_lower - free, qp.box_upper - free]
    outside = np.concatenate([bounds[0], -bounds[1], bounds[2], -bounds[3]]).max(initial=0.0)
    size = max(float(outside), SMALLEST_VELOCITY) if outside > 0.0 else 0.0
    scaled = {name: bound / (size or 1.0) for name, bound in zip(_BOUNDS, bounds, strict=True)}
    return replace(qp, g=np.zeros(qp.n), C=qp.C / length[:, None], **scaled), length, size


def _solve_within_reach(solve: Solve, qp: QuadraticProgram, accuracy: float) -> Solution:
    """Solve a program of unit size without the bounds that its x does not reach."""
    bounds = [qp.lower, qp.upper, qp.box_lower, qp.box_upper]
    free = [-np.inf, np.inf, -np.inf, np.inf]
    near = [np.abs(bound) <= OUT_OF_REACH for bound in bounds]
    iterations = 0
    while True:
        kept = (np.where(*part) for part in zip(near, bounds, free, strict=True))
        found = solve(replace(qp, **dict(zip(_BOUNDS, kept, strict=True))), accuracy)
        iterations += found.iterations
        if not has_numbers(found):
            return replace(found, iterations=iterations)
        value = qp.C @ found.x
        broken = [value < qp.lower, value > qp.upper, found.x < qp.box_lower, found.x > qp.box_upper]
        if not any((out & ~held).any() for out, held in zip(broken, near, strict=True)):
            return replace(found, iterations=iterations)
        near = [held | out for held, out in zip(near, broken, strict=True)]
