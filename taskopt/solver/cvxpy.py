"""The optimisation problems of the chapter, stated in CVXPY to check the formulas.

A `Program` is compiled once for its sizes and solved again with new numbers, because all its data are
parameters (disciplined parametrised programming). The module shares no code with the rest of the package, so
that agreement of the two is evidence. A solve takes milliseconds, which is too much for a control loop. CVXPY
takes most of a second to import and is therefore imported at the first program.

Source: Diamond and Boyd (2016), JMLR 17(83); Agrawal et al. (2019), "Differentiable Convex Optimization
Layers", NeurIPS, for the parameters.
"""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import NotSolved
from taskopt.hierarchy.status import Status

_TIGHT = {"eps_abs": 1e-11, "eps_rel": 0.0}
_OPTIONS: dict[str, dict[str, float]] = {
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
    "highs": {"time_limit": 1.0},  # [s] its quadratic method can cycle for ever
}
ENGINES = tuple(_OPTIONS)  # the solvers that CVXPY can be asked to use
_STATUS = {  # by the status strings of CVXPY
    "optimal": Status.SOLVED,
    "infeasible": Status.INFEASIBLE,
    "infeasible_inaccurate": Status.INFEASIBLE,
    "optimal_inaccurate": Status.ITERATION_LIMIT,
    "user_limit": Status.ITERATION_LIMIT,
}


@dataclass(frozen=True, eq=False)
class ProgramSolution:
    """The answer of a solver to a `Program`.

    Attributes:
        x: (n,) the unknowns, NaN if there is no answer.
        multipliers: (rows of G,) multipliers ≥ 0 of G x ≤ h.
        status: Claim of the solver.
        iterations: Iterations of the solver.
    """

    x: Array
    multipliers: Array
    status: Status
    iterations: int


class Program:
    """The program min cost(x) subject to C x = c and G x ≤ h over x (n,), with all data as parameters.

    Attributes:
        x: The unknowns, a variable of CVXPY of size n.
        parameters: The parameters by name: C, c, G, h, and those of the cost, which `data` adds.
        constraints: C x = c and G x ≤ h, each left out if it has no rows; more may be appended.
        cost: The cost, a convex expression of CVXPY; set it before `compiled`.
    """

    def __init__(self, n: int, equalities: int, inequalities: int) -> None:
        """Begin a program.

        Args:
            n: Number of unknowns.
            equalities: Number of rows of C.
            inequalities: Number of rows of G.
        """
        self.x: Any = _cvxpy().Variable(n)
        self.parameters: dict[str, Any] = {}
        self.constraints: list[Any] = []
        self.cost: Any = 0.0
        self._inequalities = inequalities
        self._bounds: Any = None
        if equalities:
            self.constraints += [self.data("C", equalities, n) @ self.x == self.data("c", equalities)]
        if inequalities:
            self._bounds = self.data("G", inequalities, n) @ self.x <= self.data("h", inequalities)
            self.constraints += [self._bounds]

    def data(self, name: str, *shape: int, nonneg: bool = False) -> Any:
        """Add a parameter, whose numbers are given to `solve`.

        Args:
            name: Name of the parameter.
            shape: Shape of the parameter; none for a single number.
            nonneg: True if its entries are ≥ 0, which CVXPY must know for some factors.

        Returns:
            A parameter of CVXPY.
        """
        self.parameters[name] = _cvxpy().Parameter(shape, nonneg=nonneg)
        return self.parameters[name]

    def compiled(self) -> "Program":
        """Compile the program, whose cost and constraints must be complete, and return it."""
        cp = _cvxpy()
        self.problem: Any = cp.Problem(cp.Minimize(self.cost), self.constraints)
        return self

    def solve(self, engine: str, values: Mapping[str, Array | float]) -> ProgramSolution:
        """Solve the program with numbers for all its parameters.

        Args:
            engine: Solver that CVXPY uses, one of `ENGINES`.
            values: Numbers for each parameter by name; names that no parameter has are ignored.

        Returns:
            The answer of the solver. There is no warm start, so that the same numbers give the same bits.
        """
        for name, parameter in self.parameters.items():
            parameter.value = np.asarray(values[name], dtype=np.float64)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the status says it
            try:
                self.problem.solve(solver=engine.upper(), warm_start=False, **_OPTIONS[engine])
            except _cvxpy().error.SolverError:
                return self._without_answer(Status.FAILED, 0)
        status = _STATUS.get(self.problem.status, Status.FAILED)
        if engine == "clarabel" and self.problem.status == "optimal_inaccurate":
            status = Status.SOLVED  # to the reduced tolerances, which are ours
        iterations = int(self.problem.solver_stats.num_iters or 0)
        if self.x.value is None or (self._bounds is not None and self._bounds.dual_value is None):
            status = Status.FAILED if status is Status.SOLVED else status
            return self._without_answer(status, iterations)
        dual = np.zeros(0) if self._bounds is None else np.array(self._bounds.dual_value).reshape(-1)
        return ProgramSolution(np.array(self.x.value), dual, status, iterations)

    def _without_answer(self, status: Status, iterations: int) -> ProgramSolution:
        """Return x = NaN with a status that gives the reason."""
        nothing = np.full(self.x.shape, np.nan)
        return ProgramSolution(nothing, np.zeros(self._inequalities), status, iterations)


