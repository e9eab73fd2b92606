"""Kernels that write rows of `RestDamping` into the hierarchy of a tick, see `taskopt.hierarchy.rest`."""

import numpy as np

from taskopt.arrays import Array, IntArray, Mask, StateArray
from taskopt.hierarchy.directions import null_space
from taskopt.hierarchy.rank_doubt import near_limits
from taskopt.hierarchy.rest import Parts, damped_directions, parts_of, rank_within, swing_below
from taskopt.hierarchy.tolerances import FREE_DIRECTION_WEIGHT, ZERO_ROW
from taskopt.hierarchy.view import Rows, view_box, view_rows
from taskopt.jit import kernel, kernel_apart
from taskopt.jit.borrowed import borrowed

SAME = -1  # returned where the joints and hard rows that hold are those of the call before
OF_DAMPING = -1  # kind of a row of damping

Numbers = tuple[Array, Array, IntArray, IntArray]
"""Buffer, norm, offsets and columns of a hierarchy with rows of damping."""
Arrangement = tuple[IntArray, IntArray]
"""`kinds` and `places` of a `RestLayout`."""
Stops = tuple[Array, IntArray, float]
"""Bounds of x that do not depend on the posture, lower and upper, (2, n); owners of bounds that limit speeds
only; and a speed, see `damp_free`."""


@kernel_apart
def copy_declared(
    declared: Array, columns: IntArray, sources: IntArray, into: Numbers, kinds: IntArray
) -> None:
    """Copy the declared rows and the box, and open all rows of damping.

    Args:
        declared: Buffer of the hierarchy as declared.
        columns: Columns of its rows.
        sources: For each row with damping the declared row that it copies, or −1.
        into: The hierarchy with rows of damping, whose buffer is written to.
        kinds: Kinds of its rows, see `Arrangement`.
    """
    declared, columns, sources = borrowed(declared), borrowed(columns), borrowed(sources)
    buffer, norm, offsets, own = into
    buffer, offsets, own, kinds = borrowed(buffer), borrowed(offsets), borrowed(own), borrowed(kinds)
    n = (declared.size - 4 * columns.size) // (columns.size + 4)
    source, target = view_rows(declared, n, norm, offsets, columns), view_rows(buffer, n, norm, offsets, own)
    for i in range(sources.size):
        row = sources[i]
        if row >= 0:
            for j in range(n):
                target.A[i, j] = source.A[row, j]
            target.lower[i], target.upper[i] = source.lower[row], source.upper[row]
            target.weight[i], target.label[i] = source.weight[row], source.label[row]
    before, box = view_box(declared, n), view_box(buffer, n)
    for side in range(4):
        for j in range(n):
            box[side, j] = before[side, j]
    _open(target, kinds)


@kernel_apart
def damp_all(numbers: Numbers, arrangement: Arrangement, thresholds: Array) -> None:
    """Damp all unknowns that move a level, by rows ε e_j in place of the rows of damping that are there.

    Args:
        numbers: The hierarchy, whose buffer is written to.
        arrangement: Kinds and places of its rows.
        thresholds: ε² of each level, 0 for levels that are not damped, (levels + 1,).
    """
    buffer, norm, offsets, columns = numbers
    buffer, offsets, columns = borrowed(buffer), borrowed(offsets), borrowed(columns)
    kinds, places = borrowed(arrangement[0]), borrowed(arrangement[1])
    thresholds = borrowed(thresholds)
    n = (buffer.size - 4 * columns.size) // (columns.size + 4)
    problem = view_rows(buffer, n, norm, offsets, columns)
    _open(problem, kinds)
    for k in range(1, thresholds.size):
        if thresholds[k] > 0.0:
            moved, r = _moving(problem, kinds, k), 0
            for j in range(n):
                if moved[j]:
                    problem.A[places[0, k] + r, j] = np.sqrt(thresholds[k])
                    r += 1
            _close(problem, places[0, k], r)


