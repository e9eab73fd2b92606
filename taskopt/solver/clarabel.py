"""Clarabel: an interior point. Goulart and Chen (2024), arXiv:2405.12762."""

from typing import Any

import clarabel as package
import numpy as np

from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.solver.sparse import compressed

clarabel: Any = package  # compiled: a type checker sees nothing in it

_STATUS = {
    "Solved": Status.SOLVED,
    "AlmostSolved": Status.SOLVED,
    "PrimalInfeasible": Status.INFEASIBLE,
    "AlmostPrimalInfeasible": Status.INFEASIBLE,
    "MaxIterations": Status.ITERATION_LIMIT,
}


def solve(qp: QuadraticProgram, accuracy: float) -> Solution:
    """Solve a convex program; bounds become rows a x + s = b with s = 0 or s ≥ 0."""
    C = np.vstack([qp.C, np.eye(qp.n)])
    lower, upper = np.concatenate([qp.lower, qp.box_lower]), np.concatenate([qp.upper, qp.box_upper])
    equal = np.flatnonzero(lower == upper)
    above = np.flatnonzero((upper < np.inf) & (lower != upper))
    below = np.flatnonzero((lower > -np.inf) & (lower != upper))
    rows = np.vstack([C[equal], C[above], -C[below]])
    sides = np.concatenate([upper[equal], upper[above], -lower[below]])
    cones = [clarabel.ZeroConeT(len(equal)), clarabel.NonnegativeConeT(len(above) + len(below))]
    cones = [cone for cone in cones if cone.dim]
    solver = clarabel.DefaultSolver(
        compressed(np.triu(qp.H)), qp.g, compressed(rows), sides, cones, _settings(accuracy)
    )
    found = solver.solve()
    z = np.array(found.z)
    y = np.zeros(len(C))
    y[equal] = z[: len(equal)]
    y[above] += z[len(equal) : len(equal) + len(above)]
    y[below] -= z[len(equal) + len(above) :]
    status = _STATUS.get(str(found.status), Status.FAILED)
    return Solution(np.array(found.x), y[: len(qp.C)], y[len(qp.C) :], status, found.iterations)


def _settings(accuracy: float) -> Any:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.presolve_enable = False  # it drops rows with large bounds, and their multipliers with them
    settings.max_threads = 1
    settings.tol_feas = max(accuracy, 1e-12)
    # Where a bound is met without a price, x is off by the root of the gap: ask for the square.
    settings.tol_gap_abs = settings.tol_gap_rel = max(accuracy**2, 1e-15)
    # It seldom gets there, and calls what it has "almost solved" if it is better than this.
    reached = max(accuracy, 1e-10)
    settings.reduced_tol_feas = settings.reduced_tol_gap_abs = settings.reduced_tol_gap_rel = reached
    return settings
