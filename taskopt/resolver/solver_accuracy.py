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
from taskopt.hierarchy.certificate import largest_entry
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import (
    DIVERGED,
    LEAST_ACCURACY,
    OUT_OF_REACH,
    SOLVER_SHARE,
)
from taskopt.resolver.refinement import has_numbers, refined
from taskopt.resolver.unit_kernels import FINE, error_at_unit_size, examine_answer
from taskopt.resolver.unit_program import UnitProgram
from taskopt.solver.base import Solve

SolveProgram = Callable[[QuadraticProgram], Solution]
_NOTHING = np.empty((0, 0))
_SOLVED = Status.SOLVED  # looking it up in the Enum costs as much as a short call
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


class SolverTo:
    """Solves programs with a diagonal H to a given relative accuracy of x.

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
        most: Iterations, over all programs that it solves, after which it starts no other one and returns
            the status ITERATION_LIMIT.
        inverse: Returns the matrix of the entries for which the accuracy is asked, (p, q), inverse · x[:q],
            and is called where a solver is needed; None for x.
        refine: False to take the answers of the solver as they are, with what it claims.
    """

    def __init__(
        self,
        solve: Solve,
        accuracy: float,
        most: float = math.inf,
        inverse: Callable[[], Array] | None = None,
        *,
        refine: bool = True,
    ) -> None:
        self._guarded, self._accuracy = _Guarded(solve, most), accuracy
        self._inverse, self._refine = inverse, refine

    def __call__(self, qp: QuadraticProgram) -> Solution:
        """Solve one program.

        Args:
            qp: The program; H must be diagonal and positive.

        Returns:
            The solution, in the units of that program.
        """
        unit = UnitProgram.of(qp)
        if unit.size == 0.0:
            return Solution(unit.free, np.zeros(unit.m), np.zeros(qp.n), Status.SOLVED)
        return self.at_unit_size(unit)

    def at_unit_size(self, unit: UnitProgram) -> Solution:
        """Solve a program that has been scaled.

        Args:
            unit: The program at unit size; its size must not be zero.

        Returns:
            The solution, in the units of the program that was scaled. Its arrays may be those of `unit`.
        """
        tolerance = SOLVER_SHARE * self._accuracy * unit.least
        raw = self._guarded.raw(unit.within_reach, tolerance)
        entries = _NOTHING if self._inverse is None else self._inverse()
        wanted = (self._accuracy if self._refine else math.inf), entries
        code = examine_answer(unit.H, unit.arrays, unit.near, unit.size, _numbers(raw), wanted, unit.answer)
        if code == FINE:
            x, y, y_box = unit.answer
            status = _SOLVED if self._refine else raw.status
            return Solution(x, y[: unit.m], y_box, status, raw.iterations)
        return self._in_steps(unit, raw, tolerance, entries)

    def _in_steps(self, unit: UnitProgram, first: Solution, tolerance: float, entries: Array) -> Solution:
        """Put back bounds that the first answer breaks, and refine what misses the accuracy."""
        whole, size = unit.whole, unit.size
        found = _solve_within_reach(self._guarded, whole, tolerance, sound(first))
        if self._refine:
            x = unit.free + size * found.x
            asked = error_at_unit_size(self._accuracy, size, entries, x)
            found = refined(partial(_solve_within_reach, self._guarded), whole, found, asked)
        x, y = unit.free + size * found.x, size * found.y / unit.length[: unit.m]
        return Solution(x, y, size * found.y_box, found.status, found.iterations)


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
        """Solve a program of unit size."""
        return sound(self.raw(qp, accuracy))

    def raw(self, qp: QuadraticProgram, accuracy: float) -> Solution:
        """Solve a program of unit size, and return whatever numbers the solver returns."""
        if self.spent >= self.most:
            nothing = np.full(qp.n + len(qp.C), np.nan)
            x = nothing[: qp.n]
            return Solution(x, nothing[qp.n :], x, Status.ITERATION_LIMIT)
        found = self.solve(qp, accuracy)
        self.spent += found.iterations
        return found


def sound(found: Solution) -> Solution:
    """Replace an answer at unit size that is larger than rounding allows, since it has diverged.

    Args:
        found: Answer of a solver.

    Returns:
        The same answer, or one of NaN that does not claim to be solved.
    """
    numbers = _numbers(found)
    if all(largest_entry(part) < DIVERGED for part in numbers):
        return found
    x, y, y_box = (np.full_like(part, np.nan) for part in numbers)
    status = Status.FAILED if found.status is Status.SOLVED else found.status
    return Solution(x, y, y_box, status, found.iterations)


def _numbers(found: Solution) -> tuple[Array, Array, Array]:
    """Return x, y and y_box of an answer in the form that kernels are compiled for."""
    return (
        np.ascontiguousarray(found.x, dtype=np.float64),
        np.ascontiguousarray(found.y, dtype=np.float64),
        np.ascontiguousarray(found.y_box, dtype=np.float64),
    )


def _solve_within_reach(
    solve: Solve, qp: QuadraticProgram, accuracy: float, first: Solution | None = None
) -> Solution:
    """Solve a program of unit size without the bounds that its x does not reach; `first` was found so."""
    bounds = [qp.lower, qp.upper, qp.box_lower, qp.box_upper]
    free = [-np.inf, np.inf, -np.inf, np.inf]
    near = [np.abs(bound) <= OUT_OF_REACH for bound in bounds]
    iterations = 0
    while True:
        if first is None:
            kept = (np.where(*part) for part in zip(near, bounds, free, strict=True))
            first = solve(replace(qp, **dict(zip(_BOUNDS, kept, strict=True))), accuracy)
        found, first = first, None
        iterations += found.iterations
        if not has_numbers(found):
            return replace(found, iterations=iterations)
        value = qp.C @ found.x
        broken = [value < qp.lower, value > qp.upper, found.x < qp.box_lower, found.x > qp.box_upper]
        if not any((out & ~held).any() for out, held in zip(broken, near, strict=True)):
            return replace(found, iterations=iterations)
        near = [held | out for held, out in zip(near, broken, strict=True)]
