"""One level of a hierarchy as a quadratic program in the null space of the levels before.

State between levels: ξ (the answer so far), an orthonormal Z (n, p) of directions that are still
free, and the inequality rows that still bind them. Unknowns are ξ = L x with W = Lᵀ L, so that the
norm is ½ ξᵀξ and every program has a unit Hessian. Kanoun, Lamiraux and Wieber (2011), Sect. III;
Escande, Mansard and Wieber (2014), Sect. 2.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.resolver.solver_accuracy import Solve

VIOLATED = 1e-9  # relative to the row: more is a violation to be frozen, less is solver accuracy
_DEAD = 1e-9  # a row that keeps less of itself in the null space moves nothing
_PROXIMAL = (1e-4, 1e-2, 1.0)  # pull of directions that a level leaves open to where they were; in turn
_REPEATS = 20
_EASED = 0.7  # of the pull is left from step to step, so that steps grow where there is far to go
_THIN = 1e-3  # smallest σ, relative, in whose units z is measured: below it rows look parallel to a solver
_STILL = 1e-12  # a proximal step below it, relative, ends the repeats
PRICED = 1e-6  # multiplier relative to the largest: a row above it holds for all later levels


@dataclass(frozen=True, eq=False)
class Rows:
    """lower ≤ G ξ ≤ upper, `index` naming each row in (box, rows of the hierarchy)."""

    G: Array
    lower: Array
    upper: Array
    index: np.ndarray

    def kept(self, which: np.ndarray) -> "Rows":
        return Rows(self.G[which], self.lower[which], self.upper[which], self.index[which])

    def joined(self, other: "Rows") -> "Rows":
        return Rows(
            np.vstack([self.G, other.G]),
            np.concatenate([self.lower, other.lower]),
            np.concatenate([self.upper, other.upper]),
            np.concatenate([self.index, other.index]),
        )

    def contain(self, xi: Array, tolerance: float = VIOLATED) -> bool:
        """Whether ξ is inside all of them."""
        value = self.G @ xi
        gap = np.maximum(self.lower - value, value - self.upper)
        return bool((gap <= tolerance * np.maximum(1.0, np.abs(value))).all())

    def seen_from(self, xi: Array, Z: Array, feasible: bool) -> "Rows":
        """The same rows on z with ξ + Z z; dead ones dropped, and z = 0 inside if it is known to be."""
        projected = self.G @ Z
        alive = np.linalg.norm(projected, axis=1) > _DEAD * np.linalg.norm(self.G, axis=1)
        value = self.G[alive] @ xi
        lower, upper = self.lower[alive] - value, self.upper[alive] - value
        if feasible:
            lower, upper = np.minimum(lower, 0.0), np.maximum(upper, 0.0)
        return Rows(projected[alive], lower, upper, self.index[alive])


@dataclass(frozen=True, eq=False)
class Split:
    """Equality rows M z = d as U Σ Vᵀ z = d: y₁ = Σ V₁ᵀ z is decided by them, y₂ = V₂ᵀ z is not."""

    decided: Array  # V₁ Σ⁻¹ (p, r): z of y₁
    direction: Array  # V₁ᵀ (r, p)
    free: Array  # V₂ (p, p − r)
    goal: Array  # U₁ᵀ d (r,)
    sigma: Array  # (r,)


def split(M: Array, d: Array, rank: Callable[[Array], int]) -> Split:
    """Singular value decomposition; `rank` says how many of the singular values count."""
    U, sigma, Vt = np.linalg.svd(M)
    r = rank(sigma)
    return Split(Vt[:r].T / sigma[:r], Vt[:r], Vt[r:].T, U[:, :r].T @ d, sigma[:r])


def least_norm(solve: Solve, at: Array, equal: Split, rows: Rows) -> Solution:
    """min ½‖z + at‖² with the level met: V₁ᵀ z = Σ⁻¹ U₁ᵀ d and all rows inside."""
    p = equal.direction.shape[1]
    target = equal.goal / equal.sigma
    return solve(
        QuadraticProgram(
            np.eye(p),
            at,
            np.vstack([equal.direction, rows.G]),
            np.concatenate([target, rows.lower]),
            np.concatenate([target, rows.upper]),
            np.full(p, -np.inf),
            np.full(p, np.inf),
        )
    )


@dataclass(frozen=True, eq=False)
class Compromise:
    """z of a level that cannot be met, residuals t of its inequality rows, multipliers of all rows."""

    z: Array
    slack: Array
    multipliers: Array
    status: Status
    iterations: int
    whole: bool  # whether no step of it failed


def least_violation(solve: Solve, equal: Split, soft: Rows, rows: Rows) -> Compromise:
    """min ½‖y₁ − U₁ᵀ d‖² + ½‖t‖² with the soft rows relaxed by t; a stronger pull where a solver fails."""
    found, iterations = None, 0
    for pull in _PROXIMAL:
        tried = _proximal(solve, equal, soft, rows, pull)
        iterations += tried.iterations
        if found is None or tried.whole or found.status is not Status.SOLVED:
            found = tried
        if tried.whole:
            break
    assert found is not None
    return replace(found, iterations=iterations)


def _proximal(solve: Solve, equal: Split, soft: Rows, rows: Rows, pull: float) -> Compromise:
    """Steps that add ½ρ(1 − s²)(u − u before)² for each unknown u of z, s² being its own curvature.

    With u in units of 1/σ, s = 1; but along directions that are open, σ = 0, and along those that
    nearly are, units grow only to those of the smallest σ that is not thin. In longer ones all rows
    would look alike, in shorter ones steps would be tiny. Rows have unit length for the same reason.
    Rockafellar (1976), SIAM J. Control and Optimization 14(5).
    """
    p, m = equal.direction.shape[1], len(soft.lower)
    sigma = np.concatenate([equal.sigma, np.zeros(p - len(equal.sigma))])
    unit = np.maximum(sigma, max(float(equal.sigma.min(initial=1.0)), _THIN * float(sigma.max(initial=0.0))))
    share, goal = sigma / unit, np.concatenate([equal.goal, np.zeros(p - len(equal.goal))])
    basis = np.hstack([equal.direction.T, equal.free]) / unit
    slack = np.vstack([np.zeros((len(rows.lower), m)), -np.eye(m)])
    both = rows.joined(soft)
    C = np.hstack([both.G @ basis, slack])
    length = np.linalg.norm(C, axis=1)
    length[length == 0.0] = 1.0
    C /= length[:, None]
    held = pull * (1.0 - share**2)
    open_side, before = np.full(p + m, np.inf), np.zeros(p)
    lower, upper = both.lower / length, both.upper / length
    last, iterations = None, 0
    for _ in range(_REPEATS):
        H = np.diag(np.concatenate([share**2 + held, np.ones(m)]))
        g = np.concatenate([-share * goal - held * before, np.zeros(m)])
        solution = solve(QuadraticProgram(H, g, C, lower, upper, -open_side, open_side))
        iterations += solution.iterations
        if solution.status is not Status.SOLVED:
            break
        last, now = solution, solution.x[:p]
        moved = np.abs(now - before)[held > 0.0].max(initial=0.0)
        before, held = now, _EASED * held
        if moved <= _STILL * max(1.0, float(np.abs(now[held > 0.0]).max(initial=0.0))):
            break
    whole = solution.status is Status.SOLVED
    solution = last or solution
    z, slack = basis @ solution.x[:p], solution.x[p:]
    return Compromise(z, slack, solution.y / length, solution.status, iterations, whole)


def frozen(equal: Split, violated: Array, priced: Array) -> Array:
    """Basis (p, …) of what the levels below may still do, given the rows on z that hold from now on."""
    held = np.vstack(
        [equal.direction, *(rows / np.linalg.norm(rows, axis=1)[:, None] for rows in (violated, priced))]
    )
    _, sigma, Vt = np.linalg.svd(held)
    return Vt[int(np.count_nonzero(sigma > _DEAD)) :].T
