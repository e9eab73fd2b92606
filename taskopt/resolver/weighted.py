"""`wqp/<solver>`: all levels in one quadratic program, each weighing `ratio` times the one before.

Priorities are approximate: a level gives way to those below it in proportion to the ratio. The
problem that is answered, and certified, is `weighted_problem(hierarchy, ratio)`.
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
from taskopt.hierarchy.tolerances import ACCURACY
from taskopt.resolver.base import Memory, answered, final_state
from taskopt.resolver.closed_form import SPREAD, level_ratio, weighted_least_squares
from taskopt.resolver.infeasible import no_answer, refuse_broken_claim
from taskopt.resolver.solver_accuracy import checked_accuracy, solve_to
from taskopt.solver.registry import solver

_PRICED = 1e-9 / SPREAD  # prices of the last level stand beside those of the first, SPREAD times larger
_OUTSIDE = 1e-7  # an answer that was not finished and leaves the limits by more is no answer
_MARGIN = 1e-2  # absolute, not at unit size: R makes x large, and limits are promised to 1e-9 all the same


@dataclass(frozen=True)
class WeightedQP:
    """min Σ_k ratio^(k−1−L) ½ Σ w d_k(x)² + ½ xᵀ W x over L levels inside the hard limits, with any solver.

    `ratio`: less keeps priorities better and the program worse conditioned; None: `level_ratio`. The
    smallest weight is that of the norm, W itself, so that the certificate sees an error there too.
    `accuracy`: wanted in x, relative to its largest entry; the tolerances of the solver follow from it.
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
        return f"wqp/{self.solver}"

    @property
    def strict(self) -> bool:
        return False

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:  # noqa: ARG002
        """Each tick starts cold."""
        problem = weighted_problem(hierarchy, self.ratio)
        qp, R = orthogonal(problem)
        solution = solver(self.solver)(qp, _MARGIN * self.accuracy)
        if solution.status is Status.FAILED:  # an interior point may, where x is much larger than 1
            solution = solve_to(solver(self.solver), self.accuracy)(qp)
        if solution.status in (Status.INFEASIBLE, Status.FAILED):
            return no_answer(problem, solution.status, solution.iterations)
        x = np.asarray(np.linalg.solve(R, solution.x[: problem.n]), dtype=np.float64)
        y = find_multipliers(problem, x)
        state = final_state(problem, x, y, _PRICED)
        done = solution.status, solution.iterations
        resolution, carried = answered(problem, x, y, state, *done, self.accuracy)
        if solution.status is not Status.SOLVED and resolution.certificate.residuals[0, 1] > _OUTSIDE:
            return no_answer(problem, solution.status, solution.iterations)
        return refuse_broken_claim((resolution, carried))

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        return weighted_least_squares(hierarchy, self.ratio or level_ratio(hierarchy.layout.level_count))


def orthogonal(problem: Hierarchy) -> tuple[QuadraticProgram, Array]:
    """The program in u = R x and slacks t, and R (n, n): min ½‖u − Qᵀ c‖² + ½‖t‖².

    √w A = Q R over the equality rows of the one level, c = √w b: the Hessian is the identity, and no
    normal equations are formed. Lawson and Hanson (1974), Chapter 23.
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
    open_side = np.full(n + m, np.inf)
    qp = QuadraticProgram(np.eye(n + m), g, C[bounded], lower[bounded], upper[bounded], -open_side, open_side)
    return qp, R


def weighted_problem(hierarchy: Hierarchy, ratio: float | None = None) -> Hierarchy:
    """The weighted problem as a hierarchy of one level, in which the norm has become n rows more."""
    ratio = ratio or level_ratio(hierarchy.layout.level_count)
    layout = _one_level(hierarchy.layout, hierarchy.norm.ndim == 1)
    problem = Hierarchy.view(layout, np.empty(layout.size), np.ones(hierarchy.n))
    problem.owner[:] = hierarchy.owner
    count, levels = hierarchy.layout.row_count, hierarchy.layout.level_count
    diagonal = hierarchy.norm.ndim == 1
    problem.A[:count] = hierarchy.A
    problem.A[count:] = np.eye(hierarchy.n) if diagonal else root_of(hierarchy.norm)
    problem.lower[:count], problem.lower[count:] = hierarchy.lower, 0.0
    problem.upper[:count], problem.upper[count:] = hierarchy.upper, 0.0
    problem.weight[count:] = hierarchy.norm if diagonal else 1.0
    for k in range(levels + 1):
        rows = hierarchy.layout.rows_of_level(k)
        problem.weight[rows] = hierarchy.weight[rows] * ratio ** (max(k, 1) - 1 - levels)
    problem.box_lower[:], problem.box_upper[:] = hierarchy.box_lower, hierarchy.box_upper
    return problem


@lru_cache(maxsize=64)
def _one_level(layout: Layout, diagonal: bool) -> Layout:
    blocks = tuple(replace(block, level=min(block.level, 1)) for block in layout.blocks)
    start, n = layout.row_count, layout.n
    norm = Block("norm", 1, start, start + n, layout.unknowns, ("",) * n)
    column = layout.column or (-1,) * start
    own = tuple(range(n)) if diagonal else (-1,) * n
    return Layout(layout.unknowns, (*blocks, norm), 1, layout.owners, (*column, *own))
