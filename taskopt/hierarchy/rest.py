"""Damping without parameters, with which a robot comes to rest where its tasks cannot be met.

Where a still target is out of reach, or blocked by limits, the error e that remains is orthogonal to what the
free joints can do: their Jacobian has lost rank. Without damping, a level that follows A v = b is stable
there only where σ² is larger than about Δt times the second derivative of the task along v times what remains
of b. Else each tick, although it is optimal, throws the arm back and forth for ever. Damping of

    k_i² = max(0, ε² − σ_i²),    ε² = Δt Σ_g R_g ‖r_g(ε)‖,    r(ε) = b − Σ_i σ_i²/(σ_i² + ε²) u_i u_iᵀ b

in the direction v_i makes the step stable, whatever gain and Δt are. σ_i, u_i and v_i are the singular values
and vectors of the rows √w A, restricted to what is free: joints that a limit on positions holds are not, and
neither are directions that hard rows or levels before decide. r(ε) is the part of b that the level could not
meet with damping ε in all directions, so that nothing is damped where a level can be met. The largest ε is
taken. Where b has a part in one direction only, ε² + σ² = Δt R |uᵀb|: damping begins with k = 0 where σ² is
half of that, which is where undamped steps begin to throw the arm back and forth. The groups g are the
rows of one task and unit; R_g, the largest norm of a column of the group, is the lever arm of a joint on the
group and bounds its second derivative.

The damped level decides more directions the nearer it is to the loss of rank, and its null space turns
quickly there. What its free directions n do is therefore damped, too, in the level below, by rows √μ n that
vanish as the smallest σ reaches ε. Nothing is taken from lower levels before, and joints that do not move the
tasks of the level stay free.

A level that is met turns its null space quickly, too, where it is near a loss of rank. With λ its multipliers
in the optimum of the level below, Aᵀ λ = A₂ᵀ (A₂ x − b₂), the cost of that level has the second derivative
λᵀ f″ along n besides its own n A₂ᵀ A₂ n, and λ grows as 1/σ: at a target at full stretch, the posture throws
the arm back and forth although every level is met. Free directions are damped in the level below by what
Δt Σ_g R_g ‖λ_g‖ is more than the weight of that level. Only weak directions count, with σ a small part of a
lever arm, by 1 − σ²/σ₀²: elsewhere the bound by lever arms would be far too large.

Source: the threshold is that of the step of Gauss and Newton, as in Pfeiffer, Escande, Gergondet and Kheddar
(2023), "The Hierarchical Newton's Method for Numerically Stable Prioritized Dynamic Control".
"""

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.directions import singular_values
from taskopt.hierarchy.tolerances import DEPENDENT_DIRECTION, NEAR_LOSS, REST_LEAST, THRESHOLD_FOUND
from taskopt.jit import kernel, kernel_apart

_ROUNDS = 60  # of the fixed point of ε²; its first value is an upper bound, and each round lowers it


Parts = tuple[Array, Array, Array]
"""Singular values of a level, see `parts_of`."""


@kernel_apart
def parts_of(A: Array, free: Array) -> Parts:
    """Compute the singular values of a level within the directions that are free to it.

    Args:
        A: Rows of the level, each times √w, (m, n).
        free: Orthonormal basis of the directions that are free, one in each row, (f, n).

    Returns:
        U, σ in falling order and Vᵀ of A Zᵀ, with the directions Z; the last dimension is min(m, f).
    """
    if A.shape[0] == 0 or free.shape[0] == 0:
        return np.zeros((A.shape[0], 0)), np.zeros(0), np.zeros((0, free.shape[0]))
    return singular_values(_turned(A, free))


@kernel_apart
def damped_directions(
    A: Array, parts: Parts, b: Array, group: IntArray, free: Array, taken: int, dt: float, rows: Array
) -> tuple[float, float, int]:
    """Find the damping of one level.

    Args:
        A: Rows of the level, each times √w, (m, n).
        parts: Their singular values, see `parts_of`.
        b: Right-hand sides, each times √w, less what the held directions contribute, (m,).
        group: Number of the group of each curved row, by task and unit, from 1 on; 0 or less for a row that
            is not curved, (m,). The rows of a group stand together.
        free: Orthonormal basis of the directions that are free, one in each row, (f, n).
        taken: Number of directions that the level lacks because levels before it have them; these are no loss
            of rank to be damped.
        dt: Δt [s].
        rows: (≥ min(m, f), n) filled with k_i v_iᵀ for each damped direction.

    Returns:
        The threshold ε², in the unit of σ²; the gate 1 − σ_min²/ε²; and the number of damped directions. All
        are 0 if nothing is damped.
    """
    m, f = A.shape[0], free.shape[0]
    levers = _levers(A, group)
    if m == 0 or f == 0 or levers.max() == 0.0:
        return 0.0, 0.0, 0
    U, sigma, Vt = parts
    weak = sigma.size - taken  # the first of them may be damped
    if weak <= 0:
        return 0.0, 0.0, 0
    least = max(REST_LEAST, sigma[weak - 1] ** 2)
    inside, left = np.zeros(sigma.size), b.copy()
    for a in range(sigma.size):
        for i in range(m):
            inside[a] += U[i, a] * b[i]
    limit, lower = dt * _weighed(left, group, levers), 0.0
    for _ in range(_ROUNDS):
        if limit <= least:
            return 0.0, 0.0, 0
        for i in range(m):
            left[i] = b[i]
            for a in range(sigma.size):
                square = sigma[a] * sigma[a]
                left[i] -= U[i, a] * (square / (square + limit) * inside[a])
        lower = dt * _weighed(left, group, levers)
        found = lower > (1.0 - THRESHOLD_FOUND) * limit
        limit = lower
        if found:
            break
    count, weakest = 0, 0.0
    for a in range(weak):
        square = sigma[a] * sigma[a]
        if limit >= REST_LEAST and square < limit:
            _turn_back(Vt, a, free, np.sqrt(limit - square), rows[count])
            count, weakest = count + 1, square
    return (limit, 1.0 - weakest / limit, count) if count > 0 else (0.0, 0.0, 0)


