"""A cheap test that most ticks pass: no level can be near a loss of rank that needs damping.

`taskopt.hierarchy.rest` damps a direction of a level if σ² < ε², where ε² = Δt Σ R ‖r‖ and r is the part of
the right-hand side that the level cannot meet. The test needs no singular values. It bounds ε² from above,
and then tries to factor B Bᵀ − ε² I, in which B has all rows that are held or curved and all columns that no
limit on positions may hold. Where that succeeds, every σ of every level is larger than ε: with y the left
singular vector of J_k Z, ‖yᵀ J_k Z‖ = min over z of ‖yᵀ J_k − zᵀ C‖ ≥ σ_min of J_k and C together, whatever
the scale of the rows C that are held. The weights of a level are divided by the least of them, and B has
rows without weights, whose σ are no larger.

Two bounds of ε² are taken, and the smaller counts. The first is Δt R ‖b‖. The second is for answers x that
meet their levels: with b = J x + r, and ε² σ/(σ² + ε²) ≤ ε/2, the part of b that damping ε leaves is at most
½ ε ‖x‖ + ‖r‖, hence ε² ≤ a ε + c with a = ½ Δt R ‖x‖ and c = Δt R ‖r‖.

A level that is met may still bend so much that the level below does not come to rest, see `rest`: with the
gradient p = A₂ᵀ (A₂ x − b₂) of the cost of that level, ‖λ‖ ≤ ‖p‖/σ_min. The test asks for a σ_min that rules
this out, or for one that is not weak.

A factorisation serves many ticks: σ_min of B is at least s = 1/‖L⁻¹‖ of that tick (Frobenius norm, with
L Lᵀ = B Bᵀ) less the norm of the change of B since. What a new factorisation would decide stays the same.
"""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray, Mask, StateArray
from taskopt.hierarchy.tolerances import NEAR_LOSS, REST_LEAST, ZERO_ROW
from taskopt.hierarchy.view import Rows, view_rows
from taskopt.jit import kernel, kernel_apart
from taskopt.jit.borrowed import borrowed

LITTLE = 0.01  # share of all that is asked for, up to which a row asks for next to nothing
_GROWTH = 1.25  # by which a lower bound of σ_min is raised until a factorisation refuses it
_PERIOD, _BELOW, _LEAST, _COUNT, _ROWS = 0, 1, 2, 3, 4
"""Where Δt, Δt for levels below, s, the number of rows and B stand in `watch`."""


class Scratch(NamedTuple):
    """Memory of one look, which is kept since allocating it would take a third of the time of the look.

    Attributes:
        B: The rows, (n, n).
        asks: R ‖w b‖ of each group, at its first row, (M,).
        slips: R² max w of each group, likewise, (M,).
        levers: Sums of squares of the entries of a group, (n,).
        keep: 0 for unknowns that a limit on positions may hold, else 1, (n,).
    """

    B: Array
    asks: Array
    slips: Array
    levers: Array
    keep: Array


@kernel
def watch_size(n: int, row_count: int) -> int:
    """Return the length of `watch` of `rank_in_doubt`.

    Args:
        n: Number of unknowns.
        row_count: Number M of rows.

    Returns:
        The length.
    """
    return _ROWS + 2 * n * n + 2 * n + 3 * row_count


def new_watch(n: int, groups: IntArray) -> Array:
    """Return the array that `rank_in_doubt` keeps from call to call, with both Δt 0.

    Args:
        n: Number of unknowns.
        groups: Number of the group of each curved row, from 1 on, 0 for a row that is not curved, (M,). The
            rows of a group stand together.

    Returns:
        `watch`.
    """
    watch = np.zeros(watch_size(n, len(groups)))
    _groups(watch, n, len(groups))[:] = groups
    return watch


