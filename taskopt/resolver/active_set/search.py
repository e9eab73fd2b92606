"""The exact lexicographic optimum by a primal active set with lexicographic multipliers.

`taskopt.resolver.active_set` explains the algorithm in pseudo-code. Near a singularity a multiplier of 1e-10
can decide the position of x. A multiplier therefore counts as zero only below SEARCH_SIGN times its terms, by
which its rounding error grows. If a row that was just dropped blocks the next step at once, its sign was
rounding noise: it is added back, and locked until x moves.
"""

import numpy as np

from taskopt.arrays import Array, Mask, StateArray
from taskopt.hierarchy.tolerances import (
    LOST,
    REGAINED,
    SEARCH_AGREE,
    SEARCH_BOX,
    SEARCH_FEASIBLE,
    SEARCH_MOVED,
    SEARCH_MOVED_PERTURBED,
    SEARCH_SIGN,
)
from taskopt.hierarchy.view import Rows
from taskopt.jit import kernel, kernel_apart
from taskopt.resolver.active_set.cycles import moves, repeats
from taskopt.resolver.active_set.lexls import (
    factorise,
    invert_pivots,
    multipliers_of_level,
    new_factor,
    solve_levels,
    unknowns_into,
    weakest_pivot,
)
from taskopt.resolver.active_set.linalg import copy_into, row_values
from taskopt.resolver.active_set.start import (
    close_empty,
    correct_working_set,
    has_empty_interval,
    perturbed,
    row_side,
    start_at_zero,
    start_beside,
    violates,
    zero_is_feasible,
)
from taskopt.resolver.active_set.workspace import (
    Count,
    Factor,
    Held,
    LevelMultipliers,
    LevelSolution,
    Locks,
    Outcome,
    Point,
    ScaledRows,
)


@kernel_apart
def search(
    problem: Rows, state: StateArray, x: Array, multipliers: Array, first: Count, limit: int,
    rounding: float,
) -> tuple[Outcome, Count, float]:  # fmt: skip
    """Find the lexicographic optimum of a hierarchy with a diagonal norm.

    The first search starts from the given working set. If it does not end within `first` factorisations, a
    second search starts from a point that keeps the hard rows. Its bounds are moved apart so that none of
    them tie (Charnes 1952), by less than the tolerance of a bound. Source: Escande, Mansard and Wieber
    (2014), Sect. 5, Algorithm 6.

    Args:
        problem: The views of a hierarchy.
        state: (n + M,) the initial working set; overwritten by the final one.
        x: (n,) filled with the optimum.
        multipliers: (levels + 1, n + M) filled.
        first: Number of factorisations after which the first search is given up.
        limit: Largest number of factorisations of both searches.
        rounding: Share of its level's scale up to which a multiplier counts as zero, see `ScaledRows`. If it
            is not 0, directions between `LOST` and `REGAINED` count as lost.

    Returns:
        The `Outcome`, the number of factorisations, and the least share of a row of the last working set that
        no row before it has; 1 if no share was computed.
    """
    n = x.size
    rows = _scaled(problem, rounding)
    if has_empty_interval(rows):
        for j in range(n):
            x[j] = np.nan
        return Outcome.CONTRADICTION, 0, 1.0
    here = Point(x, np.empty(rows.lower.size))
    correct_working_set(rows, state)
    outcome, rounds, weakest = _iterate(
        rows, state, here, multipliers, np.bool_(True), min(first, limit), SEARCH_MOVED
    )
    if outcome != Outcome.SOLVED and rounds < limit:
        outcome, more, weakest = _second_search(rows, state, here, multipliers, rounds, limit - rounds)
        rounds += more
    _unscale(problem, state, x, multipliers)
    return outcome, rounds, weakest


