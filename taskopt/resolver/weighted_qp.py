"""`wqp/<solver>`: all levels in one quadratic program, each weighing `ratio` times the one before.

Priorities are approximate: a level gives way to those below it in proportion to the ratio. The
problem that is answered, and certified, is `flatten(hierarchy, ratio)`.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.problem.hierarchy import Hierarchy
from taskopt.problem.layout import Block, Layout
from taskopt.problem.multipliers import find_multipliers
from taskopt.problem.qp import QuadraticProgram
from taskopt.problem.resolution import Resolution, Status
from taskopt.resolver.base import Memory, answered, final_state, unanswered
from taskopt.resolver.closed_form import RATIO, root_of, weighted_least_squares
from taskopt.solver.registry import solver

_ACCURACY = 1e-11  # wanted in x


@dataclass(frozen=True)
class WeightedQP:
    """min Σ_k ratio^(k−1−L) ½ Σ w d_k(x)² + ½ xᵀ W x over L levels inside the hard limits, with any solver.

    `ratio`: less keeps priorities better and the program worse conditioned. The smallest weight is
    that of the norm, W itself, so that the certificate sees an error at the last level as well.
    """

    solver: str
    ratio: float = RATIO

    def __post_init__(self) -> None:
        if not 0.0 < self.ratio <= 1.0:
            raise InvalidValue(f"ratio must be in (0, 1], got {self.ratio}")

    @property
    def name(self) -> str:
        return f"wqp/{self.solver}"

    @property
    def strict(self) -> bool:
        return False

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        problem = flatten(hierarchy, self.ratio)
        qp = with_slacks(problem)
        smallest = float(np.linalg.eigvalsh(qp.H[: problem.n, : problem.n])[0])
        solution = solver(self.solver)(qp, _ACCURACY * min(1.0, smallest))
        if solution.status in (Status.INFEASIBLE, Status.FAILED):
            return unanswered(problem, solution.status, solution.iterations)
        x = solution.x[: problem.n].copy()
        y = find_multipliers(problem, x)
        return answered(problem, x, y, final_state(problem, x, y), solution.status, solution.iterations)

    def twin(self, hierarchy: Hierarchy) -> Array:
        return weighted_least_squares(hierarchy, self.ratio)


def flatten(hierarchy: Hierarchy, ratio: float = RATIO) -> Hierarchy:
    """The weighted problem as a hierarchy of one level, in which the norm has become n rows more."""
    layout = _one_level(hierarchy.layout, hierarchy.norm.ndim == 1)
    problem = Hierarchy.view(layout, np.empty(layout.size), np.ones(hierarchy.n))
    problem.owner[:] = hierarchy.owner
    count, levels = hierarchy.layout.row_count, hierarchy.layout.level_count
    diagonal = hierarchy.norm.ndim == 1
    problem.A[:count], problem.A[count:] = hierarchy.A, np.eye(hierarchy.n) if diagonal else root_of(hierarchy.norm)
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


def with_slacks(problem: Hierarchy) -> QuadraticProgram:
    """The program in x and r = √w d(x), r being a variable of its own: unit Hessian, no normal equations.

    min ½ xᵀ W x + ½ rᵀ r  s.t.  lower ≤ A x − r / √w ≤ upper, limits and box hard; W stands in the
    n last rows of `problem`, which is `flatten(hierarchy)`.
    """
    n, limits, level = problem.n, problem.limits, problem.levels[0]
    soft, hard = len(level.lower) - n, len(limits.lower)
    W = level.A[soft:].T @ (level.weight[soft:, None] * level.A[soft:])
    H = np.eye(n + soft)
    H[:n, :n] = W
    C = np.zeros((hard + soft, n + soft))
    C[:, :n] = problem.A[: hard + soft]
    C[hard:, n:] = np.diag(-1.0 / np.sqrt(level.weight[:soft]))
    free = np.full(soft, np.inf)
    return QuadraticProgram(
        H, np.zeros(n + soft), C, problem.lower[: hard + soft], problem.upper[: hard + soft],
        np.concatenate([problem.box_lower, -free]), np.concatenate([problem.box_upper, free]),
    )
