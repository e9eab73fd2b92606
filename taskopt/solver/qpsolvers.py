"""Every other solver that qpsolvers finds installed. Caron et al., qpsolvers, software, LGPL-3.0."""

import warnings
from typing import Any

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.errors import NotInstalled
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.solver.sparse import compressed

_OPTIONS = {  # its own name of the tolerance, or none
    "quadprog": (),
    "highs": ("primal_feasibility_tolerance", "dual_feasibility_tolerance"),
    "osqp": ("eps_abs", "eps_rel"),
    "scs": ("eps_abs", "eps_rel"),
    "piqp": ("eps_abs", "eps_rel", "eps_duality_gap_abs", "eps_duality_gap_rel"),
}
_EXTRA: dict[str, dict[str, Any]] = {
    "osqp": {"max_iter": 20000},
    "scs": {"max_iters": 50000},
    "piqp": {"check_duality_gap": True},
    "highs": {"time_limit": 1.0},  # its quadratic method can go round for ever
}
_INFINITY = {"piqp": 1e30}  # PIQP mistakes inf for a number


def solve(name: str, qp: QuadraticProgram, accuracy: float) -> Solution:
    """Solve with the solver that qpsolvers calls `name`; infeasible and given up look the same to it."""
    package = _package()
    problem, (equal, above, below) = _translate(package, qp, name)
    options: dict[str, Any] = dict.fromkeys(_OPTIONS.get(name, ()), max(accuracy, 1e-10))
    found = _found(package, problem, name, options | _EXTRA.get(name, {}))
    if found is None:
        x = np.full(qp.n, np.nan)
        return Solution(x, np.full(len(qp.C), np.nan), x, Status.FAILED)
    y = np.zeros(len(qp.C))
    if found.z is not None and len(above) + len(below):
        y[above] += found.z[: len(above)]
        y[below] -= found.z[len(above) :]
    if len(equal):
        y[equal] = found.y
    y_box = np.zeros(qp.n) if found.z_box is None or not len(found.z_box) else np.asarray(found.z_box)
    return Solution(np.asarray(found.x), y, y_box, Status.SOLVED)


def solve_at_defaults(name: str, H: Array, g: Array, lower: Array, upper: Array) -> Array:
    """x (n,) of min ½ xᵀ H x + gᵀ x inside a box, as qpsolvers solves it if told no more; NaN for none."""
    package = _package()
    form = np.asarray if name in package.dense_solvers else compressed
    limit = {"time_limit": _EXTRA["highs"]["time_limit"]} if name == "highs" else {}
    found = _found(package, package.Problem(form(H), g, lb=lower, ub=upper), name, limit)
    return np.full(len(g), np.nan) if found is None else np.asarray(found.x)


def _package() -> Any:
    try:
        import qpsolvers
    except ImportError as error:
        raise NotInstalled("qpsolvers", "qpsolvers") from error
    return qpsolvers


def _found(package: Any, problem: Any, name: str, options: dict[str, Any]) -> Any:
    """What the solver finds, or None."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the status says it
        try:
            found = package.solve_problem(problem, name, **options)
        except package.QPError:  # some raise where others return nothing
            return None
    return found if found.found and found.x is not None else None


def _translate(
    package: Any, qp: QuadraticProgram, name: str
) -> tuple[Any, tuple[IntArray, IntArray, IntArray]]:
    """One-sided rows, and which of ours became equalities, upper and lower ones."""
    equal = np.flatnonzero(qp.equality)
    above = np.flatnonzero((qp.upper < np.inf) & ~qp.equality)
    below = np.flatnonzero((qp.lower > -np.inf) & ~qp.equality)
    G, A = np.vstack([qp.C[above], -qp.C[below]]), qp.C[equal]
    form = np.asarray if name in package.dense_solvers else compressed
    free = _INFINITY.get(name, np.inf)
    problem = package.Problem(
        form(qp.H),
        qp.g,
        form(G) if len(G) else None,
        np.concatenate([qp.upper[above], -qp.lower[below]]) if len(G) else None,
        form(A) if len(A) else None,
        qp.upper[equal] if len(A) else None,
        np.maximum(qp.box_lower, -free),
        np.minimum(qp.box_upper, free),
    )
    return problem, (equal, above, below)
