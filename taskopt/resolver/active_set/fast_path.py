"""The fast path: the closed form for ticks in which every strict level is met and no new inequality binds.

The cost that is minimised last has the diagonal D and the target x0; it is that of the joint rows of the last
level, or that of the norm. The columns are divided into three sets. C are those with an entry of D, U those
without an entry or with a very small one, such as the columns of a floating base without a posture, and X
those that W holds at a bound. All other rows are M x + s = r. For strict levels s = 0; in the last level s
costs ½ w s²:

    min ½ Σ D_j (x_j − x0_j)² + ½ Σ s_i²/S_i,   S_i = 0 or 1/w_i
    [ K     M_U ] [ λ   ]   [ r − M_C x0_C − M_X x_X ]
    [ M_Uᵀ −D_U ] [ x_U ] = [ −D_U x0_U              ],   K = M_C D_C⁻¹ M_Cᵀ + S
    x_C = x0_C + D_C⁻¹ M_Cᵀ λ.

For one level this is (3.50), or (3.54) if x0 ≠ 0. The result is accepted only if K and its Schur complement
are well conditioned, all other rows hold, and the multiplier of every active bound has the right sign;
otherwise the search runs. The optimum is unique, so neither the fast path nor the order of its attempts can
change an answer.
"""

import numpy as np

from taskopt.arrays import Array, IntArray, StateArray
from taskopt.hierarchy.tolerances import FAST_PATH_COVERED, FAST_PATH_FEASIBLE, FAST_PATH_SIGN
from taskopt.hierarchy.view import Rows
from taskopt.jit import kernel, kernel_apart
from taskopt.resolver.active_set.linalg import (
    add_row,
    add_rows,
    backward,
    cholesky,
    copy_into,
    dot_row,
    forward,
    gram,
)
from taskopt.resolver.active_set.workspace import Held, LastLevel, SaddlePoint, Scratch, Verdict

PASSES = 2  # the solution and one refinement, which gains what the square of the condition number cost


@kernel_apart
def fast_path(problem: Rows, state: StateArray, x: Array, multipliers: Array) -> Verdict:
    """Try the closed form with one working set.

    Args:
        problem: The views of a hierarchy.
        state: (n + M,) the working set; if the verdict is AGAIN, one unknown has changed its side.
        x: (n,) filled with the optimum; not valid unless the verdict is ACCEPTED.
        multipliers: (levels + 1, n + M) filled; not valid unless the verdict is ACCEPTED.

    Returns:
        The `Verdict`.

    Source:
        Section 3.5, (3.50) and (3.54); the saddle-point system with a Schur complement is Golub and Van Loan
        (2013), "Matrix Computations", Sect. 4.4.
    """
    n, levels, count = x.size, problem.offsets.size - 2, problem.lower.size
    A, lower, upper, weight = problem.A, problem.lower, problem.upper, problem.weight
    numbers, places = np.empty((4, n)), np.empty((3, n + count), np.int64)  # each allocation costs 0.1 µs
    root, pull, uncovered, chosen = numbers[2], numbers[3], places[1], places[2]
    last = LastLevel(numbers[0], numbers[1], places[0])
    first_soft = problem.offsets[levels] if levels > 0 else count
    joint_rows = _joint_rows(lower, upper, weight, problem.columns, first_soft, last)
    if not joint_rows:
        first_soft = count
        copy_into(last.D, problem.norm)
    m = _choose_rows(lower, upper, problem.columns, state, first_soft, chosen)
    if m < 0:
        return Verdict.REFUSED
    u = _place_unknowns(problem, state, last, root, x, uncovered)
    if u > m:
        return Verdict.REFUSED
    work = np.empty((2 * m + 3 * u + 3, max(n, m)))
    saddle = SaddlePoint(
        chosen[:m], uncovered[:u], first_soft,
        work[:m], work[m : 2 * m + u], work[2 * m + u : 2 * (m + u)], work[2 * (m + u) : 2 * m + 3 * u],
    )  # fmt: skip
    if not _factorise(A, weight, last.D, root, saddle):
        return Verdict.REFUSED
    scratch = Scratch(work[2 * m + 3 * u], work[2 * m + 3 * u + 1], pull)
    balance = work[2 * m + 3 * u + 2]
    for a in range(m):
        balance[a] = 0.0
    for _ in range(PASSES):
        _residuals(A, lower, weight, saddle, balance, x, scratch.step)
        _improve(last, root, saddle, scratch, balance, x)
    return _judge(problem, state, last, saddle, scratch, balance, x, multipliers)