@kernel_apart
def rank_in_doubt(
    buffer: Array, norm: Array, offsets: IntArray, columns: IntArray, x: Array, state: StateArray,
    base: Array, watch: Array,
) -> bool:  # fmt: skip
    """Return False if no level can be so near a loss of rank that it needs damping to come to rest.

    Args:
        buffer: (layout.size,) the hierarchy.
        norm: (n,) diagonal of W, or (n · n,) all of it.
        offsets: (levels + 2,) first row of each level, as in `Layout`.
        columns: (M,) the unknown that a row is the unit vector of, or −1, as in `Layout`.
        x: (n,) the answer.
        state: (n + M,) its active set.
        base: (2 n,) lower and upper bounds of x that do not depend on the posture, such as limits on speed.
        watch: Array of `new_watch`: Δt [s] twice, the second 0 if levels below are not to be looked at; then
            what is kept of the last factorisation: s, the number of rows of B, and B; then the group of each
            row, and the memory of a `Scratch`.

    Returns:
        True if a level may need damping.
    """
    buffer, norm, offsets, columns = borrowed(buffer), borrowed(norm), borrowed(offsets), borrowed(columns)
    x, state, base, watch = borrowed(x), borrowed(state), borrowed(base), borrowed(watch)
    n = x.size
    problem = view_rows(buffer, n, norm, offsets, columns)
    groups, scratch = _groups(watch, n, columns.size), _scratch(watch, n, columns.size)
    last, size, limit = _largest_threshold(problem, x, state, groups, watch[_PERIOD], scratch)
    if watch[_BELOW] > 0.0:
        limit = max(limit, _swing_limit(problem, x, state, groups, watch[_BELOW], scratch))
    if limit < REST_LEAST:
        return False
    B = scratch.B
    count = _held_rows(problem, x, state, base, groups, (last, size), scratch)
    if count < 0:
        return True  # more rows than unknowns depend on each other
    before = watch[_ROWS : _ROWS + n * n].reshape(n, n)
    if count == watch[_COUNT]:
        change = 0.0
        for i in range(count):
            for j in range(n):
                change += (B[i, j] - before[i, j]) ** 2
        if watch[_LEAST] - np.sqrt(change) > np.sqrt(limit):
            return False
    S = _gram(B[:count])
    L = S.copy()
    least = _least_singular_value(S, L)
    while 0.0 < least < np.inf and _factor(S, (_GROWTH * least) ** 2, L):
        least *= _GROWTH
    watch[_LEAST], watch[_COUNT] = least, count
    before[:count] = B[:count]
    return not (least**2 > limit or _factor(S, limit, L))


@kernel
def _groups(watch: Array, n: int, row_count: int) -> Array:
    """Return the group of each row, as a view of `watch`, (M,)."""
    return watch[_ROWS + n * n : _ROWS + n * n + row_count]


@kernel
def _scratch(watch: Array, n: int, row_count: int) -> Scratch:
    """Return the memory of a look, as views of `watch`."""
    B = _ROWS + n * n + row_count
    asks = B + n * n
    slips = asks + row_count
    levers = slips + row_count
    return Scratch(
        watch[B:asks].reshape((n, n)), watch[asks:slips], watch[slips:levers], watch[levers : levers + n],
        watch[levers + n : levers + 2 * n],
    )  # fmt: skip


@kernel
def _largest_threshold(
    problem: Rows, x: Array, state: StateArray, groups: Array, dt: float, scratch: Scratch
) -> tuple[int, float, float]:
    """Return the last level with curved rows, the largest lever, and a bound of ε² with weights from 1 on.

    Groups that ask for next to nothing, such as feet that stand, are counted by what they ask for in both
    bounds, so that their weights do not matter.
    """
    asks, slips = scratch.asks, scratch.slips
    last, asked, missed, lever = 0, 0.0, 0.0, 0.0
    for k in range(1, problem.offsets.size - 1):
        i, end = problem.offsets[k], problem.offsets[k + 1]
        lightest = np.inf
        for row in range(i, end):
            if groups[row] > 0.0 and _is_held(problem, state, row):
                lightest = min(lightest, problem.weight[row])
        while i < end:
            stop = i + 1
            while stop < end and groups[stop] == groups[i]:
                stop += 1
            asks[i], slips[i] = 0.0, 0.0
            if groups[i] > 0.0:
                own, misses, slip, size = _sum_group(problem, x, state, (i, stop), lightest, scratch.levers)
                asks[i], slips[i] = own, slip
                asked, missed = asked + own, missed + misses
                if size >= 0.0:
                    last, lever = k, max(lever, size)
            i = stop
    little, slip = 0.0, 0.0
    for k in range(1, problem.offsets.size - 1):
        for i in range(problem.offsets[k], problem.offsets[k + 1]):
            if i > problem.offsets[k] and groups[i] == groups[i - 1]:
                continue  # the first row of a group stands for it
            if asks[i] > LITTLE * asked:
                slip += slips[i]
            else:
                little += asks[i]
    slip = 0.5 * dt * np.sqrt(slip * np.dot(x, x))
    left = dt * (missed + little)
    return last, lever, min(dt * asked, 0.25 * (slip + np.sqrt(slip**2 + 4.0 * left)) ** 2)