@kernel
def _scaled(problem: Rows, rounding: float) -> ScaledRows:
    """Multiply rows by √w and unknowns by √W, so that weights and norm become the identity."""
    A, norm, n, count = problem.A, problem.norm, problem.norm.size, problem.lower.size
    S, scale, size = np.empty((count, n)), np.empty(count), np.empty(count)
    lower, upper, box_lower, box_upper = np.empty(count), np.empty(count), np.empty(n), np.empty(n)
    stretch = np.empty(n)
    for j in range(n):
        stretch[j] = np.sqrt(norm[j])
        box_lower[j] = problem.box_lower[j] * stretch[j]
        box_upper[j] = problem.box_upper[j] * stretch[j]
    for i in range(count):
        root = 1.0 if i < problem.offsets[1] else np.sqrt(problem.weight[i])
        declared, squared = 0.0, 0.0
        for j in range(n):
            S[i, j] = A[i, j] * root / stretch[j]
            declared += A[i, j] * A[i, j] / norm[j]
            squared += S[i, j] * S[i, j]
        scale[i] = root * max(1.0, np.sqrt(declared))
        size[i] = max(np.sqrt(squared), LOST * scale[i])
        scale[i] *= REGAINED / LOST if rounding > 0.0 else 1.0
        lower[i], upper[i] = problem.lower[i] * root, problem.upper[i] * root
    close_empty(box_lower, box_upper, np.ones(n))
    close_empty(lower, upper, size)
    return ScaledRows(S, scale, size, lower, upper, box_lower, box_upper, problem.offsets, rounding)


@kernel
def _unscale(problem: Rows, state: StateArray, x: Array, multipliers: Array) -> None:
    """Undo the scaling of x and multipliers; set held unknowns to their bounds, and move x into the box."""
    n = x.size
    for j in range(n):
        stretch = np.sqrt(problem.norm[j])
        x[j] /= stretch
        if state[j] != Held.FREE:
            x[j] = problem.box_upper[j] if state[j] == Held.UPPER else problem.box_lower[j]
        x[j] = min(max(x[j], problem.box_lower[j]), problem.box_upper[j])
        for k in range(multipliers.shape[0]):
            multipliers[k, j] *= stretch
    for i in range(problem.offsets[1], problem.lower.size):
        root = np.sqrt(problem.weight[i])
        for k in range(multipliers.shape[0]):
            multipliers[k, n + i] *= root


@kernel_apart
def _second_search(
    rows: ScaledRows, state: StateArray, here: Point, multipliers: Array, turn: Count, limit: Count
) -> tuple[Outcome, Count, float]:
    """Search with perturbed bounds, from zero if that keeps the hard rows, else with an empty W."""
    near, from_zero = perturbed(rows, turn), zero_is_feasible(rows)
    if from_zero:
        start_at_zero(near, state, here)
    else:
        for j in range(state.size):
            state[j] = Held.FREE
    correct_working_set(rows, state)
    outcome, rounds, weakest = _iterate(
        near, state, here, multipliers, np.bool_(not from_zero), limit, SEARCH_MOVED_PERTURBED
    )
    if outcome == Outcome.SOLVED:
        _resolve_true_bounds(rows, state, here, multipliers)
    return outcome, rounds, weakest


@kernel
def _resolve_true_bounds(rows: ScaledRows, state: StateArray, here: Point, multipliers: Array) -> None:
    """Solve W once more with the declared bounds, and take the solution unless it violates other rows."""
    n, count = here.x.size, here.value.size
    goal, found = Point(np.empty(n), np.empty(count)), np.empty(multipliers.shape)
    _solve(rows, state, np.zeros(n + count, np.bool_), goal.x, found)
    row_values(rows.A, goal.x, goal.value)
    for j in range(n):
        if not rows.box_lower[j] - SEARCH_AGREE <= goal.x[j] <= rows.box_upper[j] + SEARCH_AGREE:
            return
    for i in range(count):
        slack = SEARCH_AGREE * rows.size[i]
        inside = rows.lower[i] - slack <= goal.value[i] <= rows.upper[i] + slack
        if not inside and (state[n + i] == Held.FREE or i < rows.offsets[1]):
            return
    copy_into(here.x, goal.x)
    for k in range(multipliers.shape[0]):
        copy_into(multipliers[k], found[k])


