"""`wqp/<solver>`: all levels in one quadratic program, each weighing `ratio` times the one before.

Priorities are approximate: a level gives way to those below it in proportion to the ratio. The
problem that is answered, and certified, is `flatten(hierarchy, ratio)`.
"""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.qp import QuadraticProgram
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.review import ACCURACY
from taskopt.hierarchy.status import Status
from taskopt.resolver.accuracy import checked_accuracy, solve_to
from taskopt.resolver.base import Memory, answered, final_state
from taskopt.resolver.closed_form import SPREAD, level_ratio, weighted_least_squares
from taskopt.resolver.flatten import flatten
from taskopt.resolver.unanswered import unanswered, unless_broken
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
        problem = flatten(hierarchy, self.ratio)
        qp, R = orthogonal(problem)
        solution = solver(self.solver)(qp, _MARGIN * self.accuracy)
        if solution.status is Status.FAILED:  # an interior point may, where x is much larger than 1
            solution = solve_to(solver(self.solver), self.accuracy)(qp)
        if solution.status in (Status.INFEASIBLE, Status.FAILED):
            return unanswered(problem, solution.status, solution.iterations)
        x = np.asarray(np.linalg.solve(R, solution.x[: problem.n]), dtype=np.float64)
        y = find_multipliers(problem, x)
        state = final_state(problem, x, y, _PRICED)
        done = solution.status, solution.iterations
        resolution, carried = answered(problem, x, y, state, *done, self.accuracy)
        if solution.status is not Status.SOLVED and resolution.certificate.residuals[0, 1] > _OUTSIDE:
            return unanswered(problem, solution.status, solution.iterations)
        return unless_broken((resolution, carried))

    def twin(self, hierarchy: Hierarchy) -> Array:
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
