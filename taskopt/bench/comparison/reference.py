"""Exact answers to compare with: rational arithmetic for small problems, our proof for larger ones."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.bench.exact import as_floats, exact_optimum
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof import Judge, Judgement
from taskopt.hierarchy.proof.prover import Prover
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import ACCURACY
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
        kind: "rational", "proof", "condition" if rows that depend on others up to rounding must depend on
            them exactly, "infeasible" if its hard limits contradict each other, or "none".
        x: The optimum, (n,); NaN for "infeasible" and "none".
        error: Bound on the error of x, largest entry; inf for "none".
        state: Active set with which x is proven, (n + M,); None for other kinds.
        judges: Judges by the numbers of the problem that they judge answers to; each keeps its proofs.
    """

    problem: Hierarchy
    kind: str
    x: Array
    error: float
    state: StateArray | None = None
    judges: dict[bytes, Judge] = field(default_factory=dict)

    def judge(self, found: Resolution) -> Judgement:
        """Judge an answer to the problem that its resolver states, another one for weights.

        An answer to this very problem is judged by the active set with which the reference is proven. Its own
        may prove nothing where it is wrong, and a search from there takes seconds.

        Args:
            found: The answer.

        Returns:
            The judgement.
        """
        key = found.problem.buffer.tobytes()
        if key not in self.judges:
            self.judges[key] = Judge(found.problem)
        x = np.where(np.isnan(found.x), np.inf, found.x)
        known = self.state is not None and key == self.problem.buffer.tobytes()
        return self.judges[key](x, self.state if known else found.state)

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
    best = Reference(problem, "none", nothing, np.inf)
    for one in _proven(problem):
        if one.kind == "proof":
            return one
        best = one
    return best


def _proven(problem: Hierarchy) -> Iterator[Reference]:
    """Yield optima that are enclosed, or are so on a condition.

    x is the enclosure, rounded, and not the answer that led to it: no resolver is compared with itself.
    """
    prover = Prover(problem)
    for name in _CANDIDATES:
        found = polish(resolver(name)(problem)[0])
        if not np.isfinite(found.x).all():
            continue
        for kind in ("proof", "condition"):
            optimum = prover.improve(found.state, assume=kind == "condition")
            if optimum.candidates:
                x, error = optimum.x, float(optimum.distance(optimum.x).max())
                if error <= ACCURACY:
                    yield Reference(problem, kind, x, error, found.state)


def _short(problem: Hierarchy) -> bool:
    """Return True if all rows are multiples of 2^-40, so that fractions stay short."""
    return bool((np.mod(problem.A * 2.0**40, 1.0) == 0.0).all())
