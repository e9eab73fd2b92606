"""DAQP, a dual active-set solver.

Source: Arnström, Bemporad and Axehill (2022), IEEE Trans. Automatic Control 67(8).
"""

import daqp
import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.solver.forms import joint_bounds
from taskopt.solver.inside import inside

_INFINITY = 1e30  # bounds of this size are no bounds to DAQP
_EQUALITY = 5  # code of an equality in DAQP's argument `sense`
_PIVOT = 1e-14  # smallest pivot of the Gram matrix of rows; see `sing_tol` in the manual of DAQP
_ITERATIONS = 300  # of hundreds of random programs the longest takes 61
_SOFT_OPTIMAL = 2  # code of an optimum in which a level is not met
_STATUS = {
    1: Status.SOLVED,
    -1: Status.INFEASIBLE,
    -4: Status.ITERATION_LIMIT,
    -6: Status.INFEASIBLE,  # more equalities than unknowns, dependent ones among them
}


def solve_hierarchy(hierarchy: Hierarchy, accuracy: float) -> tuple[Array, Status, int]:
    """Resolve all levels by one call of DAQP's own method for hierarchies.

    Args:
        hierarchy: The problem; rows are multiplied by √w.
        accuracy: Primal and dual tolerance, clipped to [1e-13, 1e-6].

    Returns:
        x (n,), what DAQP claims of it, and its iterations. The optimum is claimed, whether levels are met
        exactly or not.
    """
    tolerance = float(np.clip(accuracy, 1e-13, 1e-6))
    n, root = hierarchy.n, np.sqrt(hierarchy.weight)
    upper = np.minimum(np.concatenate([hierarchy.box_upper, root * hierarchy.upper]), _INFINITY)
    lower = np.maximum(np.concatenate([hierarchy.box_lower, root * hierarchy.lower]), -_INFINITY)
    H, g = np.array(hierarchy.norm_matrix()), np.zeros(n)  # DAQP takes no array that may not be written to
    A, sense = np.ascontiguousarray(root[:, None] * hierarchy.A), np.where(lower == upper, _EQUALITY, 0)
    ends = n + hierarchy.layout.offsets[1:].astype(np.intc)  # limits first, then level by level
    given = H, g, A, upper, lower, sense.astype(np.intc), ends
    with inside:
        x, _, flag, info = daqp.solve(*given, primal_tol=tolerance, dual_tol=tolerance)
    claims = {_SOFT_OPTIMAL: Status.SOLVED, **_STATUS}
    return np.asarray(x), claims.get(flag, Status.FAILED), info["iterations"]


def solve(qp: QuadraticProgram, accuracy: float) -> Solution:
    """Solve a strictly convex program; see `taskopt.solver.base.Solve`.

    DAQP's own regularisation of a singular H is switched off, and its smallest pivot is set to 1e-14: with
    the default of 1e-11 it regards rows as parallel near a singularity.

    Args:
        qp: The program; H must be positive definite.
        accuracy: Primal and dual tolerance, clipped to [1e-13, 1e-6].

    Returns:
        The solution with its multipliers.
    """
    tolerance = min(max(accuracy, 1e-13), 1e-6)
    n, m = qp.C.shape[1], len(qp.C)
    bounds, sense = np.empty((2, n + m)), np.empty(n + m, dtype=np.intc)
    given = qp.lower, qp.upper, qp.box_lower, qp.box_upper
    boxed = joint_bounds(given, _INFINITY, _EQUALITY, bounds, sense)
    first = 0 if boxed else n  # without a box there is less to go through
    H, C = np.ascontiguousarray(qp.H), np.ascontiguousarray(qp.C)
    with inside:
        x, _, flag, info = daqp.solve(
            H,
            qp.g,
            C,
            bounds[1, first:],
            bounds[0, first:],
            sense[first:],
            primal_tol=tolerance,
            dual_tol=tolerance,
            eps_prox=0.0,
            sing_tol=_PIVOT,
            iter_limit=_ITERATIONS,
        )
    y = info["lam"]
    y_box = y[:n] if boxed else np.zeros(n)
    return Solution(x, y[n - first :], y_box, _STATUS.get(flag, Status.FAILED), info["iterations"])