@kernel_apart
def damp_free(
    numbers: Numbers, arrangement: Arrangement, x: Array, state: StateArray, stops: Stops, held: StateArray,
    dt: float, thresholds: Array,
) -> int:  # fmt: skip
    """Damp what is free at an answer, by rows in place of the rows of damping that are there.

    Limits that do not depend on the posture are never taken to hold a joint, since they stop no robot at
    rest. Nor are limits that narrow the speeds of all joints with the posture, as near an obstacle.

    Args:
        numbers: The hierarchy, whose buffer is written to.
        arrangement: Kinds and places of its rows.
        x: (n,) the answer.
        state: (n + M,) its active set.
        stops: See `Stops`. Limits on positions hold a joint where they are active. With a speed above 0, and
            if a limit on speed is active, they hold a joint, too, that they allow no more than that speed, or
            than ‖x‖ if that is larger.
        held: (n + M₀,) 1 for each unknown, and each of the M₀ hard rows, that held at the last call, else 0;
            overwritten by those of this one. Any other number stands for no last call.
        dt: Δt [s].
        thresholds: (levels + 1,) filled with ε² of each level, 0 for levels that are not damped.

    Returns:
        The number of damped levels; SAME if `held` stays as it is, in which case nothing is written.
    """
    buffer, norm, offsets, columns = numbers
    buffer, offsets, columns = borrowed(buffer), borrowed(offsets), borrowed(columns)
    kinds, places = borrowed(arrangement[0]), borrowed(arrangement[1])
    x, state, held, thresholds = borrowed(x), borrowed(state), borrowed(held), borrowed(thresholds)
    problem = view_rows(buffer, x.size, norm, offsets, columns)
    if not _mark_held(problem, view_box(buffer, x.size), x, state, stops, held):
        return SAME
    _open(problem, kinds)
    n, found, count = x.size, 0, 0
    decided = np.empty((kinds.size, n))
    for i in range(offsets[1]):
        if held[n + i] == 1:
            count = _append(problem.A[i : i + 1], decided, count)
    hard = count
    for k in range(1, offsets.size - 1):
        level = _rows_that_hold(problem, kinds, state, k)
        thresholds[k] = 0.0
        if places[0, k] >= 0:
            free = _moving(problem, kinds, k)
            for j in range(n):
                free[j] &= held[j] == 0
            found_in, taken = _directions(level[0], (decided, hard, count), free)
            limit, gate, r = _damp_level(problem, level, x, found_in, taken, places[0, k], dt)
            thresholds[k], below = limit, 0.0
            count = _append(problem.A[places[0, k] : places[0, k] + r], decided, count)
            if places[1, k] >= 0:
                next_rows = _rows_that_hold(problem, kinds, state, k + 1)
                below = max(FREE_DIRECTION_WEIGHT * gate, _swing(level, found_in, next_rows, x, limit, dt))
            if below > 0.0:
                after = _append(level[0], decided, count)
                _damp_below(problem, k + 1, null_space(decided, after, free), below, places[1, k])
            found += r > 0 or below > 0.0
        count = _append(level[0], decided, count)
    return found


@kernel
def _append(rows: Array, decided: Array, count: int) -> int:
    """Append rows to those that are decided, and return their number."""
    for i in range(rows.shape[0]):
        _copy_row(rows, i, 1.0, decided, count + i)
    return count + rows.shape[0]


@kernel
def _mark_held(
    problem: Rows, box: Array, x: Array, state: StateArray, stops: Stops, held: StateArray
) -> bool:
    """Mark the unknowns that limits on positions hold, and the hard rows that hold; False for no change."""
    base, owners, speed = stops
    base = borrowed(base)
    n, changed = x.size, False
    lower, upper = box[0].copy(), box[1].copy()
    for owner in owners:
        for j in range(n):
            if box[2, j] == owner:
                lower[j] = -np.inf
            if box[3, j] == owner:
                upper[j] = np.inf
    stands, hurries = np.zeros(n, np.bool_), False
    for j in range(n):
        stands[j] = box[0, j] == box[1, j] or (
            (state[j] < 0 and lower[j] > base[j]) or (state[j] > 0 and upper[j] < base[n + j])
        )
        hurries |= state[j] != 0 and not stands[j]
    near = near_limits(lower, upper, base, max(speed, np.sqrt(np.dot(x, x))))
    for j in range(n + problem.offsets[1]):
        if j < n:
            holds = stands[j] or (hurries and speed > 0.0 and near[j])
        else:
            holds = state[j] != 0 or problem.lower[j - n] == problem.upper[j - n]
        changed |= held[j] != (1 if holds else 0)
        held[j] = 1 if holds else 0
    return changed


@kernel
def _rows_that_hold(
    problem: Rows, kinds: IntArray, state: StateArray, k: int
) -> tuple[Array, Array, IntArray]:
    """Return √w A, √w b and the groups of the rows of a level that hold as equalities."""
    n, m, start, stop = problem.A.shape[1], 0, problem.offsets[k], problem.offsets[k + 1]
    A, b, group = np.empty((stop - start, n)), np.empty(stop - start), np.empty(stop - start, np.int64)
    for i in range(start, stop):
        side = 0 if kinds[i] == OF_DAMPING else state[n + i]
        if side != 0 or problem.lower[i] == problem.upper[i]:
            root = np.sqrt(problem.weight[i])
            _copy_row(problem.A, i, root, A, m)
            b[m], group[m] = root * (problem.lower[i] if side < 0 else problem.upper[i]), kinds[i]
            m += 1
    return A[:m], b[:m], group[:m]