@lru_cache(maxsize=128)
def least_norm_program(n: int, equalities: int, inequalities: int) -> Program:
    """State min ½ q̇ᵀ W q̇ subject to J q̇ = v.

    Args:
        n: Number of joints.
        equalities: Rows of J, whose numbers are the parameters C and c.
        inequalities: Rows of G q̇ ≤ h.

    Returns:
        The program; its cost asks for the parameter L (n, n) with W = Lᵀ L.

    Source:
        The problem before (3.49).
    """
    cp, program = _cvxpy(), Program(n, equalities, inequalities)
    program.cost = 0.5 * cp.sum_squares(program.data("L", n, n) @ program.x)
    return program.compiled()


@lru_cache(maxsize=128)
def nearest_program(n: int, equalities: int, inequalities: int) -> Program:
    """State min ½ (q̇ − q̇₀)ᵀ (q̇ − q̇₀) subject to J q̇ = v.

    Args:
        n: Number of joints.
        equalities: Rows of J, whose numbers are the parameters C and c.
        inequalities: Rows of G q̇ ≤ h.

    Returns:
        The program; its cost asks for the parameter v0 (n,), which is q̇₀.

    Source:
        The problem before (3.53).
    """
    cp, program = _cvxpy(), Program(n, equalities, inequalities)
    program.cost = 0.5 * cp.sum_squares(program.x - program.data("v0", n))
    return program.compiled()


@lru_cache(maxsize=128)
def damped_program(n: int, rows: int, inequalities: int) -> Program:
    """State min ½ (v − J q̇)ᵀ (v − J q̇) + ½ k² q̇ᵀ q̇.

    Args:
        n: Number of joints.
        rows: Rows of J.
        inequalities: Rows of G q̇ ≤ h.

    Returns:
        The program; its cost asks for the parameters J (rows, n), v (rows,) and k.

    Source:
        The problem after (3.59).
    """
    cp, program = _cvxpy(), Program(n, 0, inequalities)
    missed = program.data("v", rows) - program.data("J", rows, n) @ program.x
    damping = program.data("k", nonneg=True) * program.x
    program.cost = 0.5 * cp.sum_squares(missed) + 0.5 * cp.sum_squares(damping)
    return program.compiled()


@lru_cache(maxsize=128)
def least_squares_program(n: int, equalities: int, inequalities: int, rows: int, soft: int) -> Program:
    """State min ½ Σ w (A x − b)² + ½ Σ u s² subject to s ≥ S x − t, C x = c and G x ≤ h.

    The residuals are separate variables, since CVXPY would have to compile a product of two parameters (√w
    and A) again at every solve.

    Args:
        n: Number of unknowns.
        equalities: Rows of C.
        inequalities: Rows of G.
        rows: Rows of A.
        soft: Rows of S.

    Returns:
        The program, with the parameters A, b, root = √w, S, t and soft_root = √u besides C, c, G and h.
    """
    cp, program = _cvxpy(), Program(n, equalities, inequalities)
    if rows:
        r = cp.Variable(rows)
        program.constraints += [program.data("A", rows, n) @ program.x - program.data("b", rows) == r]
        root = program.data("root", rows, nonneg=True)
        program.cost += 0.5 * cp.sum_squares(cp.multiply(root, r))
    if soft:
        s = cp.Variable(soft)
        program.constraints += [program.data("S", soft, n) @ program.x - program.data("t", soft) <= s]
        soft_root = program.data("soft_root", soft, nonneg=True)
        program.cost += 0.5 * cp.sum_squares(cp.multiply(soft_root, s))
    return program.compiled()