@kernel
def _place_unknowns(
    problem: Rows, state: StateArray, last: LastLevel, root: Array, x: Array, uncovered: IntArray
) -> np.int64:  # fmt: skip
    """Set every unknown to its target or bound, fill D^-½, list the unknowns without target; return u."""
    u, thin = np.int64(0), 0.0
    for j in range(x.size):
        thin = max(thin, FAST_PATH_COVERED * last.D[j])
    for j in range(x.size):
        free = state[j] == Held.FREE
        root[j] = 1.0 / np.sqrt(last.D[j]) if free and last.D[j] > thin else 0.0
        bound = problem.box_upper[j] if state[j] == Held.UPPER else problem.box_lower[j]
        x[j] = last.x0[j] if free else bound
        if free and last.D[j] <= thin:
            uncovered[u] = j
            u += 1
    return u


@kernel
def _judge(
    problem: Rows, state: StateArray, last: LastLevel, saddle: SaddlePoint, scratch: Scratch, balance: Array,
    x: Array, multipliers: Array,
) -> Verdict:  # fmt: skip
    """Fill the multipliers of a solved system; accept x, change a side, or refuse."""
    levels, joint_rows = multipliers.shape[0] - 1, saddle.first_soft < problem.lower.size
    for k in range(levels + 1):
        for i in range(multipliers.shape[1]):
            multipliers[k, i] = 0.0
    own = multipliers[levels - 1 if joint_rows else levels]
    largest = _last_multipliers(problem.A, last, saddle, state, balance, x, own)
    if joint_rows:
        _norm_multipliers(problem.A, problem.norm, last.row, saddle, scratch, state, x, multipliers[levels])
    verdict = _change_side(problem.box_lower, problem.box_upper, state, x, own, FAST_PATH_SIGN * largest)
    if verdict == Verdict.ACCEPTED and not _keeps_rows(problem.A, problem.lower, problem.upper, x):
        verdict = Verdict.REFUSED
    for j in range(x.size):
        x[j] = min(max(x[j], problem.box_lower[j]), problem.box_upper[j])
    return verdict


@kernel
def _joint_rows(
    lower: Array, upper: Array, weight: Array, columns: IntArray, first: int, last: LastLevel
) -> bool:  # fmt: skip
    """Collect the joint rows of the last level as a diagonal with targets; return False if there is none."""
    found = False
    for j in range(last.D.size):
        last.D[j], last.x0[j], last.row[j] = 0.0, 0.0, -1
    for i in range(first, lower.size):
        j = columns[i]
        if j >= 0 and lower[i] == upper[i]:
            last.D[j] += weight[i]
            last.x0[j] += weight[i] * lower[i]
            last.row[j] = i
            found = True
    for j in range(last.D.size):
        if last.D[j] > 0.0:
            last.x0[j] /= last.D[j]
    return found


@kernel
def _choose_rows(
    lower: Array, upper: Array, columns: IntArray, state: StateArray, first_soft: int, chosen: IntArray
) -> int:  # fmt: skip
    """List the equality rows that make up M and return their number; −1 if W holds an inequality row."""
    n, m, refused = state.size - lower.size, 0, False
    for i in range(lower.size):
        if lower[i] == upper[i]:
            if i < first_soft or columns[i] < 0:
                chosen[m] = i
                m += 1
        else:
            refused |= state[n + i] != Held.FREE
    return -1 if refused else m


@kernel
def _factorise(A: Array, weight: Array, D: Array, root: Array, saddle: SaddlePoint) -> bool:
    """Factorise K = S Sᵀ + 1/w with S = M_C D_C^-½, and the Schur complement G = M_Uᵀ K⁻¹ M_U + D_U.

    Returns False if one of the two is not well conditioned.
    """
    S, K, G, m, u = saddle.S, saddle.K, saddle.G, saddle.rows.size, saddle.uncovered.size
    n = root.size
    for a in range(m):
        i = saddle.rows[a]
        for j in range(n):
            S[a, j] = A[i, j] * root[j]
        for b in range(u):
            saddle.MU[b, a] = K[m + b, a] = A[i, saddle.uncovered[b]]
    gram(S, m, n, K)
    for a in range(m):
        if saddle.rows[a] >= saddle.first_soft:
            K[a, a] += 1.0 / weight[saddle.rows[a]]
    regular = cholesky(K, m, m + u)
    if regular:
        gram(K[m:], u, m, G)
        for b in range(u):
            G[b, b] += D[saddle.uncovered[b]]
        regular = cholesky(G, u, u)
    return regular


@kernel
def _residuals(
    A: Array, lower: Array, weight: Array, saddle: SaddlePoint, balance: Array, x: Array, step: Array
) -> None:  # fmt: skip
    """Fill the residuals of the m rows at x and λ = `balance`."""
    for a in range(saddle.rows.size):
        i = saddle.rows[a]
        step[a] = lower[i] - dot_row(A, i, x, x.size)
        if i >= saddle.first_soft:
            step[a] -= balance[a] / weight[i]