@kernel
def _directions(A: Array, decided: tuple[Array, int, int], free: Mask) -> tuple[tuple[Parts, Array], int]:
    """Return the singular values of rows within the directions that are free to them, and these directions;
    and how many the rows lack because levels before, not hard rows, decide them."""
    rows, hard, count = decided
    basis, taken = null_space(rows, count, free), 0
    if count > hard:
        taken = max(0, rank_within(A, null_space(rows, hard, free)) - rank_within(A, basis))
    return (parts_of(A, basis), basis), taken


@kernel
def _swing(
    level: tuple[Array, Array, IntArray], found_in: tuple[Parts, Array],
    below: tuple[Array, Array, IntArray], x: Array, limit: float, dt: float,
) -> float:  # fmt: skip
    """Return the weight that damps the free directions of a level, relative to the rows of the level below.

    Rows of that level that are curved do not count; they are damped by themselves.
    """
    A, b, group = below
    pull, heaviest = np.zeros(x.size), 0.0
    for i in range(b.size):
        if group[i] <= 0:
            left = np.dot(A[i], x) - b[i]
            heaviest = max(heaviest, np.dot(A[i], A[i]))
            for j in range(x.size):
                pull[j] += A[i, j] * left
    if heaviest == 0.0:
        return 0.0
    swing = swing_below(level[0], found_in[0], level[2], found_in[1], pull, limit, dt)
    return min(max(0.0, swing / heaviest - 1.0), FREE_DIRECTION_WEIGHT)


@kernel
def _damp_level(
    problem: Rows, level: tuple[Array, Array, IntArray], x: Array, found_in: tuple[Parts, Array], taken: int,
    place: int, dt: float,
) -> tuple[float, float, int]:  # fmt: skip
    """Write the rows that damp a level whose rows of damping begin at `place`; see `damped_directions`."""
    (A, b, group), (parts, basis) = level, found_in
    rest, inside = x.copy(), 0.0
    for f in range(basis.shape[0]):
        inside = 0.0
        for j in range(x.size):
            inside += basis[f, j] * x[j]
        for j in range(x.size):
            rest[j] -= inside * basis[f, j]
    for i in range(b.size):
        for j in range(x.size):
            b[i] -= A[i, j] * rest[j]
    rows = problem.A[place : place + x.size]
    limit, gate, r = damped_directions(A, parts, b, group, basis, taken, dt, rows)
    _close(problem, place, r)
    return limit, gate, r


@kernel
def _damp_below(problem: Rows, k: int, free: Array, factor: float, place: int) -> None:
    """Write the rows √μ n of level k, from `place` on, that damp what the level above it leaves free.

    μ is a factor times the weight of the heaviest row of level k.
    """
    largest = 0.0
    for i in range(problem.offsets[k], problem.offsets[k + 1]):
        if problem.lower[i] > -np.inf or problem.upper[i] < np.inf:
            squares = 0.0
            for j in range(free.shape[1]):
                squares += problem.A[i, j] * problem.A[i, j]
            largest = max(largest, problem.weight[i] * squares)
    for i in range(free.shape[0]):
        _copy_row(free, i, np.sqrt(factor * largest), problem.A, place + i)
    _close(problem, place, free.shape[0])


@kernel
def _moving(problem: Rows, kinds: IntArray, k: int) -> Mask:
    """Return which unknowns move the curved rows of a level, (n,)."""
    n = problem.A.shape[1]
    squares = np.zeros(n)
    for i in range(problem.offsets[k], problem.offsets[k + 1]):
        if kinds[i] > 0:
            for j in range(n):
                squares[j] += problem.A[i, j] * problem.A[i, j]
    return np.sqrt(squares) > ZERO_ROW


@kernel
def _open(problem: Rows, kinds: IntArray) -> None:
    """Take the bounds of all rows of damping away, so that they ask for nothing."""
    for i in range(kinds.size):
        if kinds[i] == OF_DAMPING:
            problem.lower[i], problem.upper[i] = -np.inf, np.inf
            for j in range(problem.A.shape[1]):
                problem.A[i, j] = 0.0


@kernel
def _close(problem: Rows, place: int, count: int) -> None:
    """Let rows of damping ask for 0."""
    for i in range(place, place + count):
        problem.lower[i], problem.upper[i] = 0.0, 0.0


@kernel
def _copy_row(source: Array, i: int, factor: float, target: Array, place: int) -> None:
    """Write a row times a factor into a row of another matrix."""
    for j in range(source.shape[1]):
        target[place, j] = factor * source[i, j]
