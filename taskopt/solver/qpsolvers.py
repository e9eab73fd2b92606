"""All other installed solvers that qpsolvers finds. Source: Caron et al., qpsolvers, software, LGPL-3.0."""

import warnings
from dataclasses import replace
from typing import Any

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import NotInstalled
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.solver.inside import inside
from taskopt.solver.one_sided import OneSided, compressed, one_sided

_TOLERANCES = {  # the names under which a solver takes its tolerances
    "highs": ("primal_feasibility_tolerance", "dual_feasibility_tolerance"),
    "osqp": ("eps_abs", "eps_rel"),
    "scs": ("eps_abs", "eps_rel"),
    "piqp": ("eps_abs", "eps_rel", "eps_duality_gap_abs", "eps_duality_gap_rel"),
    **dict.fromkeys(("cvxopt", "kvxopt", "ecos"), ("abstol", "reltol", "feastol")),
    "qpalm": ("eps_abs", "eps_rel"),
    "qtqp": (),  # it takes them elsewhere than qpsolvers hands them over
}
_ROWS_ONLY = (
    "cvxopt",
    "kvxopt",
    "ecos",
    "qpswift",
    "qpax",
    "qtqp",
)  # qpsolvers hands them bounds as rows, inf too
_OPTIONS: dict[str, dict[str, float]] = {
    "osqp": {"max_iter": 20000},
    "scs": {"max_iters": 50000},
    "piqp": {"check_duality_gap": True, "max_iter": 60},  # solved programs take 22, seldom more
    "highs": {"time_limit": 1.0},  # [s] its quadratic method can cycle for ever
}
_LEAST = 1e-13  # tolerance that any solver is asked for
_FINEST = {"ecos": 1e-10, "cvxopt": 1e-10, "kvxopt": 1e-10, "qpalm": 1e-11}  # below, they give up often
_INFINITY = {"piqp": 1e30}  # PIQP takes inf for a number


def solve(name: str, qp: QuadraticProgram, accuracy: float) -> Solution:
    """Solve a convex program with the solver that qpsolvers calls `name`.

    Args:
        name: Name of the solver in qpsolvers.
        qp: The program.
        accuracy: Requested tolerance; no solver is asked for less than it can reach.

    Returns:
        The solution. qpsolvers does not distinguish infeasible programs from failures, so that the status is
        either SOLVED, or FAILED with x = NaN.

    Raises:
        NotInstalled: The package qpsolvers cannot be imported.
    """
    tolerance = max(accuracy, _FINEST.get(name, _LEAST))
    options: dict[str, float] = dict.fromkeys(_TOLERANCES.get(name, ()), tolerance)
    return _solve(name, qp, options | _OPTIONS.get(name, {}))


def solve_at_default_tolerances(name: str, qp: QuadraticProgram, accuracy: float) -> Solution:  # noqa: ARG001
    """Solve a convex program with the tolerances that a solver has if nobody asks for any.

    Args:
        name: Name of the solver in qpsolvers.
        qp: The program.
        accuracy: Ignored.

    Returns:
        As `solve`.

    Raises:
        NotInstalled: The package qpsolvers cannot be imported.
    """
    limit = {"time_limit": _OPTIONS["highs"]["time_limit"]} if name == "highs" else {}
    return _solve(name, qp, limit)


def _solve(name: str, qp: QuadraticProgram, options: dict[str, float]) -> Solution:
    """Solve a convex program with options of the solver."""
    package = _package()
    if name in _ROWS_ONLY and (np.isfinite(qp.box_lower) | np.isfinite(qp.box_upper)).any():
        return _without_box(name, qp, options)
    rows = one_sided(qp.C, qp.lower, qp.upper)
    found = _solved(package, _problem(package, qp, rows, name), name, options)
    if found is None:
        x = np.full(qp.n, np.nan)
        return Solution(x, np.full(len(qp.C), np.nan), x, Status.FAILED)
    of_equal = found.y if len(rows.b) else np.zeros(0)
    of_inequal = found.z if found.z is not None and len(rows.h) else np.zeros(len(rows.h))
    y = rows.multipliers(of_equal, of_inequal, len(qp.C))
    y_box = np.zeros(qp.n) if found.z_box is None or not len(found.z_box) else np.asarray(found.z_box)
    return Solution(np.asarray(found.x), y, y_box, Status.SOLVED, _iterations(found))


