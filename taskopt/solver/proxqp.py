"""ProxQP, a primal-dual augmented Lagrangian solver.

Source: Bambade, Schramm, El-Kazdadi, Caron, Taylor and Carpentier (2025), IEEE Trans. Robotics 41.
"""

import numpy as np
from proxsuite import proxqp

from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status

_BACKEND = proxqp.dense.DenseBackend.PrimalDualLDLT
_STATUS = {
    proxqp.PROXQP_SOLVED: Status.SOLVED,
    proxqp.PROXQP_PRIMAL_INFEASIBLE: Status.INFEASIBLE,
    proxqp.PROXQP_SOLVED_CLOSEST_PRIMAL_FEASIBLE: Status.INFEASIBLE,
    proxqp.PROXQP_MAX_ITER_REACHED: Status.ITERATION_LIMIT,
}


def solve(qp: QuadraticProgram, accuracy: float) -> Solution:
    """Solve a convex program; see `taskopt.solver.base.Solve`.

    Args:
        qp: The program.
        accuracy: Absolute tolerance of residuals and duality gap, clipped to [1e-11, 1e-6]; on less
            it spends hundreds of iterations.

    Returns:
        The solution with its multipliers.
    """
    equal = qp.equality
    free = ~equal
    rows = int(free.sum())
    engine = proxqp.dense.QP(qp.n, len(equal) - rows, rows, True, dense_backend=_BACKEND)
    _configure(engine.settings, float(np.clip(accuracy, 1e-11, 1e-6)))
    engine.init(
        qp.H,
        qp.g,
        qp.C[equal],
        qp.upper[equal],
        qp.C[free],
        qp.lower[free],
        qp.upper[free],
        qp.box_lower,
        qp.box_upper,
    )
    engine.solve()
    found = engine.results
    y = np.empty(len(equal))
    y[equal] = found.y
    y[free] = found.z[:rows]
    status = _STATUS.get(found.info.status, Status.FAILED)
    return Solution(np.array(found.x), y, np.array(found.z[rows:]), status, found.info.iter)


def _configure(settings: proxqp.Settings, tolerance: float) -> None:
    """Ask for a tolerance, the duality gap included, which ProxQP does not check by default."""
    settings.eps_abs = tolerance
    settings.eps_rel = 0.0
    settings.check_duality_gap = True
    settings.eps_duality_gap_abs = tolerance
    settings.eps_duality_gap_rel = 0.0
    settings.eps_primal_inf = 1e-10  # at its default 1e-4 it calls feasible programs infeasible
    settings.max_iter = 50  # solved programs take 55 in all; where there is no answer, it seldom notices
    settings.max_iter_in = 5  # Newton steps of each; at its default 1500 some programs take 25,000 in all
