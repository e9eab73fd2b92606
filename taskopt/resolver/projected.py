"""`pqp/<solver>`, which solves all levels in one program, each with its cost projected on a null space.

The cost of a level cannot be felt in the directions that the levels before it decide, so that no ratio of
weights is needed while no inequality is active. The problem that is answered and certified is
`projected_problem(hierarchy)`, a hierarchy of one level.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, equality_levels, inverse_root, root_of, row_scale
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import ACCURACY, COUNTED_MULTIPLIER
from taskopt.resolver.base import Memory
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.level_qp import row_svd
from taskopt.resolver.one_level import answer_one_level, with_rows_of_norm
from taskopt.resolver.solver_accuracy import checked_accuracy


@dataclass(frozen=True)
class ProjectedQP:
    """Resolve all levels in one program, in which the levels before shield each level's cost.

        min Σ_k ½ Σ w d_k(x_{k−1} + N_{k−1} x)² + ½ ‖N_L x‖²   inside the hard limits,   k = 1 … L

    N_k projects on the null space of the equalities up to level k, and x_k is their closed-form answer. While
    no inequality is active, the answer is the strict optimum. It promises no more: where a bound or an
    inequality is active, a lower level can take from a higher one, as if their weights were compared, and
    inequalities of a level shield nothing. It keeps hard limits to 1e-9. The status is INFEASIBLE, with
    x = NaN, if and only if phase one finds that the limits contradict each other. It does not use a warm
    start.

    Attributes:
        solver: Name of the solver, see `taskopt.solver.registry.solvers`.
        accuracy: Accuracy wanted in x, relative to its largest entry; the solver is given tolerances for it.
    """

    solver: str
    accuracy: float = ACCURACY

    def __post_init__(self) -> None:
        checked_accuracy(self.accuracy)

    @property
    def name(self) -> str:
        """Name of the resolver, such as "pqp/daqp"."""
        return f"pqp/{self.solver}"

    @property
    def strict(self) -> bool:
        """False: priorities between levels are lost where inequalities are active."""
        return False

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:  # noqa: ARG002
        """Resolve one hierarchy.

        Args:
            hierarchy: The problem of this tick.
            memory: Ignored.

        Returns:
            The answer to the projected problem, and a memory in which no row is active.

        Raises:
            UnknownName: There is no solver of that name.
            NotInstalled: The package of the solver cannot be imported.
        """
        return answer_one_level(projected_problem(hierarchy), self.solver, self.accuracy, COUNTED_MULTIPLIER)

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of task priority, which this is while nothing is active; see `task_priority`."""
        return task_priority(hierarchy)


def projected_problem(hierarchy: Hierarchy) -> Hierarchy:
    """Combine all levels of a hierarchy into one level, by projection.

    Args:
        hierarchy: The problem with strict levels.

    Returns:
        A hierarchy of one level with the same names, in which the norm is n additional rows. These rows are
        those of N_L and of the directions that hard equalities decide, so that the optimum is unique.
    """
    problem = with_rows_of_norm(hierarchy, units=False, norm_units=False)
    problem.weight[: hierarchy.layout.row_count] = hierarchy.weight
    root, inverse = root_of(hierarchy.norm), inverse_root(hierarchy.norm)
    xi, Z, decided = np.zeros(hierarchy.n), np.eye(hierarchy.n), np.zeros((hierarchy.n, hierarchy.n))
    for k, (A, b, weight) in enumerate(equality_levels(hierarchy)):
        if k:
            rows = hierarchy.layout.rows_of_level(k)
            seen = hierarchy.A[rows] @ inverse
            problem.A[rows] = seen @ Z @ Z.T @ root
            problem.lower[rows] -= seen @ xi
            problem.upper[rows] -= seen @ xi
            same = hierarchy.lower[rows] == hierarchy.upper[rows]
            problem.lower[rows] = np.where(same, problem.upper[rows], problem.lower[rows])
        scaled = np.sqrt(weight)[:, None] * A @ inverse
        count = partial(RULE.rank, scale=row_scale(scaled, np.sqrt(weight)))
        own = row_svd(scaled @ Z, np.sqrt(weight) * (b - A @ inverse @ xi), count)
        xi, Z = xi + Z @ own.solution, Z @ own.free
        if k == 0:
            decided = np.eye(hierarchy.n) - Z @ Z.T
    norm = slice(hierarchy.layout.row_count, None)
    problem.A[norm], problem.weight[norm] = (Z @ Z.T + decided) @ root, 1.0
    return problem
