"""`wqp/<solver>`, which solves all levels in one quadratic program, weighted by powers of a ratio.

Priorities are approximate, because lower levels disturb a level in proportion to the ratio. The problem that
is answered and certified is `weighted_problem(hierarchy, ratio)`, a hierarchy of one level.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import Block, Layout
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.qp import QuadraticProgram
from taskopt.hierarchy.rank import root_of
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import (
    ACCURACY,
    COUNTED_MULTIPLIER,
    UNFINISHED_VIOLATION,
    WEIGHT_SPREAD,
)
from taskopt.resolver.base import Memory, answered, final_state
from taskopt.resolver.closed_form import level_ratio, weighted_least_squares
from taskopt.resolver.infeasible import no_answer, refuse_broken_claim
from taskopt.resolver.refinement import has_numbers
from taskopt.resolver.solver_accuracy import checked_accuracy, solve_to
from taskopt.solver.registry import solver


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
        """Name of the resolver, such as "wqp/daqp"."""
        return f"wqp/{self.solver}"

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
            The answer to the weighted problem, and a memory with its active set.

        Raises:
            UnknownName: There is no solver of that name.
            NotInstalled: The package of the solver cannot be imported.
        """
        problem = weighted_problem(hierarchy, self.ratio)
        qp, R = orthogonal_program(problem)
        engine = solver(self.solver)
        inverse = np.asarray(np.linalg.inv(R), dtype=np.float64)
        solution = solve_to(engine, self.accuracy, engine.most_iterations, inverse, refine=engine.promises)(
            qp
        )
        if solution.status in (Status.INFEASIBLE, Status.FAILED) or not has_numbers(solution):
            return no_answer(problem, solution.status, solution.iterations)
        x = np.asarray(np.linalg.solve(R, solution.x[: problem.n]), dtype=np.float64)
        y = find_multipliers(problem, x)
        # Multipliers of the last level stand beside those of the first one, which are SPREAD times larger.
        state = final_state(problem, x, y, COUNTED_MULTIPLIER / WEIGHT_SPREAD)
        claim = solution.status, solution.iterations
        answer = answered(problem, x, y, state, *claim, self.accuracy)
        outside = answer[0].certificate.broken_limit
        if solution.status is not Status.SOLVED and outside > UNFINISHED_VIOLATION:
            return no_answer(problem, *claim)
        return refuse_broken_claim(answer)

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of weighted least squares over all levels; see `weighted_least_squares`."""
        return weighted_least_squares(hierarchy, self.ratio or level_ratio(hierarchy.layout.level_count))


def orthogonal_program(problem: Hierarchy) -> tuple[QuadraticProgram, Array]:
    """Convert a hierarchy of one level to a program whose Hessian is the identity.

        min ½ ‖u − Qᵀ c‖² + ½ ‖t‖²   in u = R x and slacks t,   where √w A = Q R and c = √w b

    in which A and b are the equality rows of the level. No normal equations are formed.

    Args:
        problem: A hierarchy of one level whose equality rows have full column rank, see `weighted_problem`.

    Returns:
        The program in (u, t), and R (n, n).

    Source:
        Lawson and Hanson (1974), "Solving Least Squares Problems", Chapter 23.
    """
    level, limits, n = problem.levels[0], problem.limits, problem.n
    equal = level.lower == level.upper
    root = np.sqrt(level.weight)
    Q, R = np.linalg.qr(root[equal, None] * level.A[equal])
    soft = root[~equal, None] * level.A[~equal]
    m = len(soft)
    rows = np.vstack([np.eye(n), limits.A, soft])
    slack = np.vstack([np.zeros((len(rows) - m, m)), -np.eye(m)])
    C = np.hstack([np.asarray(np.linalg.solve(R.T, rows.T).T, dtype=np.float64), slack])
    lower = np.concatenate([problem.box_lower, limits.lower, root[~equal] * level.lower[~equal]])
    upper = np.concatenate([problem.box_upper, limits.upper, root[~equal] * level.upper[~equal]])
    bounded = (lower > -np.inf) | (upper < np.inf)
    g = np.concatenate([-Q.T @ (root[equal] * level.upper[equal]), np.zeros(m)])
    unbounded = np.full(n + m, np.inf)
    qp = QuadraticProgram(np.eye(n + m), g, C[bounded], lower[bounded], upper[bounded], -unbounded, unbounded)
    return qp, R


def weighted_problem(hierarchy: Hierarchy, ratio: float | None = None) -> Hierarchy:
    """Combine all levels of a hierarchy into one level, by weights.

    Args:
        hierarchy: The problem with strict levels.
        ratio: Weight of a level over the weight of the level before it; None for `level_ratio`.

    Returns:
        A hierarchy of one level with the same names, in which the norm is n additional rows.
    """
    ratio = ratio or level_ratio(hierarchy.layout.level_count)
    diagonal = hierarchy.norm.ndim == 1
    layout = _one_level(hierarchy.layout, diagonal)
    problem = Hierarchy.view(layout, np.empty(layout.size), np.ones(hierarchy.n))
    problem.owner[:] = hierarchy.owner
    count, levels = hierarchy.layout.row_count, hierarchy.layout.level_count
    problem.A[:count] = hierarchy.A
    problem.A[count:] = np.eye(hierarchy.n) if diagonal else root_of(hierarchy.norm)
    problem.lower[:count], problem.lower[count:] = hierarchy.lower, 0.0
    problem.upper[:count], problem.upper[count:] = hierarchy.upper, 0.0
    problem.weight[count:] = hierarchy.norm if diagonal else 1.0
    problem.label[:count], problem.label[count:] = hierarchy.label, 0.0
    for k in range(levels + 1):
        rows = hierarchy.layout.rows_of_level(k)
        problem.weight[rows] = hierarchy.weight[rows] * ratio ** (max(k, 1) - 1 - levels)
    problem.box_lower[:], problem.box_upper[:] = hierarchy.box_lower, hierarchy.box_upper
    return problem


@lru_cache(maxsize=64)
def _one_level(layout: Layout, diagonal: bool) -> Layout:
    """Return the layout of the weighted problem: all blocks in level 1, then the rows of the norm."""
    blocks = tuple(replace(block, level=min(block.level, 1)) for block in layout.blocks)
    start, n = layout.row_count, layout.n
    norm = Block("norm", 1, start, start + n, layout.unknowns, ("",) * n)
    column = layout.column or (-1,) * start
    own = tuple(range(n)) if diagonal else (-1,) * n
    return Layout(layout.unknowns, (*blocks, norm), 1, layout.owners, (*column, *own))
