"""`cvxpy/<solver>`: the hierarchy as the chapter would state it, level by level, in CVXPY.

A reference to hold the others against. The unknowns are x itself; a level is met as a constraint
A x = b wherever that can be, as in (3.50), and in least squares where it cannot; the levels below keep
A_j x = A_j x_j* of those before. There is no null-space basis, and no row is scaled.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import qr

from taskopt.arrays import Array
from taskopt.hierarchy.equality import root_of
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy, LevelRows
from taskopt.hierarchy.rank import LOST
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import Memory, answered, final_state
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.unanswered import unanswered, unless_broken

ENGINES = ("daqp", "clarabel", "proxqp", "piqp", "highs", "osqp", "scs")  # that CVXPY speaks to
_MET = 1e-9  # relative to its largest term: a row that lacks less is met
_VIOLATED = 1e-7  # an inequality that lacks more, in least squares, is given up
_PRICED = 1e-6  # relative to the largest price: a bound with a price at one level is met at all below


@dataclass(frozen=True)
class Restated:
    """Strict priorities with any solver of CVXPY. What fails leaves its level, and those below, unserved.

    Status as for `hqp/<solver>`: INFEASIBLE, with x = NaN, where the limits leave nothing, ITERATION_LIMIT
    where a later statement failed. It takes milliseconds a level, so it is not for a control loop.
    """

    solver: str

    @property
    def name(self) -> str:
        return f"cvxpy/{self.solver}"

    @property
    def strict(self) -> bool:
        return True

    def __call__(
        self,
        hierarchy: Hierarchy,
        memory: Memory | None = None,  # noqa: ARG002 - each tick starts cold
    ) -> tuple[Resolution, Memory]:
        told = _Account(hierarchy, self.solver)
        for rows in hierarchy.levels:
            if told.status is Status.SOLVED:
                told.level(rows)
        if told.status is Status.SOLVED:
            told.finish()
        if not np.isfinite(told.x).all():
            return unanswered(hierarchy, told.status, told.iterations)
        y = find_multipliers(hierarchy, told.x)
        state = final_state(hierarchy, told.x, y)
        return unless_broken(answered(hierarchy, told.x, y, state, told.status, told.iterations))

    def twin(self, hierarchy: Hierarchy) -> Array:
        return task_priority(hierarchy)


class _Account:
    """Down the levels: x so far, C x = c that holds from here on, G x ≤ h that must be kept."""

    def __init__(self, hierarchy: Hierarchy, engine: str) -> None:
        from taskopt.solver import cvxpy  # takes most of a second to import

        self.chapter, self.engine, self.n = cvxpy, engine, hierarchy.n
        self.L = root_of(hierarchy.norm)
        self.x = np.full(self.n, np.nan)
        self.status, self.iterations = Status.SOLVED, 0
        self.least = False  # whether x has the least norm of all that the levels so far allow
        self.C, self.c = np.empty((0, self.n)), np.empty(0)
        self.G, self.h = np.empty((0, self.n)), np.empty(0)
        A = np.vstack([np.eye(self.n), hierarchy.limits.A])
        lower = np.concatenate([hierarchy.box_lower, hierarchy.limits.lower])
        upper = np.concatenate([hierarchy.box_upper, hierarchy.limits.upper])
        fixed = lower == upper
        if not self._reachable(A[fixed], upper[fixed]):
            self.status = Status.INFEASIBLE
        self.C, self.c = self._with(A[fixed], upper[fixed])
        self.G, self.h = cvxpy.one_sided(A[~fixed], lower[~fixed], upper[~fixed])

    def level(self, rows: LevelRows) -> None:
        """Resolve one level."""
        if len(self.c) == self.n and np.isfinite(self.x).all():
            return  # x is settled
        if not self._as_constraint(rows):
            self._in_least_squares(rows)

    def finish(self) -> None:
        """The least norm of what is still free, where no level has settled it."""
        if np.isfinite(self.x).all() and (self.least or len(self.c) == self.n):
            return
        found = self._least_norm(self.C, self.c, self.G, self.h)
        if found.status is Status.SOLVED:
            self.x = found.x
        else:
            self._stop(found.status)

    def _as_constraint(self, rows: LevelRows) -> bool:
        """min ½ xᵀ W x s.t. A x = b and all before (3.50); False where A x = b cannot be had."""
        equal = rows.lower == rows.upper
        A, b = rows.A[equal], rows.upper[equal]
        if not self._reachable(A, b):
            return False
        C, c = self._with(A, b)
        more, sides = self.chapter.one_sided(rows.A[~equal], rows.lower[~equal], rows.upper[~equal])
        G, h = np.vstack([self.G, more]), np.concatenate([self.h, sides])
        found = self._least_norm(C, c, G, h)
        if found.status is not Status.SOLVED or not _met(A, b, found.x):
            return False
        self.x, self.least = found.x, True
        self.C, self.c, self.G, self.h = C, c, G, h
        return True

    def _in_least_squares(self, rows: LevelRows) -> None:
        """min ½ Σ w d(x)² s.t. all before; what is lacking is then kept as it is."""
        equal = rows.lower == rows.upper
        A, b = rows.A[equal], rows.upper[equal]
        S, t = self.chapter.one_sided(rows.A[~equal], rows.lower[~equal], rows.upper[~equal])
        weight, _ = self.chapter.one_sided(rows.weight[~equal, None], rows.lower[~equal], rows.upper[~equal])
        root, soft_root = np.sqrt(rows.weight[equal]), np.sqrt(np.abs(weight[:, 0]))
        sizes = (self.n, len(self.c), len(self.h), len(b), len(t))
        statement = self.chapter.least_squares_statement(*sizes)
        found = statement.solve(
            self.engine,
            {"A": A, "b": b, "root": root, "S": S, "t": t, "soft_root": soft_root, **self._before()},
        )
        self.iterations += found.iterations
        if found.status is not Status.SOLVED:
            self._stop(found.status)
            return
        self.x, self.least = found.x, False
        priced = found.price > _PRICED * max(1e-3, float(found.price.max(initial=0.0)))
        value = S @ found.x
        lost = value - t > _VIOLATED * np.maximum(1.0, np.abs(value))
        self.C, self.c = self._with(
            np.vstack([A, S[lost], self.G[priced]]),
            np.concatenate([A @ found.x, value[lost], self.h[priced]]),
        )
        self.G = np.vstack([self.G[~priced], S[~lost]])
        self.h = np.concatenate([self.h[~priced], np.maximum(t, value)[~lost]])

    def _least_norm(self, C: Array, c: Array, G: Array, h: Array) -> Any:
        statement = self.chapter.least_norm_statement(self.n, len(c), len(h))
        found = statement.solve(self.engine, {"L": self.L, "C": C, "c": c, "G": G, "h": h})
        self.iterations += found.iterations
        return found

    def _before(self) -> dict[str, Array]:
        return {"C": self.C, "c": self.c, "G": self.G, "h": self.h}

    def _reachable(self, A: Array, b: Array) -> bool:
        """Whether A x = b has a solution beside C x = c: v in the range of J (Sect. 3.5.2)."""
        both, sides = np.vstack([self.C, A]), np.concatenate([self.c, b])
        size = np.maximum(np.linalg.norm(both, axis=1), 1e-300)
        x = np.linalg.lstsq(both / size[:, None], sides / size, rcond=LOST)[0]
        return _met(both, sides, x)

    def _with(self, A: Array, b: Array) -> tuple[Array, Array]:
        """C x = c and those rows of A x = b that do not follow from others; solvers stumble on the rest."""
        size = np.linalg.norm(A, axis=1)
        A, b = A[size > 0.0] / size[size > 0.0, None], b[size > 0.0] / size[size > 0.0]
        basis = np.linalg.qr(self.C.T)[0]
        fresh = A - (A @ basis) @ basis.T
        if not fresh.size:
            return self.C, self.c
        factors: Any = qr(fresh.T, mode="r", pivoting=True)  # what its annotation leaves open: two of them
        R, order = factors
        count = int(np.count_nonzero(np.abs(np.diagonal(R)) > LOST))
        new = np.sort(order[:count])
        return np.vstack([self.C, A[new]]), np.concatenate([self.c, b[new]])

    def _stop(self, status: Status) -> None:
        self.status = Status.ITERATION_LIMIT if np.isfinite(self.x).all() else status


def _met(A: Array, b: Array, x: Array) -> bool:
    scale = np.maximum(1.0, np.abs(A * x).max(axis=1, initial=0.0))
    return bool((np.abs(A @ x - b) <= _MET * scale).all())