@kernel
def _swing_limit(
    problem: Rows, x: Array, state: StateArray, groups: Array, dt: float, scratch: Scratch
) -> float:
    """Return σ_min² up to which a level below curved rows may swing, after `_largest_threshold`.

    Curved rows of such a level are left out, since they are damped by themselves.
    """
    pull, squares, lever, steepest, above = scratch.levers, 0.0, 0.0, 0.0, False
    for k in range(1, problem.offsets.size - 1):
        heaviest, curved, first, stop = 0.0, False, problem.offsets[k], problem.offsets[k + 1]
        for j in range(x.size):
            pull[j] = 0.0
        for i in range(first, stop):
            if groups[i] > 0.0:
                curved = True
                if i == first or groups[i] != groups[i - 1]:
                    squares, lever = squares + scratch.slips[i], max(lever, scratch.slips[i])
            elif above and _is_held(problem, state, i):
                heaviest = max(heaviest, _add_pull(problem, x, state, i, pull))
        if heaviest > 0.0:
            steepest = max(steepest, np.sqrt(np.dot(pull, pull)) / heaviest)
        above |= curved
    return min(squares * (dt * steepest) ** 2, NEAR_LOSS**2 * lever)


@kernel
def _add_pull(problem: Rows, x: Array, state: StateArray, i: int, pull: Array) -> float:
    """Add w aᵀ (a x − b) of a row to the gradient of its level, and return w ‖a‖²."""
    n, j = x.size, problem.columns[i]
    bound = problem.lower[i] if state[n + i] < 0 else problem.upper[i]
    if j >= 0:
        pull[j] += problem.weight[i] * (x[j] - bound)
        return problem.weight[i]
    value, squares = 0.0, 0.0
    for c in range(n):
        value += problem.A[i, c] * x[c]
        squares += problem.A[i, c] ** 2
    for c in range(n):
        pull[c] += problem.weight[i] * problem.A[i, c] * (value - bound)
    return problem.weight[i] * squares


@kernel
def _sum_group(
    problem: Rows, x: Array, state: StateArray, rows: tuple[int, int], lightest: float, levers: Array
) -> tuple[float, float, float, float]:
    """Return R ‖w b‖, R ‖w r‖, R² max w and R of a group of curved rows; zeros and −1 if none is held."""
    n, found = x.size, False
    asked, missed, heaviest = 0.0, 0.0, 0.0
    for j in range(n):
        levers[j] = 0.0
    for i in range(rows[0], rows[1]):
        if not _is_held(problem, state, i):
            continue
        bound = problem.lower[i] if state[n + i] < 0 else problem.upper[i]
        value, w = 0.0, problem.weight[i] / lightest
        for j in range(n):
            value += problem.A[i, j] * x[j]
            levers[j] += problem.A[i, j] ** 2
        asked += (w * bound) ** 2
        missed += (w * (value - bound)) ** 2
        heaviest, found = max(heaviest, w), True
    if not found:
        return 0.0, 0.0, 0.0, -1.0
    square = 0.0
    for j in range(n):
        square = max(square, levers[j])
    lever = np.sqrt(square)
    return lever * np.sqrt(asked), lever * np.sqrt(missed), square * heaviest, lever