@kernel_apart
def swing_below(
    A: Array, parts: Parts, group: IntArray, free: Array, pull: Array, limit: float, dt: float
) -> float:
    """Bound what the bending of a level adds to the second derivative of the cost of the level below.

    Args:
        A: Rows of the level, each times √w, (m, n).
        parts: Their singular values, see `parts_of`.
        group: As of `damped_directions`.
        free: Orthonormal basis of the directions that are free to the level, one in each row, (f, n).
        pull: Gradient A₂ᵀ (A₂ x − b₂) of the cost of the level below, (n,).
        limit: ε² of the level, below which no σ² counts.
        dt: Δt [s].

    Returns:
        Δt Σ_g R_g ‖λ_g‖, in the unit of A₂².
    """
    m, n = A.shape
    levers = _levers(A, group)
    if m == 0 or free.shape[0] == 0 or levers.max() == 0.0:
        return 0.0
    U, sigma, Vt = parts
    prices, row, near = np.zeros(m), np.empty(n), NEAR_LOSS * levers.max()
    for a in range(sigma.size):
        if DEPENDENT_DIRECTION * near < sigma[a] < near:
            weak = 1.0 - (sigma[a] / near) ** 2
            _turn_back(Vt, a, free, weak / np.sqrt(max(sigma[a] * sigma[a], limit)), row)
            price = np.dot(row, pull)
            for i in range(m):
                prices[i] += U[i, a] * price
    return dt * _weighed(prices, group, levers)


@kernel
def rank_within(A: Array, free: Array) -> int:
    """Return the number of singular values of rows within directions that are more than rounding errors.

    Args:
        A: Rows, (m, n).
        free: Orthonormal basis of the directions, one in each row, (f, n).

    Returns:
        The rank, at most min(m, f).
    """
    if A.shape[0] == 0 or free.shape[0] == 0:
        return 0
    squares, rank = 0.0, 0
    for i in range(A.shape[0]):
        for j in range(A.shape[1]):
            squares += A[i, j] * A[i, j]
    _, sigma, _ = singular_values(_turned(A, free))
    for value in sigma:
        rank += value > DEPENDENT_DIRECTION * np.sqrt(squares)
    return rank


@kernel
def _turned(A: Array, free: Array) -> Array:
    """Return A Z, with the directions Z in the rows of `free`."""
    turned = np.zeros((A.shape[0], free.shape[0]))
    for i in range(A.shape[0]):
        for a in range(free.shape[0]):
            for j in range(A.shape[1]):
                turned[i, a] += A[i, j] * free[a, j]
    return turned


@kernel
def _turn_back(Vt: Array, a: int, free: Array, size: float, row: Array) -> None:
    """Write k v_aᵀ, with v_a given within the directions `free`."""
    for j in range(row.size):
        total = 0.0
        for c in range(free.shape[0]):
            total += Vt[a, c] * free[c, j]
        row[j] = size * total


@kernel
def _levers(A: Array, group: IntArray) -> Array:
    """Return the lever arm R of the group of each row, 0 for rows that are not curved, (m,)."""
    m, n = A.shape
    levers, start = np.zeros(m), 0
    while start < m:
        stop = start + 1
        while stop < m and group[stop] == group[start]:
            stop += 1
        largest = 0.0
        for j in range(n):
            squares = 0.0
            for i in range(start, stop):
                squares += A[i, j] * A[i, j]
            largest = max(largest, squares)
        for i in range(start, stop):
            levers[i] = np.sqrt(largest) if group[start] > 0 else 0.0
        start = stop
    return levers


@kernel
def _weighed(left: Array, group: IntArray, levers: Array) -> float:
    """Return Σ_g R_g ‖r_g‖ for what is left of b."""
    total, squares = 0.0, 0.0
    for i in range(left.size):
        squares += left[i] * left[i]
        if i + 1 == left.size or group[i + 1] != group[i]:
            total += levers[i] * np.sqrt(squares)
            squares = 0.0
    return total
