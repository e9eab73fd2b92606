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
from taskopt.problem.qp import QuadraticProgram, Solution
from taskopt.problem.resolution import Status
from taskopt.resolver.accuracy import Solve

VIOLATED = 1e-9  # relative to the row: more is a violation to be frozen, less is solver accuracy
_DEAD = 1e-9  # a row that keeps less of itself in the null space moves nothing
_PROXIMAL = (1e-4, 1e-2, 1.0)  # pull of directions that a level leaves open to where they were; in turn
_REPEATS = 20
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

    def contain(self, xi: Array) -> bool:
        """Whether ξ is inside all of them."""
        value = self.G @ xi
        gap = np.maximum(self.lower - value, value - self.upper)
        return bool((gap <= VIOLATED * np.maximum(1.0, np.abs(value))).all())

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


def least_violation(solve: Solve, equal: Split, soft: Rows, rows: Rows) -> Compromise:
    """min ½‖y₁ − U₁ᵀ d‖² + ½‖t‖² with the soft rows relaxed by t; a stronger pull where a solver fails."""
    found, iterations = None, 0
    for pull in _PROXIMAL:
        found = _proximal(solve, equal, soft, rows, pull)
        iterations += found.iterations
        if found.status in (Status.SOLVED, Status.INFEASIBLE):
            break
    assert found is not None
    return replace(found, iterations=iterations)


def _proximal(solve: Solve, equal: Split, soft: Rows, rows: Rows, pull: float) -> Compromise:
    """y₁ and t have a unit Hessian; y₂ has none of its own, so each step adds ½ρ‖y₂ − y₂ before‖².

    Through a row that binds, y₂ is worth Σ to y₁: it is measured in units of 1/σ_min, and rows have
    unit length, or the steps would be tiny near a singularity. Rockafellar (1976), SIAM J. Control and
    Optimization 14(5).
    """
    r, f, m = len(equal.goal), equal.free.shape[1], len(soft.lower)
    basis = np.hstack([equal.decided, equal.free / equal.sigma.min(initial=1.0)])
    slack = np.vstack([np.zeros((len(rows.lower), m)), -np.eye(m)])
    both = rows.joined(soft)
    C = np.hstack([both.G @ basis, slack])
    length = np.linalg.norm(C, axis=1)
    length[length == 0.0] = 1.0
    C /= length[:, None]
    H = np.diag(np.concatenate([np.ones(r), np.full(f, pull), np.ones(m)]))
    open_side = np.full(r + f + m, np.inf)
    before, iterations = np.zeros(f), 0
    for _ in range(_REPEATS):
        g = np.concatenate([-equal.goal, -pull * before, np.zeros(m)])
        lower, upper = both.lower / length, both.upper / length
        solution = solve(QuadraticProgram(H, g, C, lower, upper, -open_side, open_side))
        iterations += solution.iterations
        if solution.status is not Status.SOLVED:
            break
        now = solution.x[r : r + f]
        moved = float(np.abs(now - before).max(initial=0.0))
        before = now
        if moved <= _STILL * max(1.0, float(np.abs(now).max(initial=0.0))):
            break
    z = basis @ solution.x[: r + f]
    return Compromise(z, solution.x[r + f :], solution.y / length, solution.status, iterations)


def frozen(equal: Split, violated: Array, priced: Array) -> Array:
    """Basis (p, …) of what the levels below may still do, given the rows on z that hold from now on."""
    held = np.vstack(
        [equal.direction, *(rows / np.linalg.norm(rows, axis=1)[:, None] for rows in (violated, priced))]
    )
    _, sigma, Vt = np.linalg.svd(held)
    return Vt[int(np.count_nonzero(sigma > _DEAD)) :].T