@kernel
def _held_rows(
    problem: Rows,
    x: Array,
    state: StateArray,
    base: Array,
    groups: Array,
    size: tuple[int, float],
    scratch: Scratch,
) -> int:
    """Write the rows B up to level size[0], and return their number; −1 if there are more than n."""
    n, count, B, keep = x.size, 0, scratch.B, scratch.keep
    speed = np.sqrt(np.dot(x, x))
    for j in range(n):
        keep[j] = 0.0 if _is_near(problem.box_lower, problem.box_upper, base, speed, j) else 1.0
    for k in range(size[0] + 1):
        for i in range(problem.offsets[k], problem.offsets[k + 1]):
            curved = groups[i] > 0.0
            if not _is_held(problem, state, i) or (not curved and k == size[0]):
                continue
            length, asks = 0.0, max(abs(problem.lower[i]), abs(problem.upper[i]))
            for j in range(n):
                length += problem.A[i, j] ** 2
            length = np.sqrt(length)
            if length < ZERO_ROW and asks < ZERO_ROW:
                continue
            if count == n:
                return -1
            scale = 1.0 if curved else size[1] / max(length, ZERO_ROW)
            for j in range(n):
                B[count, j] = keep[j] * scale * problem.A[i, j]
            count += 1
    return count


@kernel
def _is_held(problem: Rows, state: StateArray, i: int) -> bool:
    """Return True for an equality row, and for an inequality that is active."""
    return problem.lower[i] == problem.upper[i] or state[problem.box_lower.size + i] != 0


@kernel
def near_limits(box_lower: Array, box_upper: Array, base: Array, speed: float) -> Mask:
    """Return which unknowns a limit that depends on the posture may hold, at velocities up to a speed.

    Args:
        box_lower: Lower bounds of x, (n,).
        box_upper: Upper bounds of x, (n,).
        base: As of `rank_in_doubt`.
        speed: Largest size of a velocity that counts [unit of x].

    Returns:
        True for each such unknown, (n,).
    """
    near = np.empty(box_lower.size, np.bool_)
    for j in range(near.size):
        near[j] = _is_near(box_lower, box_upper, base, speed, j)
    return near


@kernel
def _is_near(box_lower: Array, box_upper: Array, base: Array, speed: float, j: int) -> bool:
    """Return True if a limit that depends on the posture may hold unknown j; see `near_limits`."""
    n = box_lower.size
    lower = box_lower[j] > base[j] and -box_lower[j] <= speed
    return lower or (box_upper[j] < base[n + j] and box_upper[j] <= speed)


@kernel
def _gram(B: Array) -> Array:
    """Return the lower triangle of B Bᵀ; columns are taken by their non-zero entries."""
    m, n = B.shape
    S, filled = np.zeros((m, m)), np.empty(m, np.int64)
    for j in range(n):
        count = 0
        for i in range(m):
            if B[i, j] != 0.0:
                filled[count] = i
                count += 1
        for a in range(count):
            i = filled[a]
            for c in range(a + 1):
                S[i, filled[c]] += B[i, j] * B[filled[c], j]
    return S


@kernel
def _factor(S: Array, shift: float, L: Array) -> bool:
    """Write L with L Lᵀ = S − shift · I, and return True, if that is positive definite."""
    for i in range(S.shape[0]):
        for k in range(i + 1):
            part = S[i, k] - (shift if i == k else 0.0)
            for c in range(k):
                part -= L[i, c] * L[k, c]
            if i > k:
                L[i, k] = part / L[k, k]
            elif part > 0.0:
                L[i, i] = np.sqrt(part)
            else:
                return False
    return True


@kernel
def _least_singular_value(S: Array, L: Array) -> float:
    """Return 1/‖L⁻¹‖ of S = L Lᵀ, which is at most the smallest singular value of B; 0 without full rank."""
    m, total = S.shape[0], 0.0
    if not _factor(S, 0.0, L):
        return 0.0
    column = np.empty(m)
    for k in range(m):
        for i in range(k, m):
            part = 1.0 if i == k else 0.0
            for c in range(k, i):
                part -= L[i, c] * column[c]
            column[i] = part / L[i, i]
            total += column[i] ** 2
    return 1.0 / np.sqrt(total) if total > 0.0 else np.inf
