"""Clarabel, an interior-point solver. Source: Goulart and Chen (2024), arXiv:2405.12762."""

from typing import Any

import clarabel as package
import numpy as np

from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.solver.inside import inside
from taskopt.solver.one_sided import compressed, one_sided

clarabel: Any = package  # a compiled module without stubs: a type checker sees no names in it

_STATUS = {
    "Solved": Status.SOLVED,
    "AlmostSolved": Status.SOLVED,
    "PrimalInfeasible": Status.INFEASIBLE,
    "AlmostPrimalInfeasible": Status.INFEASIBLE,
    "MaxIterations": Status.ITERATION_LIMIT,
}


def solve(qp: QuadraticProgram, accuracy: float) -> Solution:
    """Solve a convex program; see `taskopt.solver.base.Solve`.

    Rows and box become cone constraints a x + s = b, with s = 0 for equalities and s ≥ 0 for bounds.

    Args:
        qp: The program.
        accuracy: Requested feasibility tolerance, at least 1e-12; the tolerance of the duality gap is its
            square.

    Returns:
        The solution with its multipliers.
    """
    C = np.vstack([qp.C, np.eye(qp.n)])
    rows = one_sided(C, np.concatenate([qp.lower, qp.box_lower]), np.concatenate([qp.upper, qp.box_upper]))
    cones = [clarabel.ZeroConeT(len(rows.b)), clarabel.NonnegativeConeT(len(rows.h))]
    H, A = compressed(np.triu(qp.H)), compressed(np.vstack([rows.A, rows.G]))
    b, settings = np.concatenate([rows.b, rows.h]), _settings(accuracy)
    with inside:
        found = clarabel.DefaultSolver(H, qp.g, A, b, [cone for cone in cones if cone.dim], settings).solve()
    z = np.array(found.z)
    y = rows.multipliers(z[: len(rows.b)], z[len(rows.b) :], len(C))
    status = _STATUS.get(str(found.status), Status.FAILED)
    return Solution(np.array(found.x), y[: len(qp.C)], y[len(qp.C) :], status, found.iterations)


def _settings(accuracy: float) -> Any:
    """Return the settings for a feasibility tolerance."""
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.presolve_enable = False  # it drops rows with large bounds, and their multipliers with them
    settings.max_threads = 1
    settings.max_iter = 60  # solved programs take 31 at most; where there is no answer, it seldom notices
    settings.tol_feas = max(accuracy, 1e-12)
    # At a bound whose multiplier is zero the error of x is the square root of the gap: ask for the square.
    settings.tol_gap_abs = settings.tol_gap_rel = max(accuracy**2, 1e-15)
    # It seldom gets there, and calls an answer "almost solved" if it is better than the reduced tolerances.
    reached = max(accuracy, 1e-10)
    settings.reduced_tol_feas = settings.reduced_tol_gap_abs = settings.reduced_tol_gap_rel = reached
    return settings