@kernel_apart
def _iterate(
    rows: ScaledRows, state: StateArray, here: Point, multipliers: Array, from_guess: bool | np.bool_,
    limit: Count, moved: float,
) -> tuple[Outcome, Count, float]:  # fmt: skip
    """Add and drop rows of W until it is optimal: the loop of the search.

    Args:
        rows: The problem, scaled.
        state: (n + M,) the working set, changed in place.
        here: The point; its values must be set unless `from_guess` is True.
        multipliers: (levels + 1, n + M) filled, scaled.
        from_guess: True to start at the solution of W instead of at `here`.
        limit: Largest number of factorisations.
        moved: Relative change of an unknown up to which a step counts as none.

    Returns:
        The `Outcome`, the number of factorisations, and the least share as of `search`.
    """
    n, count, weakest = here.x.size, here.value.size, 1.0
    goal = Point(np.empty(n), np.empty(count))
    locks = Locks(np.zeros(n + count, np.bool_), np.zeros(n + count, np.bool_))
    seen, drops = np.full(n + count, -1, np.int64), 0
    for iteration in range(1, limit + 1):
        leaving, weakest = _solve(rows, state, locks.locked, goal.x, multipliers)
        row_values(rows.A, goal.x, goal.value)
        if from_guess:
            from_guess = False
            if violates(rows, state, goal):
                start_beside(rows, state, goal, here)
                continue
            _move_to(here, goal)
        alpha, entering, side = _first_blocking(rows, state, here, goal)
        if moves(here.x, goal.x, alpha, moved):
            for j in range(n + count):
                locks.dropped[j] = False
                locks.locked[j] = False
        if entering >= 0:
            locks.locked[entering] = locks.dropped[entering]
            _stop_at(rows, here, goal, alpha, entering, side)
            state[entering] = side
            continue
        _move_to(here, goal)
        if leaving < 0:
            return _verdict(rows, goal.value), iteration, weakest
        drops += 1
        if repeats(seen, drops, state, locks):
            return Outcome.CYCLED, iteration, weakest
        locks.dropped[leaving] = True
        state[leaving] = _side_after(rows, state[leaving], leaving - n, goal.value)
    return Outcome.ITERATION_LIMIT, limit, weakest


@kernel
def _stop_at(rows: ScaledRows, here: Point, goal: Point, alpha: float, entering: int, side: int) -> None:
    """Move a share of the way to the goal; an unknown that stops the step is put onto its bound."""
    for j in range(here.x.size):
        here.x[j] += alpha * (goal.x[j] - here.x[j])
    if entering < here.x.size:
        here.x[entering] = rows.box_upper[entering] if side == Held.UPPER else rows.box_lower[entering]
    row_values(rows.A, here.x, here.value)


@kernel
def _move_to(here: Point, goal: Point) -> None:
    """Move to the goal, which is the full step."""
    copy_into(here.x, goal.x)
    copy_into(here.value, goal.value)


@kernel_apart
def _solve(
    rows: ScaledRows, state: StateArray, locked: Mask, x: Array, multipliers: Array
) -> tuple[int, float]:  # fmt: skip
    """Solve the hierarchy with the rows of W as equalities.

    Returns the row to drop from W, or −1; and the least share of a pivot that no row before it has.
    """
    n, count, levels = x.size, rows.lower.size, rows.offsets.size - 1
    target, held = np.empty(count), 0.0
    for j in range(n):
        if state[j] != Held.FREE:
            x[j] = rows.box_upper[j] if state[j] == Held.UPPER else rows.box_lower[j]
            held += abs(x[j])
    for i in range(count):
        if state[n + i] != Held.FREE:
            target[i] = rows.upper[i] if state[n + i] == Held.UPPER else rows.lower[i]
            for j in range(n):
                if state[j] != Held.FREE:
                    target[i] -= rows.A[i, j] * x[j]
    factor = new_factor(count, levels, state, n)
    factorise(rows.A, rows.scale, rows.offsets, state, rows.rounding, factor)
    invert_pivots(factor)
    solution = LevelSolution(np.empty(factor.free.size), np.empty(count), np.empty(count))
    solve_levels(factor, rows.size, target, held, solution)
    unknowns_into(factor, solution.z, x)
    leaving = _row_to_drop(rows, factor, solution, state, x, locked, multipliers)
    return leaving, weakest_pivot(rows.size, factor)


