"""ElastiQP, a solver whose programs are always feasible, since rows may be violated at a price.

It solves min ½ xᵀ H x + gᵀ x + p Σ t with G x − t ≤ h, t ≥ 0. If p is larger than every multiplier, its
answer is that of the program without t. An answer that violates a row is therefore no answer here.
"""

import elastiqp
import numpy as np

from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.solver.inside import inside
from taskopt.solver.one_sided import one_sided

_PENALTY = 1e6  # price p of a violation; programs are scaled so that multipliers are far below it


def solve(qp: QuadraticProgram, accuracy: float) -> Solution:
    """Solve a strictly convex program by the dual active-set method; see `taskopt.solver.base.Solve`.

    Args:
        qp: The program.
        accuracy: Absolute tolerance, clipped to [1e-13, 1e-6].

    Returns:
        The solution with its multipliers; FAILED with x = NaN if a row is violated.
    """
    bounded = np.flatnonzero(np.isfinite(qp.box_lower) | np.isfinite(qp.box_upper))
    C = np.vstack([qp.C, np.eye(qp.n)[bounded]])
    lower = np.concatenate([qp.lower, qp.box_lower[bounded]])
    upper = np.concatenate([qp.upper, qp.box_upper[bounded]])
    rows = one_sided(C, lower, upper)
    equalities = {"A": np.asfortranarray(rows.A), "b": rows.b} if len(rows.b) else {}
    H, G, tolerance = np.asfortranarray(qp.H), np.asfortranarray(rows.G), min(max(accuracy, 1e-13), 1e-6)
    options = {"method": "das", "eps_abs": tolerance}
    with inside:
        found = elastiqp.solve(H, qp.g, G, rows.h, _PENALTY, **options, **equalities)
    nothing = np.full(qp.n, np.nan)
    if not found.converged or found.n_saturated:
        return Solution(nothing, np.full(len(qp.C), np.nan), nothing, Status.FAILED, found.iters)
    y = rows.multipliers(np.asarray(found.y) if len(rows.b) else np.zeros(0), np.asarray(found.z), len(C))
    y_box = np.zeros(qp.n)
    y_box[bounded] = y[len(qp.C) :]
    return Solution(np.array(found.x), y[: len(qp.C)], y_box, Status.SOLVED, found.iters)
