"""`cvxpy/<solver>`, which states a hierarchy level by level in CVXPY, as the chapter states its problems.

It is an independent model to compare the other resolvers with. The unknowns are x itself. A level becomes a
constraint A x = b wherever that can be satisfied, as in (3.50), and a least-squares problem where it cannot;
the levels below then keep A_j x = A_j x_j* of the levels before. There is no null-space basis, and no row is
scaled.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy, LevelRows
from taskopt.hierarchy.rank import root_of
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import CVXPY_ROW_MET, CVXPY_VIOLATION, LEVEL_MULTIPLIER, LOST
from taskopt.resolver.base import Memory, answered, final_state
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.infeasible import no_answer, refuse_broken_claim
from taskopt.solver.cvxpy import (
    ProgramSolution,
    as_inequalities,
    least_norm_program,
    least_squares_program,
)


@dataclass(frozen=True)
class CvxpyModel:
    """Resolve strict priorities with any solver that CVXPY can use.

    It promises the lexicographic optimum within the accuracy of the solver. If a program fails, its level and
    the levels below are not served and the status is ITERATION_LIMIT; the limits and the levels before are
    kept. The status is INFEASIBLE, with x = NaN, if the hard limits contradict each other. It is slow, since
    each level takes milliseconds. It does not use a warm start.

    Attributes:
        solver: Name of the solver, one of `taskopt.solver.cvxpy.ENGINES`.
    """

    solver: str

    @property
    def name(self) -> str:
        """Name of the resolver, such as "cvxpy/clarabel"."""
        return f"cvxpy/{self.solver}"

    @property
    def strict(self) -> bool:
        """True: priorities between levels are exact."""
        return True

    def __call__(
        self,
        hierarchy: Hierarchy,
        memory: Memory | None = None,  # noqa: ARG002 - it starts cold
    ) -> tuple[Resolution, Memory]:
        """Resolve one hierarchy.

        Args:
            hierarchy: The problem of this tick.
            memory: Ignored.

        Returns:
            The answer, and a memory with its active set.
        """
        cascade = _Cascade(hierarchy, self.solver)
        for rows in hierarchy.levels:
            if cascade.status is Status.SOLVED:
                cascade.level(rows)
        if cascade.status is Status.SOLVED:
            cascade.finish()
        if not np.isfinite(cascade.x).all():
            return no_answer(hierarchy, cascade.status, cascade.iterations)
        y = find_multipliers(hierarchy, cascade.x)
        state = final_state(hierarchy, cascade.x, y)
        return refuse_broken_claim(
            answered(hierarchy, cascade.x, y, state, cascade.status, cascade.iterations)
        )

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of `task_priority` on the equalities."""
        return task_priority(hierarchy)


