"""CVXPY: the chapter's problems stated as it states them, as a check. Diamond and Boyd (2016), JMLR 17(83).

A `Statement` is compiled once for its sizes, all data being parameters (disciplined parametrised
programming, Agrawal et al. 2019), and solved again with new numbers. Nothing here knows how the rest of
the package scales, projects or weighs. A solve takes milliseconds: a reference, not for a loop.
"""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cvxpy
import numpy as np

from taskopt.arrays import Array
from taskopt.errors import NotSolved
from taskopt.hierarchy.status import Status

cp: Any = cvxpy  # its operators are typed for scalars, and read as matrices

_TIGHT = {"eps_abs": 1e-11, "eps_rel": 0.0}
_OPTIONS: dict[str, dict[str, Any]] = {
    "clarabel": {
        "tol_feas": 1e-12,
        "tol_gap_abs": 1e-15,
        "tol_gap_rel": 1e-15,
        "reduced_tol_feas": 1e-10,
        "reduced_tol_gap_abs": 1e-10,
        "reduced_tol_gap_rel": 1e-10,
        "presolve_enable": False,
        "max_threads": 1,
    },
    "daqp": {"primal_tol": 1e-12, "dual_tol": 1e-12},
    "proxqp": {**_TIGHT, "max_iter": 1000},
    "piqp": _TIGHT,
    "osqp": {**_TIGHT, "max_iter": 50000},
    "scs": {"eps_abs": 1e-9, "eps_rel": 0.0, "max_iters": 100000},
    "highs": {"time_limit": 1.0},  # its quadratic method can go round for ever
}
_STATUS = {
    cp.OPTIMAL: Status.SOLVED,
    cp.INFEASIBLE: Status.INFEASIBLE,
    cp.INFEASIBLE_INACCURATE: Status.INFEASIBLE,
    cp.OPTIMAL_INACCURATE: Status.ITERATION_LIMIT,
    cp.USER_LIMIT: Status.ITERATION_LIMIT,
}


@dataclass(frozen=True, eq=False)
class Stated:
    """x (n,), the price (≥ 0) of each row of G x ≤ h, what the solver claims, and how long it went."""

    x: Array
    price: Array
    status: Status
    iterations: int


class Statement:
    """min cost(x) s.t. C x = c, G x ≤ h over x (n,); `parameters` are the data by name.

    `rows` are the numbers of rows of C and of G. Where there are none the constraint is left out.
    """

    def __init__(self, n: int, rows: tuple[int, int]) -> None:
        self.x: Any = cp.Variable(n)
        self.parameters: dict[str, Any] = {}
        held, kept = rows
        self.constraints: list[Any] = []
        if held:
            self.constraints += [self.data("C", held, n) @ self.x == self.data("c", held)]
        self._kept = self.data("G", kept, n) @ self.x <= self.data("h", kept) if kept else None
        self.constraints += [self._kept] if kept else []
        self.cost: Any = 0.0

    def data(self, name: str, *shape: int, **attributes: bool) -> Any:
        """A parameter; its number comes with `solve`."""
        self.parameters[name] = cp.Parameter(shape, **attributes)
        return self.parameters[name]

    def stated(self) -> "Statement":
        """The statement, finished: cost and constraints are all there."""
        self.problem: Any = cp.Problem(cp.Minimize(self.cost), self.constraints)
        return self

    def solve(self, engine: str, values: Mapping[str, Array | float]) -> Stated:
        """Solve with numbers for all parameters; values that no parameter asks for are passed over."""
        for name, parameter in self.parameters.items():
            parameter.value = np.asarray(values[name], dtype=np.float64)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the status says it
            try:
                self.problem.solve(solver=engine.upper(), warm_start=False, **_OPTIONS[engine])
            except cp.error.SolverError:
                return self._nothing(Status.FAILED, 0)
        status = _STATUS.get(self.problem.status, Status.FAILED)
        if engine == "clarabel" and self.problem.status == cp.OPTIMAL_INACCURATE:
            status = Status.SOLVED  # to the reduced tolerances, which are ours
        iterations = int(self.problem.solver_stats.num_iters or 0)
        if self.x.value is None or (self._kept is not None and self._kept.dual_value is None):
            return self._nothing(status if status is not Status.SOLVED else Status.FAILED, iterations)
        price = np.zeros(0) if self._kept is None else np.array(self._kept.dual_value).reshape(-1)
        return Stated(np.array(self.x.value), price, status, iterations)

    def _nothing(self, status: Status, iterations: int) -> Stated:
        kept = 0 if self._kept is None else self._kept.shape[0]
        return Stated(np.full(self.x.shape, np.nan), np.zeros(kept), status, iterations)


