"""One level of a hierarchy as a quadratic program in the null space of the levels before.

The unknowns of the whole cascade are ξ = L x with W = Lᵀ L, so that the norm is ½ ξᵀ ξ. A level is solved for
z, with ξ + Z z, where ξ is the answer of the levels before and the columns of Z (n, p) are an orthonormal
basis of the directions that they left free. Its equality rows M z = d are decomposed into M = U Σ Vᵀ. The
rows decide y₁ = Σ V₁ᵀ z and leave y₂ = V₂ᵀ z free.

Source: Kanoun, Lamiraux and Wieber (2011), IEEE Trans. Robotics 27(4), Sect. III; Escande, Mansard and Wieber
(2014), Int. J. Robotics Research 33(7), Sect. 2.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.intervals import excess
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import (
    LEVEL_VIOLATION,
    PROXIMAL_NOISE,
    PROXIMAL_STEP,
    REDUNDANT_ROW,
    ROUNDING_SHARE,
    SHORT_ROW,
    THIN_DIRECTION,
)
from taskopt.resolver.solver_accuracy import SolveProgram

_PULLS = (1e-4, 1e-2, 1.0)  # weights of the proximal term; a stronger one is tried where a solver fails
_REPEATS = 20  # proximal steps at most
_EASED = 0.5  # share of the pull that is left from step to step, so that steps grow where there is far to go


@dataclass(frozen=True, eq=False)
class RowSet:
    """A set of rows lower ≤ G ξ ≤ upper.

    Attributes:
        G: (m, n) rows on ξ, or (m, p) rows on z.
        lower: (m,) lower bounds.
        upper: (m,) upper bounds.
        index: (m,) position of each row among the unknowns and rows of the hierarchy, n + M of them.
    """

    G: Array
    lower: Array
    upper: Array
    index: IntArray

    def selected(self, which: Mask) -> "RowSet":
        """Return the rows for which a mask is True.

        Args:
            which: Mask, (m,).

        Returns:
            The rows, as copies.
        """
        return RowSet(self.G[which], self.lower[which], self.upper[which], self.index[which])

    def joined(self, other: "RowSet") -> "RowSet":
        """Return these rows followed by those of another set.

        Args:
            other: Rows on the same unknowns.

        Returns:
            The rows of both.
        """
        return RowSet(
            np.vstack([self.G, other.G]),
            np.concatenate([self.lower, other.lower]),
            np.concatenate([self.upper, other.upper]),
            np.concatenate([self.index, other.index]),
        )

    def contain(self, xi: Array, tolerance: float = LEVEL_VIOLATION) -> bool:
        """Return True if a point keeps all rows.

        Args:
            xi: (n,) the point ξ.
            tolerance: Violation that counts as none, relative to max(1, |G ξ|).

        Returns:
            True if no row is violated by more.
        """
        value = self.G @ xi
        gap = excess(value, self.lower, self.upper)
        return bool((gap <= tolerance * np.maximum(1.0, np.abs(value))).all())

    def seen_from(self, xi: Array, Z: Array, feasible: bool) -> "RowSet":
        """Return the same rows on z, where ξ + Z z is substituted for ξ.

        Args:
            xi: (n,) the answer so far.
            Z: (n, p) basis of the free directions.
            feasible: True if ξ is known to keep the rows. Bounds that it violates by rounding errors are then
                moved so that z = 0 keeps them, and the program has a feasible point for certain.

        Returns:
            Rows on z, without the rows that vanish in the null space.
        """
        projected = self.G @ Z
        alive = np.linalg.norm(projected, axis=1) > REDUNDANT_ROW * np.linalg.norm(self.G, axis=1)
        value = self.G[alive] @ xi
        lower, upper = self.lower[alive] - value, self.upper[alive] - value
        if feasible:
            lower, upper = np.minimum(lower, 0.0), np.maximum(upper, 0.0)
        return RowSet(projected[alive], lower, upper, self.index[alive])


@dataclass(frozen=True, eq=False)
class RowSVD:
    """Equality rows M z = d by singular values, M = U Σ Vᵀ with r values that count.

    Attributes:
        direction: (r, p) V₁ᵀ, the directions that the rows decide.
        free: (p, p − r) V₂, the directions that they leave free.
        goal: (r,) U₁ᵀ d, the right-hand side in those directions.
        sigma: (r,) the singular values that count, falling.
        shortest: Length of the shortest row before projection over that of the longest.
    """

    direction: Array
    free: Array
    goal: Array
    sigma: Array
    shortest: float = 1.0

    @property
    def solution(self) -> Array:
        """z (p,) = V₁ Σ⁻¹ U₁ᵀ d, the least z that meets the rows."""
        return self.direction.T @ (self.goal / self.sigma)


def row_svd(M: Array, d: Array, rank: Callable[[Array], int]) -> RowSVD:
    """Decompose equality rows M z = d.

    Args:
        M: (m, p) rows.
        d: (m,) right-hand sides.
        rank: Function that returns how many of the singular values (falling) count.

    Returns:
        The decomposition.
    """
    U, sigma, Vt = np.linalg.svd(M)
    r = rank(sigma)
    return RowSVD(Vt[:r], Vt[r:].T, U[:, :r].T @ d, sigma[:r])


def shortest_row(G: Array) -> float:
    """Return the length of the shortest row that is not zero over that of the longest.

    Args:
        G: (m, n) rows.

    Returns:
        The ratio; 1 without rows.
    """
    length = np.linalg.norm(G, axis=1)
    length = length[length > 0.0]
    return float(length.min() / length.max()) if len(length) else 1.0


def hides_short_rows(G: Array, M: Array, rank: int, lost: float) -> bool:
    """Return True if rows had a higher rank if all of them were of length one.

    Singular values of rows of different lengths tell a short row from a dependent one only while it is longer
    than the smallest value that counts.

    Args:
        G: (m, n) rows before projection.
        M: (m, p) the same rows in the null space of the levels before.
        rank: Rank that was decided.
        lost: Relative singular value at or below which a direction is lost.

    Returns:
        True if a direction is lost by the length of its row.
    """
    length = np.linalg.norm(G, axis=1)
    alive = np.linalg.norm(M, axis=1) > REDUNDANT_ROW * length
    if np.count_nonzero(alive) <= rank or length[alive].min() > SHORT_ROW * length.max():
        return False
    sigma = np.linalg.svd(M[alive] / length[alive, None], compute_uv=False)
    return int(np.count_nonzero(sigma > lost)) > rank


def least_norm_solution(solve: SolveProgram, offset: Array, equal: RowSVD, rows: RowSet) -> Solution:
    """Solve min ½ ‖z + offset‖² subject to V₁ᵀ z = Σ⁻¹ U₁ᵀ d and rows, which meets the level exactly.

    Equality rows keep the raw answer accurate, whereas normal equations would square the condition number.

    Args:
        solve: Solves programs with a diagonal H.
        offset: (p,) Zᵀ ξ, so that ‖z + offset‖ is ‖ξ + Z z‖ up to a constant.
        equal: Equality rows of the level on z.
        rows: Inequality rows on z that must hold.

    Returns:
        The solution of the solver; its status is not SOLVED if the level cannot be met.
    """
    p = equal.direction.shape[1]
    goal = equal.goal / equal.sigma
    return solve(
        QuadraticProgram(
            np.eye(p),
            offset,
            np.vstack([equal.direction, rows.G]),
            np.concatenate([goal, rows.lower]),
            np.concatenate([goal, rows.upper]),
            np.full(p, -np.inf),
            np.full(p, np.inf),
        )
    )


@dataclass(frozen=True, eq=False)
class LeastViolation:
    """The answer to a level that cannot be met.

    Attributes:
        z: (p,) the answer.
        multipliers: Multipliers of the rows that must hold, followed by those of the level's inequalities.
        status: Claim of the solver.
        iterations: Iterations of all programs that were solved.
        complete: True if every proximal step was solved, and the last one moved by no more than rounding.
    """

    z: Array
    multipliers: Array
    status: Status
    iterations: int
    complete: bool


def least_violation(solve: SolveProgram, equal: RowSVD, soft: RowSet, rows: RowSet) -> LeastViolation:
    """Solve min ½ ‖y₁ − U₁ᵀ d‖² + ½ ‖t‖², in which soft rows may be violated by t and the others must hold.

    Args:
        solve: Solves programs with a diagonal H.
        equal: Equality rows of the level on z.
        soft: Inequality rows of the level on z.
        rows: Inequality rows on z that must hold.

    Returns:
        The answer with the smallest proximal term for which no step failed; if there is none, the answer with
        the last term that gave one.
    """
    found = _proximal(solve, equal, soft, rows, _PULLS[0])
    iterations = found.iterations
    for pull in _PULLS[1:]:
        if found.complete:
            break
        tried = _proximal(solve, equal, soft, rows, pull)
        iterations += tried.iterations
        if tried.complete or found.status is not Status.SOLVED:
            found = tried
    return replace(found, iterations=iterations)


def _proximal(solve: SolveProgram, equal: RowSVD, soft: RowSet, rows: RowSet, pull: float) -> LeastViolation:
    """Solve the least-squares level by proximal steps, which make the Hessian positive definite.

    Each step adds ½ ρ (1 − s²)(u − u_last)² for every unknown u of z, with its own curvature s². In units of
    1/σ the curvature is one. Along directions that the rows leave free (σ = 0) or nearly free, the unit is
    that of the smallest σ above THIN_DIRECTION: with longer units all rows would look parallel to a solver,
    and with shorter ones the steps would be tiny. Rows are scaled to unit length for the same reason.

    Source:
        Rockafellar (1976), SIAM J. Control and Optimization 14(5).
    """
    p, m = equal.direction.shape[1], len(soft.lower)
    basis, share, goal = _scaled_unknowns(equal)
    both = rows.joined(soft)
    slack = np.vstack([np.zeros((len(rows.lower), m)), -np.eye(m)])
    C = np.hstack([both.G @ basis, slack])
    length = np.linalg.norm(C, axis=1)
    length[length == 0.0] = 1.0
    C /= length[:, None]
    weight = pull * (1.0 - share**2)
    unbounded, previous = np.full(p + m, np.inf), np.zeros(p)
    lower, upper = both.lower / length, both.upper / length
    last, iterations, moved, converged = None, 0, np.inf, False
    for _ in range(_REPEATS):
        H = np.diag(np.concatenate([share**2 + weight, np.ones(m)]))
        g = np.concatenate([-share * goal - weight * previous, np.zeros(m)])
        solution = solve(QuadraticProgram(H, g, C, lower, upper, -unbounded, unbounded))
        iterations += solution.iterations
        if solution.status is not Status.SOLVED:
            break
        now, pulled, before = solution.x[:p], weight > 0.0, moved
        moved = np.abs(now - previous)[pulled].max(initial=0.0)
        size = max(1.0, float(np.abs(now[pulled]).max(initial=0.0)))
        noise = max(PROXIMAL_STEP, ROUNDING_SHARE / float((share**2 + weight).min(initial=1.0)))
        if before <= moved <= PROXIMAL_NOISE * size:  # rounding errors, which grow as the weight is eased
            converged = True
            break
        last, previous, weight = solution, now, _EASED * weight
        converged = moved <= noise * size
        if converged:
            break
    complete = solution.status is Status.SOLVED and converged
    solution = last or solution
    z = basis @ solution.x[:p]
    return LeastViolation(z, solution.y / length, solution.status, iterations, complete)


def _scaled_unknowns(equal: RowSVD) -> tuple[Array, Array, Array]:
    """Return the basis (p, p) of z in units u of its own, the root s (p,) of their curvature, and U₁ᵀ d."""
    p = equal.direction.shape[1]
    sigma = np.concatenate([equal.sigma, np.zeros(p - len(equal.sigma))])
    smallest, largest = float(equal.sigma.min(initial=1.0)), float(sigma.max(initial=0.0))
    unit = np.maximum(sigma, max(smallest, THIN_DIRECTION * largest))
    goal = np.concatenate([equal.goal, np.zeros(p - len(equal.goal))])
    return np.hstack([equal.direction.T, equal.free]) / unit, sigma / unit, goal


def free_directions(equal: RowSVD, violated: Array, active: Array) -> Array:
    """Return a basis of the directions that the levels below may still use.

    Args:
        equal: Equality rows of the level on z, whose residuals are kept.
        violated: (·, p) inequality rows of the level that are violated, whose residuals are kept.
        active: (·, p) rows that hold this level back and must stay at their bounds.

    Returns:
        (p, ·) orthonormal columns.
    """
    kept = [rows / np.linalg.norm(rows, axis=1)[:, None] for rows in (violated, active)]
    _, sigma, Vt = np.linalg.svd(np.vstack([equal.direction, *kept]))
    return Vt[int(np.count_nonzero(sigma > REDUNDANT_ROW)) :].T
