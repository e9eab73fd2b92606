"""Exact answers to compare with: rational arithmetic for small problems, our proof for larger ones."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array
from taskopt.bench.exact import as_floats, exact_optimum
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof import Judge
from taskopt.resolver.active_set.polish import polish
from taskopt.resolver.infeasible import limits_agree
from taskopt.resolver.registry import resolver

LARGEST_RATIONAL = 8  # unknowns; rational arithmetic takes about a tenth of a second at this size
_MOST_ROWS = 24
_CANDIDATES = ("active-set", "hqp/daqp", "hqp/clarabel")


@dataclass(frozen=True, eq=False)
class Reference:
    """The exact optimum of a problem, as far as it is known, and the judges of answers to it.

    Attributes:
        problem: The problem.
        kind: "rational", "proof", "infeasible" if its hard limits contradict each other, or "none".
        x: The optimum, (n,); NaN for "infeasible" and "none".
        error: Bound on the error of x, largest entry; inf for "none".
        judges: Judges by the numbers of the problem that they judge answers to; each keeps its proofs.
    """

    problem: Hierarchy
    kind: str
    x: Array
    error: float
    judges: dict[bytes, Judge] = field(default_factory=dict)

    def judge(self, stated: Hierarchy) -> Judge:
        """Return the judge of answers to the problem that a resolver states, another one for weights.

        Args:
            stated: The problem.

        Returns:
            The same judge for the same numbers.
        """
        key = stated.buffer.tobytes()
        if key not in self.judges:
            self.judges[key] = Judge(stated)
        return self.judges[key]

    def distance(self, x: Array) -> float:
        """Return ‖x − x*‖∞ relative to max(1, ‖x*‖∞); inf if x is not finite, NaN if x* is not known.

        Args:
            x: An answer, (n,).

        Returns:
            The distance.
        """
        if self.kind in ("infeasible", "none"):
            return np.nan
        if not np.isfinite(x).all():
            return np.inf
        return float(np.abs(x - self.x).max() / max(1.0, np.abs(self.x).max()))


def reference(problem: Hierarchy) -> Reference:
    """Find the exact optimum of a problem.

    Args:
        problem: The problem.

    Returns:
        The reference.
    """
    nothing = np.full(problem.n, np.nan)
    if not limits_agree(problem):
        return Reference(problem, "infeasible", nothing, np.inf)
    if problem.n <= LARGEST_RATIONAL and problem.layout.row_count <= _MOST_ROWS and _short(problem):
        x = as_floats(exact_optimum(problem))
        return Reference(problem, "rational", x, float(np.spacing(np.abs(x)).max()))
    for x, error in _proven(problem):
        return Reference(problem, "proof", x, error)
    return Reference(problem, "none", nothing, np.inf)


def _proven(problem: Hierarchy) -> Iterator[tuple[Array, float]]:
    """Yield proven answers with their bounds."""
    judge = Judge(problem)
    for name in _CANDIDATES:
        found = polish(resolver(name)(problem)[0])
        if np.isfinite(found.x).all():
            judgement = judge(found.x, found.state)
            if judgement.proven:
                yield found.x, float(judgement.error_bound.max())


def _short(problem: Hierarchy) -> bool:
    """Return True if all rows are multiples of 2^-40, so that fractions stay short."""
    return bool((np.mod(problem.A * 2.0**40, 1.0) == 0.0).all())