@kernel_apart
def _row_to_drop(
    rows: ScaledRows, factor: Factor, solution: LevelSolution, state: StateArray, x: Array, locked: Mask,
    multipliers: Array,
) -> int:  # fmt: skip
    """Compute all multipliers; return the inequality with the worst sign at the first wrong level, or −1.

    A member of W may stay if its own residual, then its multiplier at each later level, is lexicographically
    positive on its side: once positive, it is decided for all levels below. Source: Escande, Mansard and
    Wieber (2014), Sect. 5, and Dimitrov, Sherikov and Wieber (2015), Sect. 2.
    """
    n, levels = x.size, factor.starts.size - 1
    decided = locked.copy()
    level = LevelMultipliers(np.empty(decided.size), np.empty(decided.size))
    leaving = -1
    for i in range(rows.lower.size):
        decided[n + i] |= rows.lower[i] == rows.upper[i]
    for j in range(n):
        decided[j] |= rows.box_lower[j] == rows.box_upper[j]
    for k in range(levels + 1):
        multipliers_of_level(rows.A, rows.size, factor, solution, state, x, k, level)
        if k > 0:
            copy_into(multipliers[k - 1], level.value)
        if leaving >= 0:
            continue
        worst, least = 0.0, _least_multiplier(rows, x, k, level.value[n:])
        for j in range(n + rows.offsets[min(k + 1, levels)]):
            if state[j] == Held.FREE or decided[j]:
                continue
            tolerance = max(SEARCH_SIGN * level.terms[j], least if j < n else least / rows.size[j - n])
            signed = state[j] * level.value[j]
            if signed > tolerance:
                decided[j] = True
            elif signed < -tolerance and (leaving < 0 or signed < worst):
                worst, leaving = signed, j
    return leaving


@kernel
def _least_multiplier(rows: ScaledRows, x: Array, k: int, force: Array) -> float:
    """Return the least multiplier of a bound of the box at level k that is more than `rows.rounding`.

    It is that share of the scale by which the certificate measures the level, whose rows pull with `force`.
    """
    if rows.rounding == 0.0:
        return 0.0
    scale, reach, levels = 1.0, 1.0, rows.offsets.size - 2
    for j in range(x.size):
        reach = max(reach, abs(x[j]))
    if 0 < k <= levels:
        scale = 0.0
        for i in range(rows.offsets[k], rows.offsets[k + 1]):
            scale = max(scale, rows.size[i] ** 2, abs(force[i]) * rows.size[i] / reach)
    return rows.rounding * scale * reach


@kernel
def _side_after(rows: ScaledRows, side: int, i: int, value: Array) -> int:
    """Return the state of row i when it is dropped: its other bound if it is beyond that, else FREE."""
    if i >= 0:
        beyond = row_side(value[i], rows.lower[i], rows.upper[i], rows.size[i])
        if beyond == -side:
            return beyond
    return Held.FREE


@kernel
def _first_blocking(
    rows: ScaledRows, state: StateArray, here: Point, goal: Point
) -> tuple[float, int, int]:  # fmt: skip
    """Find the largest step in [0, 1] towards the goal, the member that stops it (or −1), and its side.

    If several members stop the step at the same point, the first of them is returned. Source: Escande,
    Mansard and Wieber (2014), Algorithm 5.
    """
    n = here.x.size
    alpha, entering, side = 1.0, -1, Held.FREE
    for j in range(n + rows.lower.size):
        if state[j] != Held.FREE:
            continue
        if j < n:
            now, then, lower, upper = here.x[j], goal.x[j], rows.box_lower[j], rows.box_upper[j]
            slack = SEARCH_BOX * max(1.0, abs(then))
        else:
            i = j - n
            now, then, lower, upper = here.value[i], goal.value[i], rows.lower[i], rows.upper[i]
            slack = SEARCH_FEASIBLE * rows.size[i]
        if then > upper + slack and then > now:
            step, toward = max(0.0, (upper - now) / (then - now)), Held.UPPER
        elif then < lower - slack and then < now:
            step, toward = max(0.0, (lower - now) / (then - now)), Held.LOWER
        else:
            continue
        if step < alpha or entering < 0:
            alpha, entering, side = step, j, toward
    return alpha, entering, side


@kernel
def _verdict(rows: ScaledRows, value: Array) -> Outcome:
    """Return CONTRADICTION if a hard row keeps a residual, else SOLVED."""
    for i in range(rows.offsets[1]):
        slack = SEARCH_AGREE * rows.size[i]
        if value[i] > rows.upper[i] + slack or value[i] < rows.lower[i] - slack:
            return Outcome.CONTRADICTION
    return Outcome.SOLVED
