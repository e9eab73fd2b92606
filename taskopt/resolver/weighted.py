"""`wqp/<solver>`, which solves all levels in one quadratic program, weighted by powers of a ratio.

Priorities are approximate, because lower levels disturb a level in proportion to the ratio. The problem that
is answered and certified is `weighted_problem(hierarchy, ratio)`, a hierarchy of one level.
"""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import root_of
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import ACCURACY, COUNTED_MULTIPLIER, WEIGHT_SPREAD
from taskopt.resolver.base import Memory
from taskopt.resolver.closed_form import level_ratio, weighted_least_squares
from taskopt.resolver.one_level import answer_one_level, one_level_layout
from taskopt.resolver.solver_accuracy import checked_accuracy
from taskopt.resolver.weighted_kernels import weigh_rows


@dataclass(frozen=True)
class WeightedQP:
    """Resolve all levels in one program, with any solver.

        min Σ_k ratio^(k−1−L) ½ Σ w d_k(x)² + ½ xᵀ W x   inside the hard limits,   k = 1 … L

    d_k are the distances of the rows of level k to their bounds. The resolver promises the optimum of this
    weighted problem within the accuracy of the solver, and keeps hard limits to 1e-9. It does not promise
    strict priorities. The status is INFEASIBLE, with x = NaN, if and only if phase one finds that the limits
    contradict each other. It does not use a warm start.

    Attributes:
        solver: Name of the solver, see `taskopt.solver.registry.solvers`.
        ratio: Weight of a level over the weight of the level before it, in (0, 1]. A smaller ratio keeps
            priorities better and makes the program worse conditioned. None for the result of `level_ratio`.
            The smallest weight is that of the norm, W itself, so that the certificate notices errors there,
            too.
        accuracy: Accuracy wanted in x, relative to its largest entry; the solver is given tolerances for it.
    """

    solver: str
    ratio: float | None = None
    accuracy: float = ACCURACY

    def __post_init__(self) -> None:
        checked_accuracy(self.accuracy)
        if self.ratio is not None and not 0.0 < self.ratio <= 1.0:
            raise InvalidValue(f"ratio must be in (0, 1], got {self.ratio}")

    @property
    def name(self) -> str:
        """Name of the resolver: "wqp/daqp", or "wqp@0.01/daqp" with a ratio of its own."""
        return f"wqp/{self.solver}" if self.ratio is None else f"wqp@{self.ratio:g}/{self.solver}"

    @property
    def strict(self) -> bool:
        """False: priorities between levels are approximate."""
        return False

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:  # noqa: ARG002
        """Resolve one hierarchy.

        Args:
            hierarchy: The problem of this tick.
            memory: Ignored.

        Returns:
            The answer to the weighted problem, and a memory in which no row is active.

        Raises:
            UnknownName: There is no solver of that name.
            NotInstalled: The package of the solver cannot be imported.
        """
        problem = weighted_problem(hierarchy, self.ratio)
        # Multipliers of the last level stand beside those of the first one, which are SPREAD times larger.
        counted = COUNTED_MULTIPLIER / WEIGHT_SPREAD
        return answer_one_level(problem, self.solver, self.accuracy, counted)

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of weighted least squares over all levels; see `weighted_least_squares`."""
        return weighted_least_squares(hierarchy, self.ratio or level_ratio(hierarchy.layout.level_count))


def weighted_problem(hierarchy: Hierarchy, ratio: float | None = None) -> Hierarchy:
    """Combine all levels of a hierarchy into one level, by weights.

    Args:
        hierarchy: The problem with strict levels.
        ratio: Weight of a level over the weight of the level before it; None for `level_ratio`.

    Returns:
        A hierarchy of one level with the same names, in which the norm is n additional rows.
    """
    ratio = ratio or level_ratio(hierarchy.layout.level_count)
    diagonal = hierarchy.norm.ndim == 1 or hierarchy.n == 1
    layout = one_level_layout(hierarchy.layout, units=True, norm_units=hierarchy.norm.ndim == 1)
    problem = Hierarchy.view(layout, np.empty(layout.size), np.ones(hierarchy.n))
    norm = hierarchy.norm.copy().ravel() if diagonal else root_of(hierarchy.norm).ravel()
    weigh_rows(hierarchy.buffer, norm, hierarchy.layout.offsets, hierarchy.n, ratio, problem.buffer)
    return problem