@kernel
def _improve(
    last: LastLevel, root: Array, saddle: SaddlePoint, scratch: Scratch, balance: Array, x: Array
) -> None:  # fmt: skip
    """Solve for the residuals that x and λ = `balance` leave, and add the correction to both."""
    n, m, u = x.size, saddle.rows.size, saddle.uncovered.size
    step, move, pull = scratch.step, scratch.move, scratch.pull
    for b in range(u):
        j = saddle.uncovered[b]
        move[b] = last.D[j] * (last.x0[j] - x[j]) + dot_row(saddle.MU, b, balance, m)
    _solve(saddle.K, saddle.G, m, u, step, move)
    for j in range(n):
        pull[j] = 0.0
    add_rows(pull, step, saddle.S, m, n)
    for a in range(m):
        balance[a] += step[a]
    for j in range(n):
        x[j] += root[j] * pull[j]
    for b in range(u):
        x[saddle.uncovered[b]] += move[b]


@kernel
def _solve(K: Array, G: Array, m: int, u: int, step: Array, move: Array) -> None:
    """Replace the right-hand sides of the m rows and of the u uncovered columns by the solution (λ, x_U)."""
    forward(K, step, m)
    for b in range(u):
        move[b] += dot_row(K, m + b, step, m)
    forward(G, move, u)
    backward(G, move, u)
    for b in range(u):
        add_row(step, -move[b], K, m + b, m)
    backward(K, step, m)


@kernel
def _last_multipliers(
    A: Array, last: LastLevel, saddle: SaddlePoint, state: StateArray, balance: Array, x: Array, out: Array
) -> float:  # fmt: skip
    """Fill the multipliers of rows and held columns at the level that comes last; return the largest term."""
    n, m, largest = x.size, saddle.rows.size, 1.0
    for a in range(m):
        if saddle.rows[a] < saddle.first_soft:
            out[n + saddle.rows[a]] = -balance[a]
    for j in range(n):
        if state[j] != Held.FREE:
            out[j] = last.D[j] * (last.x0[j] - x[j])
            largest = max(largest, abs(out[j]))
            for a in range(m):
                term = balance[a] * A[saddle.rows[a], j]
                out[j] += term
                largest = max(largest, abs(term))
    return largest


@kernel
def _norm_multipliers(
    A: Array, norm: Array, last_row: IntArray, saddle: SaddlePoint, scratch: Scratch, state: StateArray,
    x: Array, out: Array,
) -> None:  # fmt: skip
    """Balance the norm's gradient W x by rows of M in uncovered columns, and by joint rows in the others."""
    n, m, u = x.size, saddle.rows.size, saddle.uncovered.size
    row, share, rest = scratch.step, scratch.move, scratch.pull
    for j in range(n):
        rest[j] = -norm[j] * x[j]
    if u > 0:
        for b in range(u):
            share[b] = rest[saddle.uncovered[b]]
        forward(saddle.G, share, u)
        backward(saddle.G, share, u)
        for a in range(m):
            row[a] = 0.0
        for b in range(u):
            add_row(row, -share[b], saddle.K, m + b, m)
        backward(saddle.K, row, m)
        for a in range(m):
            out[n + saddle.rows[a]] = -row[a]
            add_row(rest, row[a], A, saddle.rows[a], n)
    for j in range(n):
        if last_row[j] >= 0:
            out[n + last_row[j]] = rest[j]
        elif state[j] != Held.FREE:
            out[j] = rest[j]


@kernel
def _change_side(
    box_lower: Array, box_upper: Array, state: StateArray, x: Array, multipliers: Array, sign: float
) -> Verdict:  # fmt: skip
    """Accept if no bound is crossed and no sign is wrong; else let the worst unknown change its side."""
    worst, change, side, refused = 0.0, -1, Held.FREE, False
    for j in range(x.size):
        lower, upper = box_lower[j], box_upper[j]
        refused |= lower > upper or not np.isfinite(x[j])
        if state[j] != Held.FREE:
            if change < 0 and -state[j] * multipliers[j] > sign and lower < upper:
                change, side = j, Held.FREE
        else:
            over = max(x[j] - upper, lower - x[j])
            if over > max(worst, FAST_PATH_FEASIBLE * max(1.0, abs(x[j]))):
                worst, change, side = over, j, Held.UPPER if x[j] > upper else Held.LOWER
    verdict = Verdict.ACCEPTED
    if refused:
        verdict = Verdict.REFUSED
    elif change >= 0:
        state[change] = side
        verdict = Verdict.AGAIN
    return verdict


@kernel
def _keeps_rows(A: Array, lower: Array, upper: Array, x: Array) -> bool:
    """Return True if x keeps every inequality row."""
    kept = True
    for i in range(lower.size):
        if lower[i] != upper[i]:
            value = dot_row(A, i, x, x.size)
            allowed = FAST_PATH_FEASIBLE * max(1.0, abs(value))
            kept &= lower[i] - allowed <= value <= upper[i] + allowed
    return kept