def least_norm(
    J: Array,
    v: Array,
    W: Array | None = None,
    bounds: tuple[Array, Array] | None = None,
    engine: str = "clarabel",
) -> Array:
    """Solve min ½ q̇ᵀ W q̇ subject to J q̇ = v and bounds; without bounds the answer is (3.50).

    Args:
        J: (m, n) Jacobian.
        v: (m,) task velocity [m/s, rad/s].
        W: (n, n) symmetric positive definite, or its diagonal (n,); None for I, which gives (3.51).
        bounds: Lower and upper bounds on q̇, (n,) each [rad/s]; None for none.
        engine: Solver that CVXPY uses, one of `ENGINES`.

    Returns:
        q̇ (n,) [rad/s].

    Raises:
        NotSolved: There is no such q̇, or the solver gave up.

    Source:
        The problem before (3.49).
    """
    m, n = J.shape
    root = np.eye(n) if W is None else np.linalg.cholesky(np.diag(W) if W.ndim == 1 else W).T
    L = np.asarray(root, dtype=np.float64)
    G, h = _bounds(bounds)
    return _answer(least_norm_program(n, m, len(h)), engine, {"C": J, "c": v, "L": L, "G": G, "h": h})


def nearest(
    J: Array, v: Array, v0: Array, bounds: tuple[Array, Array] | None = None, engine: str = "clarabel"
) -> Array:
    """Solve min ½ ‖q̇ − q̇₀‖² subject to J q̇ = v and bounds; without bounds the answer is (3.54).

    Args:
        J: (m, n) Jacobian.
        v: (m,) task velocity [m/s, rad/s].
        v0: (n,) the velocity q̇₀ [rad/s] to which q̇ is to be near.
        bounds: Lower and upper bounds on q̇, (n,) each [rad/s]; None for none.
        engine: Solver that CVXPY uses, one of `ENGINES`.

    Returns:
        q̇ (n,) [rad/s].

    Raises:
        NotSolved: There is no such q̇, or the solver gave up.

    Source:
        The problem before (3.53).
    """
    m, n = J.shape
    G, h = _bounds(bounds)
    return _answer(nearest_program(n, m, len(h)), engine, {"C": J, "c": v, "v0": v0, "G": G, "h": h})


def damped(
    J: Array, v: Array, k: float, bounds: tuple[Array, Array] | None = None, engine: str = "clarabel"
) -> Array:
    """Solve min ½ ‖v − J q̇‖² + ½ k² ‖q̇‖² within bounds; without bounds the answer is J* v (3.59).

    Args:
        J: (m, n) Jacobian.
        v: (m,) task velocity [m/s, rad/s].
        k: Damping factor.
        bounds: Lower and upper bounds on q̇, (n,) each [rad/s]; None for none.
        engine: Solver that CVXPY uses, one of `ENGINES`.

    Returns:
        q̇ (n,) [rad/s].

    Raises:
        NotSolved: The bounds are empty, or the solver gave up.

    Source:
        The problem after (3.59).
    """
    m, n = J.shape
    G, h = _bounds(bounds)
    return _answer(damped_program(n, m, len(h)), engine, {"J": J, "v": v, "k": k, "G": G, "h": h})


def as_inequalities(A: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return lower ≤ A x ≤ upper as rows G x ≤ h, the finite upper bounds first.

    Args:
        A: (m, n) rows.
        lower: (m,) lower bounds, −inf for none.
        upper: (m,) upper bounds, inf for none.

    Returns:
        G (p, n) and h (p,). Unlike `one_sided` it makes two inequalities of an equality.
    """
    above, below = upper < np.inf, lower > -np.inf
    return np.vstack([A[above], -A[below]]), np.concatenate([upper[above], -lower[below]])


def _bounds(bounds: tuple[Array, Array] | None) -> tuple[Array, Array]:
    """Return bounds on x as rows G x ≤ h."""
    if bounds is None:
        return np.empty((0, 0)), np.empty(0)
    lower, upper = (np.asarray(side, dtype=np.float64) for side in bounds)
    return as_inequalities(np.eye(len(lower)), lower, upper)


def _answer(program: Program, engine: str, values: Mapping[str, Array | float]) -> Array:
    """Solve and return x; raise `NotSolved` unless the solver claims an optimum."""
    found = program.solve(engine, values)
    if found.status is not Status.SOLVED:
        raise NotSolved(f"cvxpy/{engine}: {found.status.name.lower()}; {found.status.value}")
    return found.x


def _cvxpy() -> Any:
    """Import CVXPY when it is first needed; its operators are typed for scalars only, hence Any."""
    import cvxpy

    return cvxpy