@lru_cache(maxsize=128)
def least_norm_statement(n: int, held: int, kept: int) -> Statement:
    """min ½ q̇ᵀ W q̇ s.t. J q̇ = v, the problem before (3.49); W = LᵀL is handed over as L."""
    it = Statement(n, (held, kept))
    it.cost = 0.5 * cp.sum_squares(it.data("L", n, n) @ it.x)
    return it.stated()


@lru_cache(maxsize=128)
def nearest_statement(n: int, held: int, kept: int) -> Statement:
    """min ½ (q̇ − q̇₀)ᵀ (q̇ − q̇₀) s.t. J q̇ = v, the problem before (3.53)."""
    it = Statement(n, (held, kept))
    it.cost = 0.5 * cp.sum_squares(it.x - it.data("v0", n))
    return it.stated()


@lru_cache(maxsize=128)
def damped_statement(n: int, rows: int, kept: int) -> Statement:
    """min ½ (v − J q̇)ᵀ (v − J q̇) + ½ k² q̇ᵀ q̇, the problem after (3.59)."""
    it = Statement(n, (0, kept))
    missed = it.data("v", rows) - it.data("J", rows, n) @ it.x
    it.cost = 0.5 * cp.sum_squares(missed) + 0.5 * cp.sum_squares(it.data("k", nonneg=True) * it.x)
    return it.stated()


@lru_cache(maxsize=128)
def least_squares_statement(n: int, held: int, kept: int, rows: int, soft: int) -> Statement:
    """min ½ Σ w (A x − b)² + ½ Σ w⁺ s², s ≥ S x − t: what a level lacks, squared and weighed.

    r and √w stand apart, as a product of parameters would have to be compiled on every solve.
    """
    it = Statement(n, (held, kept))
    if rows:
        r = cp.Variable(rows)
        it.constraints += [it.data("A", rows, n) @ it.x - it.data("b", rows) == r]
        it.cost += 0.5 * cp.sum_squares(cp.multiply(it.data("root", rows, nonneg=True), r))
    if soft:
        s = cp.Variable(soft)
        it.constraints += [it.data("S", soft, n) @ it.x - it.data("t", soft) <= s]
        it.cost += 0.5 * cp.sum_squares(cp.multiply(it.data("soft_root", soft, nonneg=True), s))
    return it.stated()


def least_norm(
    J: Array,
    v: Array,
    W: Array | None = None,
    bounds: tuple[Array, Array] | None = None,
    engine: str = "clarabel",
) -> Array:
    """q̇ (n,) with J q̇ = v and least ½ q̇ᵀ W q̇ (3.50), W = I by default (3.51), within bounds (n,) each.

    Raises `NotSolved`, as do the other two, where there is no such q̇ or the solver gives up.
    """
    m, n = J.shape
    root = np.eye(n) if W is None else np.linalg.cholesky(np.diag(W) if W.ndim == 1 else W).T
    L = np.asarray(root, dtype=np.float64)
    G, h = within(bounds)
    return _answer(least_norm_statement(n, m, len(h)), engine, {"C": J, "c": v, "L": L, "G": G, "h": h})


def nearest(
    J: Array, v: Array, v0: Array, bounds: tuple[Array, Array] | None = None, engine: str = "clarabel"
) -> Array:
    """q̇ (n,) with J q̇ = v that is nearest to q̇₀ (n,) (3.54), within bounds."""
    m, n = J.shape
    G, h = within(bounds)
    return _answer(nearest_statement(n, m, len(h)), engine, {"C": J, "c": v, "v0": v0, "G": G, "h": h})


def damped(
    J: Array, v: Array, k: float, bounds: tuple[Array, Array] | None = None, engine: str = "clarabel"
) -> Array:
    """q̇ (n,) of damped least squares (3.59) with the damping factor k, within bounds."""
    m, n = J.shape
    G, h = within(bounds)
    return _answer(damped_statement(n, m, len(h)), engine, {"J": J, "v": v, "k": k, "G": G, "h": h})


def within(bounds: tuple[Array, Array] | None) -> tuple[Array, Array]:
    """lower ≤ x ≤ upper as rows G x ≤ h, one for each bound that is finite."""
    if bounds is None:
        return np.empty((0, 0)), np.empty(0)
    lower, upper = (np.asarray(side, dtype=np.float64) for side in bounds)
    return one_sided(np.eye(len(lower)), lower, upper)


def one_sided(A: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """lower ≤ A x ≤ upper as rows G x ≤ h, the upper ones first."""
    above, below = upper < np.inf, lower > -np.inf
    return np.vstack([A[above], -A[below]]), np.concatenate([upper[above], -lower[below]])


def _answer(statement: Statement, engine: str, values: Mapping[str, Array | float]) -> Array:
    found = statement.solve(engine, values)
    if found.status is not Status.SOLVED:
        raise NotSolved(f"cvxpy/{engine}: {found.status.name.lower()}; {found.status.value}")
    return found.x
