"""DAQP: a dual active set. Arnström, Bemporad and Axehill (2022), IEEE Trans. Automatic Control 67(8)."""

import daqp
import numpy as np

from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status

_FREE = 1e30  # its infinity
_EQUALITY = 5  # its `sense` of an equality
_PIVOT = 1e-14  # of the Gram matrix of rows; its default 1e-11 takes rows for parallel near a singularity
_STATUS = {
    1: Status.SOLVED,
    -1: Status.INFEASIBLE,
    -4: Status.ITERATION_LIMIT,
    -6: Status.INFEASIBLE,  # more equalities than unknowns, dependent ones among them
}


def solve(qp: QuadraticProgram, accuracy: float) -> Solution:
    """Solve a strictly convex program; its own regularisation of a singular H is switched off."""
    tolerance = float(np.clip(accuracy, 1e-13, 1e-6))
    n = qp.n
    upper = np.minimum(np.concatenate([qp.box_upper, qp.upper]), _FREE)
    lower = np.maximum(np.concatenate([qp.box_lower, qp.lower]), -_FREE)
    sense = np.where(lower == upper, _EQUALITY, 0).astype(np.intc)
    x, _, flag, info = daqp.solve(
        np.ascontiguousarray(qp.H),
        qp.g,
        np.ascontiguousarray(qp.C),
        upper,
        lower,
        sense,
        primal_tol=tolerance,
        dual_tol=tolerance,
        eps_prox=0.0,
        sing_tol=_PIVOT,
        iter_limit=1000,
    )
    y = np.asarray(info["lam"])
    return Solution(np.asarray(x), y[n:], y[:n], _STATUS.get(flag, Status.FAILED), info["iterations"])
