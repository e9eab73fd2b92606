"""The polished answer: the hierarchy solved again with the rows that a solver found active as equalities.

It is kept apart from the raw answer everywhere: solvers are compared by the raw one.
"""

import numpy as np

from taskopt.problem.hierarchy import Hierarchy
from taskopt.problem.multipliers import find_multipliers
from taskopt.problem.resolution import Resolution
from taskopt.resolver.base import answered
from taskopt.resolver.closed_form import prioritised


def polish(resolution: Resolution) -> Resolution:
    """The same problem, by orthogonal factorisation on the final active set of `resolution`.

    An active inequality is an equality row of its own level, in least squares (Escande, Mansard and
    Wieber 2014, Sect. 4). Status, state and iterations are those of the raw answer; the certificate
    is of the new x. Where the active set is wrong, so is x, and the certificate says so.
    """
    problem, state = resolution.problem, resolution.state
    if not np.isfinite(resolution.x).all():
        return resolution
    levels = [_held(problem, state, k) for k in range(problem.layout.level_count + 1)]
    x = prioritised(levels, problem.norm)
    return answered(
        problem, x, find_multipliers(problem, x), state, resolution.status, resolution.iterations
    )[0]


def _held(problem: Hierarchy, state: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(A, b, weight) of the equalities and active inequalities of level k; the box is in level 0."""
    n, level, rows = problem.n, problem.level(k), problem.layout.rows_of_level(k)
    A, lower, upper, side = level.A, level.lower, level.upper, state[n:][rows]
    weight = level.weight if k else np.ones(len(lower))
    if k == 0:
        A = np.vstack([np.eye(n), A])
        lower = np.concatenate([problem.box_lower, lower])
        upper = np.concatenate([problem.box_upper, upper])
        side, weight = np.concatenate([state[:n], side]), np.ones(n + len(weight))
    held = (lower == upper) | (side != 0)
    bound = np.where(side < 0, lower, upper)
    return A[held], bound[held], weight[held]