def _without_box(name: str, qp: QuadraticProgram, options: dict[str, float]) -> Solution:
    """Solve the program with the finite bounds of its box as rows."""
    m, bounded = len(qp.C), np.flatnonzero(np.isfinite(qp.box_lower) | np.isfinite(qp.box_upper))
    free = np.full(qp.n, np.inf)
    rows = replace(
        qp,
        C=np.vstack([qp.C, np.eye(qp.n)[bounded]]),
        lower=np.concatenate([qp.lower, qp.box_lower[bounded]]),
        upper=np.concatenate([qp.upper, qp.box_upper[bounded]]),
        box_lower=-free,
        box_upper=free,
    )
    found = _solve(name, rows, options)
    y_box = np.zeros(qp.n)
    y_box[bounded] = found.y[m:]
    return replace(found, y=found.y[:m], y_box=y_box)


def solve_at_defaults(name: str, H: Array, g: Array, lower: Array, upper: Array) -> Array:
    """Solve min ½ xᵀ H x + gᵀ x inside a box with a solver's default settings.

    Args:
        name: Name of the solver in qpsolvers.
        H: (n, n) symmetric, positive definite.
        g: (n,) gradient at x = 0.
        lower: (n,) lower bounds.
        upper: (n,) upper bounds.

    Returns:
        x (n,), NaN if the solver finds none.

    Raises:
        NotInstalled: The package qpsolvers cannot be imported.
    """
    package = _package()
    form = np.asarray if name in package.dense_solvers else compressed
    limit = {"time_limit": _OPTIONS["highs"]["time_limit"]} if name == "highs" else {}
    found = _solved(package, package.Problem(form(H), g, lb=lower, ub=upper), name, limit)
    return np.full(len(g), np.nan) if found is None else np.asarray(found.x)


def _package() -> Any:
    """Import qpsolvers when it is first needed."""
    try:
        import qpsolvers
    except ImportError as error:
        raise NotInstalled("qpsolvers", "qpsolvers") from error
    return qpsolvers


def _solved(package: Any, problem: Any, name: str, options: dict[str, float]) -> Any:
    """Return the solution in the form of qpsolvers, or None if the solver finds none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the status says it
        try:
            with inside:
                found = package.solve_problem(problem, name, **options)
        except (package.QPError, ValueError, ArithmeticError):  # some raise where others return nothing
            return None
    return found if found.found and found.x is not None else None


def _iterations(found: Any) -> int:
    """Return the iterations of a solution in the form of qpsolvers, 0 where the solver does not say."""
    told = found.extras.get("iterations", getattr(found.extras.get("info"), "iter", 0))
    return int(np.sum(told))


def _problem(package: Any, qp: QuadraticProgram, rows: OneSided, name: str) -> Any:
    """Return the program in the form of qpsolvers, dense or sparse as the solver requires."""
    form = np.asarray if name in package.dense_solvers else compressed
    infinity = _INFINITY.get(name, np.inf)
    boxed = name not in _ROWS_ONLY
    return package.Problem(
        form(qp.H),
        qp.g,
        form(rows.G) if len(rows.h) else None,
        rows.h if len(rows.h) else None,
        form(rows.A) if len(rows.b) else None,
        rows.b if len(rows.b) else None,
        np.maximum(qp.box_lower, -infinity) if boxed else None,
        np.minimum(qp.box_upper, infinity) if boxed else None,
    )
