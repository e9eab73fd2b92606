"""From the accuracy wanted in x to what a solver is asked for: its size, its tolerance.

Where the active set is right, error ≤ dual residual / λ_min(H), so a solver's tolerance is a claim
about x only once H and the size of x are known. Every program is therefore solved at unit size.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from taskopt.arrays import finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.tolerances import SMALLEST_VELOCITY
from taskopt.solver.registry import Solver

_MARGIN = 1e-3  # solvers measure residuals in their own scaling, and stop at the first that is small enough

Solve = Callable[[QuadraticProgram], Solution]


def checked_accuracy(value: float) -> float:
    """A relative accuracy that double precision can give; raise `InvalidValue` otherwise."""
    accuracy = float(finite("accuracy", value, ()))
    if not 1e-13 <= accuracy < 1.0:
        raise InvalidValue(f"accuracy must be in [1e-13, 1), got {accuracy:g}")
    return accuracy


def solve_to(engine: Solver, accuracy: float) -> Solve:
    """The solver at unit size, for programs with a diagonal H; x is to be right to `accuracy` of its size."""

    def solve(qp: QuadraticProgram) -> Solution:
        size = _size(qp)
        tolerance = _MARGIN * accuracy * min(1.0, float(np.diagonal(qp.H).min(initial=1.0)))
        unit = replace(
            qp,
            g=qp.g / size,
            lower=qp.lower / size,
            upper=qp.upper / size,
            box_lower=qp.box_lower / size,
            box_upper=qp.box_upper / size,
        )
        found = engine(unit, tolerance)
        return replace(found, x=size * found.x, y=size * found.y, y_box=size * found.y_box)

    return solve


def _size(qp: QuadraticProgram) -> float:
    """How large x is about to be: the largest entry that costs or equalities ask for."""
    equal = qp.equality
    asked = max(float(np.abs(qp.g).max(initial=0.0)), float(np.abs(qp.upper[equal]).max(initial=0.0)))
    return max(asked, SMALLEST_VELOCITY) if asked > 0.0 else 1.0
