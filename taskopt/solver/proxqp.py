"""ProxQP, a primal-dual augmented Lagrangian solver.

Source: Bambade, Schramm, El-Kazdadi, Caron, Taylor and Carpentier (2025), IEEE Trans. Robotics 41.
"""

from threading import local

import numpy as np
from proxsuite import proxqp

from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.solver.inside import inside

_BACKEND = proxqp.dense.DenseBackend.PrimalDualLDLT
_STATUS = {
    proxqp.PROXQP_SOLVED: Status.SOLVED,
    proxqp.PROXQP_PRIMAL_INFEASIBLE: Status.INFEASIBLE,
    proxqp.PROXQP_SOLVED_CLOSEST_PRIMAL_FEASIBLE: Status.INFEASIBLE,
    proxqp.PROXQP_MAX_ITER_REACHED: Status.ITERATION_LIMIT,
}

_AS_NEW = {  # the defaults of ProxQP, with which an engine that is used again starts as a new one does
    "update_preconditioner": True,
    "rho": 1e-6,
    "mu_eq": 1e-3,
    "mu_in": 1e-1,
}
_MOST_ENGINES = 64  # kept by each thread; a control loop needs a few

_Shape = tuple[int, int, int, bool, float]  # unknowns, equalities, other rows, whether boxed, tolerance


class _Engines(local):
    """Engines of this thread by shape of their programs, since making one takes longer than solving.

    Attributes:
        kept: The engines.
    """

    def __init__(self) -> None:
        self.kept: dict[_Shape, proxqp.dense.QP] = {}

    def keep(self, shape: _Shape, engine: proxqp.dense.QP) -> None:
        """Keep an engine for the next program of its shape."""
        if len(self.kept) >= _MOST_ENGINES:
            self.kept.clear()
        self.kept[shape] = engine


_engines = _Engines()


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
    rows = int(np.count_nonzero(free))
    boxed = bool(np.isfinite(qp.box_lower).any() or np.isfinite(qp.box_upper).any())
    parts = [qp.H, qp.g, qp.C[equal], qp.upper[equal], qp.C[free], qp.lower[free], qp.upper[free]]
    parts += [qp.box_lower, qp.box_upper] if boxed else []
    shape = len(qp.g), len(equal) - rows, rows, boxed, min(max(accuracy, 1e-11), 1e-6)
    with inside:
        engine = _engines.kept.pop(shape, None)
        if engine is None:
            engine = proxqp.dense.QP(*shape[:4], dense_backend=_BACKEND)
            _configure(engine.settings, shape[4])
            engine.init(*parts)
        else:
            engine.update(*parts, **_AS_NEW)
        engine.solve()
    found = engine.results
    z = np.array(found.z)
    y = np.empty(len(equal))
    y[equal] = found.y
    y[free] = z[:rows]
    status = _STATUS.get(found.info.status, Status.FAILED)
    if status is Status.SOLVED:
        _engines.keep(shape, engine)
    y_box = z[rows:] if boxed else np.zeros(len(qp.g))
    return Solution(np.array(found.x), y, y_box, status, found.info.iter)


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