class _Cascade:
    """The state between levels: x so far, the fixed rows C x = c, and the rows G x ≤ h to be kept."""

    def __init__(self, hierarchy: Hierarchy, engine: str) -> None:
        self.engine, self.n = engine, hierarchy.n
        self.L = root_of(hierarchy.norm)
        self.x = np.full(self.n, np.nan)
        self.status, self.iterations = Status.SOLVED, 0
        self.least = False  # whether x has the least norm of all that the levels so far allow
        self.C, self.c = np.empty((0, self.n)), np.empty(0)
        self.G, self.h = np.empty((0, self.n)), np.empty(0)
        A = np.vstack([np.eye(self.n), hierarchy.limits.A])
        lower, upper = hierarchy.bounds(len(hierarchy.limits.lower))
        fixed = lower == upper
        if not self._reachable(A[fixed], upper[fixed]):
            self.status = Status.INFEASIBLE
        self.C, self.c = self._with(A[fixed], upper[fixed])
        self.G, self.h = as_inequalities(A[~fixed], lower[~fixed], upper[~fixed])

    def level(self, rows: LevelRows) -> None:
        """Resolve one level, given its rows."""
        if len(self.c) == self.n and np.isfinite(self.x).all():
            return  # the levels before decide x completely
        if not self._as_constraint(rows):
            self._in_least_squares(rows)

    def finish(self) -> None:
        """Minimise the norm over what is still free, unless x has the least norm already."""
        if np.isfinite(self.x).all() and (self.least or len(self.c) == self.n):
            return
        found = self._least_norm(self.C, self.c, self.G, self.h)
        if found.status is Status.SOLVED:
            self.x = found.x
        else:
            self._stop(found.status)

    def _as_constraint(self, rows: LevelRows) -> bool:
        """Solve min ½ xᵀ W x s.t. A x = b and all rows before (3.50); return False if A x = b cannot hold."""
        equal = rows.lower == rows.upper
        A, b = rows.A[equal], rows.upper[equal]
        if not self._reachable(A, b):
            return False
        C, c = self._with(A, b)
        own_G, own_h = as_inequalities(rows.A[~equal], rows.lower[~equal], rows.upper[~equal])
        G, h = np.vstack([self.G, own_G]), np.concatenate([self.h, own_h])
        found = self._least_norm(C, c, G, h)
        if found.status is not Status.SOLVED or not _met(A, b, found.x):
            return False
        self.x, self.least = found.x, True
        self.C, self.c, self.G, self.h = C, c, G, h
        return True

    def _in_least_squares(self, rows: LevelRows) -> None:
        """Solve min ½ Σ w d(x)² s.t. all rows before, and fix the residuals for the levels below."""
        equal = rows.lower == rows.upper
        A, b = rows.A[equal], rows.upper[equal]
        lower, upper = rows.lower[~equal], rows.upper[~equal]
        S, t = as_inequalities(rows.A[~equal], lower, upper)
        signed_weight, _ = as_inequalities(rows.weight[~equal, None], lower, upper)
        program = least_squares_program(self.n, len(self.c), len(self.h), len(b), len(t))
        own = {"A": A, "b": b, "root": np.sqrt(rows.weight[equal]), "S": S, "t": t}
        own["soft_root"] = np.sqrt(np.abs(signed_weight[:, 0]))
        found = program.solve(self.engine, {**own, "C": self.C, "c": self.c, "G": self.G, "h": self.h})
        self.iterations += found.iterations
        if found.status is not Status.SOLVED:
            self._stop(found.status)
            return
        self.x, self.least = found.x, False
        holds = found.multipliers > LEVEL_MULTIPLIER * max(1e-3, float(found.multipliers.max(initial=0.0)))
        value = S @ found.x
        violated = value - t > CVXPY_VIOLATION * np.maximum(1.0, np.abs(value))
        self.C, self.c = self._with(
            np.vstack([A, S[violated], self.G[holds]]),
            np.concatenate([A @ found.x, value[violated], self.h[holds]]),
        )
        self.G = np.vstack([self.G[~holds], S[~violated]])
        self.h = np.concatenate([self.h[~holds], np.maximum(t, value)[~violated]])

    def _least_norm(self, C: Array, c: Array, G: Array, h: Array) -> ProgramSolution:
        """Solve min ½ xᵀ W x s.t. C x = c and G x ≤ h, and count its iterations."""
        program = least_norm_program(self.n, len(c), len(h))
        found = program.solve(self.engine, {"L": self.L, "C": C, "c": c, "G": G, "h": h})
        self.iterations += found.iterations
        return found

    def _reachable(self, A: Array, b: Array) -> bool:
        """Return True if A x = b and C x = c have a common solution: v in the range of J (Sect. 3.5.2)."""
        rows, sides = np.vstack([self.C, A]), np.concatenate([self.c, b])
        size = np.maximum(np.linalg.norm(rows, axis=1), 1e-300)
        x = np.linalg.lstsq(rows / size[:, None], sides / size, rcond=LOST)[0]
        return _met(rows, sides, x)

    def _with(self, A: Array, b: Array) -> tuple[Array, Array]:
        """Return C x = c with the independent rows of A x = b, since dependent rows make solvers fail."""
        size = np.linalg.norm(A, axis=1)
        A, b = A[size > 0.0] / size[size > 0.0, None], b[size > 0.0] / size[size > 0.0]
        basis = np.linalg.qr(self.C.T)[0]
        rest = A - (A @ basis) @ basis.T
        if not rest.size:
            return self.C, self.c
        factors: tuple[Array, IntArray] = qr(rest.T, mode="r", pivoting=True)  # type: ignore[assignment]
        R, order = factors
        count = int(np.count_nonzero(np.abs(np.diagonal(R)) > LOST))
        new = np.sort(order[:count])
        return np.vstack([self.C, A[new]]), np.concatenate([self.c, b[new]])

    def _stop(self, status: Status) -> None:
        """Note a status other than SOLVED; if x is known already, the status is ITERATION_LIMIT."""
        self.status = Status.ITERATION_LIMIT if np.isfinite(self.x).all() else status


def _met(A: Array, b: Array, x: Array) -> bool:
    """Return True if A x = b to rounding, row by row."""
    scale = np.maximum(1.0, np.abs(A * x).max(axis=1, initial=0.0))
    return bool((np.abs(A @ x - b) <= CVXPY_ROW_MET * scale).all())
