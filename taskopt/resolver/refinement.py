"""Refinement of a solver's answer by the solver itself, in the unit of what the answer still misses.

Interior points end where the products of distances and multipliers are about 1e-15. Where a bound holds with
a multiplier of zero, both are the square root of that, and x is off by 3e-8. The natural residual

    ρ = max( |H x + g + Cᵀ y| / diag H,  |v − clip(v + y / min diag H, lower, upper)| ),   v = C x,

shows such an error, because it does not multiply distances with multipliers: up to the condition of the
program it bounds the distance from the optimum. The answer is therefore moved by s / zoom, where s solves the
same program seen from it and enlarged. Rows whose multiplier is far beyond the residual are equalities there,
bounds that are far beyond it are out of reach, and ties are what is left to decide, at size one.

Source: Weber, Sager and Gleixner (2019), "Solving quadratic programs to high precision using scaled iterative
refinement", Mathematical Programming Computation 11; for the residual Pang (1987), Mathematics of Operations
Research 12(3).
"""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import qr, solve_triangular

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import (
    CLAIM_SHARE,
    HELD_MULTIPLIER,
    MOST_ZOOM,
    NEAR_OPTIMUM,
    REDUNDANT_ROW,
    ROUNDING_SHARE,
    SOLVER_SHARE,
    ZOOMED_TOLERANCE,
)
from taskopt.solver.base import Solve

_ROUNDS = 3  # refinements at most; one is enough as a rule
_PROGRESS = 0.1  # share of the residual that a refinement leaves at most, if another one is to follow


def refined(solve: Solve, qp: QuadraticProgram, found: Solution, accuracy: float) -> Solution:
    """Refine an answer, and decide by its residual whether it is the optimum, whatever the solver claims.

    An answer far from the optimum is not refined: a solver that failed at size one fails again.

    Args:
        solve: The solver.
        qp: A program of about unit size with a diagonal H and rows of length one.
        found: Answer of the solver.
        accuracy: Error of x that is asked for.

    Returns:
        The answer with the least residual. Its status is SOLVED if the residual is below `CLAIM_SHARE` ·
        accuracy, or below the rounding errors of its sums. Otherwise it is that of `found`, with
        ITERATION_LIMIT for SOLVED.
    """
    if not has_numbers(found):
        return found
    best, residual = found, natural_residual(qp, found)
    rounding = ROUNDING_SHARE / float(np.diagonal(qp.H).min(initial=1.0))
    iterations = found.iterations
    for _ in range(_ROUNDS):
        if not max(SOLVER_SHARE * accuracy, rounding) < residual < NEAR_OPTIMUM:
            break
        step = _from_nearby(solve, qp, best, residual)
        iterations += step.iterations
        left = natural_residual(qp, step) if has_numbers(step) else np.inf
        before = residual
        if left < before:
            best, residual = step, left
        if left > _PROGRESS * before:
            break
    status = Status.ITERATION_LIMIT if found.status is Status.SOLVED else found.status
    if residual <= min(max(CLAIM_SHARE * accuracy, rounding), accuracy):
        status = Status.SOLVED
    return replace(best, status=status, iterations=iterations)


def natural_residual(qp: QuadraticProgram, found: Solution) -> float:
    """Return the natural residual of an answer in the unit of x; see the module.

    Of H x + g + Cᵀ y only the part counts that no other multipliers of the rows that hold x, with the same
    signs, explain: rounding errors of large multipliers move no x that their rows hold in place.

    Args:
        qp: The program; H must be diagonal and positive.
        found: The answer, finite.

    Returns:
        The residual; 0 at the optimum only.
    """
    C, lower, upper = _all_rows(qp)
    y, curvature = _multipliers(found), np.diagonal(qp.H)
    value = C @ found.x
    off = np.abs(value - np.clip(value + y / curvature.min(initial=1.0), lower, upper))
    slope = curvature * found.x + qp.g + C.T @ y
    if np.abs(slope).max(initial=0.0) > ROUNDING_SHARE:
        slope = _unexplained(slope, C, y)
    return float(max((np.abs(slope) / curvature).max(initial=0.0), off.max(initial=0.0)))


def _unexplained(slope: Array, C: Array, y: Array) -> Array:
    """Return the part of a gradient that is orthogonal to the rows whose multipliers are large beside it."""
    rows = np.flatnonzero(np.abs(y) > HELD_MULTIPLIER * np.abs(slope).max())
    if not len(rows):
        return slope
    Q, R, chosen = _independent(C[rows])
    part = Q.T @ slope
    change = np.abs(solve_triangular(R, part))
    return slope if (change >= np.abs(y[rows[chosen]])).any() else slope - Q @ part


def has_numbers(found: Solution) -> bool:
    """Return True if all numbers of an answer are finite.

    Args:
        found: The answer.

    Returns:
        False if an entry is inf or NaN.
    """
    return all(bool(np.isfinite(part).all()) for part in (found.x, found.y, found.y_box))


def _from_nearby(solve: Solve, qp: QuadraticProgram, found: Solution, residual: float) -> Solution:
    """Solve the program seen from an answer, enlarged until its residual has about size one."""
    m, zoom = len(qp.C), min(1.0 / residual, MOST_ZOOM)
    C, lower, upper = _all_rows(qp)
    least = float(np.diagonal(qp.H).min(initial=1.0))
    y = _multipliers(found)
    held = (lower == upper) | (np.abs(y) > HELD_MULTIPLIER * residual * least)
    y = np.where(held, y, 0.0)
    value = C @ found.x
    low = zoom * (np.where(held & (y > 0.0), upper, lower) - value)
    high = zoom * (np.where(held & (y < 0.0), lower, upper) - value)
    implied = _dependent(C, held)
    low[implied], high[implied] = -np.inf, np.inf
    g = zoom * (qp.H @ found.x + qp.g + C.T @ y)
    program = QuadraticProgram(qp.H, g, qp.C, low[:m], high[:m], low[m:], high[m:])
    step = solve(program, least * ZOOMED_TOLERANCE)
    x, moved = found.x + step.x / zoom, y + _multipliers(step) / zoom
    return replace(step, x=x, y=moved[:m], y_box=moved[m:])


def _dependent(C: Array, held: Mask) -> Mask:
    """Return which held rows the other held rows imply, so that the equalities are independent."""
    implied, rows = held.copy(), np.flatnonzero(held)
    if len(rows):
        implied[rows[_independent(C[rows])[2]]] = False
    return implied


def _independent(rows: Array) -> tuple[Array, Array, IntArray]:
    """Return Q (n, r) and R (r, r) of r independent rows of (m, n), and the numbers of these rows."""
    factors: Any = qr(rows.T, mode="economic", pivoting=True)
    Q, R, order = factors
    rank = int(np.count_nonzero(np.abs(np.diagonal(R)) > REDUNDANT_ROW))
    return Q[:, :rank], R[:rank, :rank], order[:rank]


def _all_rows(qp: QuadraticProgram) -> tuple[Array, Array, Array]:
    """Return the rows, the box among them, with their bounds."""
    C = np.vstack([qp.C, np.eye(qp.n)])
    return C, np.concatenate([qp.lower, qp.box_lower]), np.concatenate([qp.upper, qp.box_upper])


def _multipliers(found: Solution) -> Array:
    """Return the multipliers of the rows and of the box."""
    return np.concatenate([found.y, found.y_box])
