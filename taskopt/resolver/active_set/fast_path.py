"""The fast path: the closed form of a tick in which every strict level is met and no new inequality binds.

With D and x0 the diagonal and the target of what comes last (the joint rows of the last level, or the norm),
C the columns that it covers, U those that it does not (a floating base without a posture, or with next to
none), X the columns that W holds at a bound, and all other rows M x + s = r, where s = 0 for strict levels
and costs ½ w s² in the last one:

    min ½ Σ D_j (x_j − x0_j)² + ½ Σ s_i²/S_i,   S_i = 0 or 1/w_i
    [ K     M_U ] [ λ   ]   [ r − M_C x0_C − M_X x_X ]
    [ M_Uᵀ −D_U ] [ x_U ] = [ −D_U x0_U              ],   K = M_C D_C⁻¹ M_Cᵀ + S
    x_C = x0_C + D_C⁻¹ M_Cᵀ λ.

For one level this is (3.50), and (3.54) where x0 ≠ 0. The result is accepted only if K and its Schur
complement are well conditioned, no row that is left out is violated, and every active bound has the right
sign; else the search runs. The optimum is unique, so neither the fast path nor the order of its attempts can
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
from taskopt.resolver.active_set.workspace import LastLevel, SaddlePoint, Scratch, Side, Verdict

PASSES = 2  # the solution and one refinement, which gains what the square of the condition number cost


@kernel_apart
def fast_path(problem: Rows, state: StateArray, x: Array, multipliers: Array) -> Verdict:
    """Try the closed form with one working set.

    Args:
        problem: the views of a hierarchy.
        state: (n + M,) the working set; where the verdict is AGAIN, one unknown has changed its side.
        x: (n,) filled with the optimum; worthless unless ACCEPTED.
        multipliers: (levels + 1, n + M) filled, likewise.

    Returns:
        The `Verdict`.

    Source:
        Section 3.5, (3.50) and (3.54); the saddle-point system with a Schur complement is Golub and Van Loan
        (2013), "Matrix Computations", Sect. 4.4.
    """
    n, levels = x.size, problem.offsets.size - 2
    last = _last_level(problem)
    first_soft = problem.offsets[levels] if last.found else problem.lower.size
    chosen = np.empty(problem.lower.size, np.int64)
    m = _choose_rows(problem, state, last.found, chosen)
    if m < 0:
        return Verdict.REFUSED
    root, uncovered, u, thin = np.empty(n), np.empty(n, np.int64), np.int64(0), 0.0
    for j in range(n):
        thin = max(thin, FAST_PATH_COVERED * last.D[j])
    for j in range(n):
        free = state[j] == Side.FREE
        root[j] = 1.0 / np.sqrt(last.D[j]) if free and last.D[j] > thin else 0.0
        x[j] = last.x0[j] if free else _held_at(problem, j, state[j])
        if free and last.D[j] <= thin:
            uncovered[u] = j
            u += 1
    if u > m:
        return Verdict.REFUSED
    work = np.empty((2 * m + 3 * u + 2, max(n, m)))  # one allocation costs as much as a dozen sums
    saddle = SaddlePoint(
        chosen[:m], uncovered[:u], first_soft,
        work[:m], work[m : 2 * m + u], work[2 * m + u : 2 * (m + u)], work[2 * (m + u) : 2 * m + 3 * u],
    )  # fmt: skip
    if not _factorise(problem, last, root, saddle):
        return Verdict.REFUSED
    scratch = Scratch(work[2 * m + 3 * u], work[2 * m + 3 * u + 1], np.empty(n))
    balance = np.zeros(m)
    for _ in range(PASSES):
        _improve(problem, last, root, saddle, scratch, balance, x)
    for k in range(levels + 1):
        for i in range(multipliers.shape[1]):
            multipliers[k, i] = 0.0
    own = multipliers[levels - 1 if last.found else levels]
    largest = _last_multipliers(problem, last, saddle, state, balance, x, own)
    if last.found:
        _norm_multipliers(problem, last.row, saddle, scratch, state, x, multipliers[levels])
    return _judge(problem, state, x, own, FAST_PATH_SIGN * largest)


@kernel
def _last_level(problem: Rows) -> LastLevel:
    """Collect the joint rows of the last level as a diagonal with targets; without any, take the norm."""
    n, levels = problem.norm.size, problem.offsets.size - 2
    D, x0, row, found = np.zeros(n), np.zeros(n), np.full(n, -1, np.int64), False
    for i in range(problem.offsets[levels] if levels > 0 else problem.lower.size, problem.lower.size):
        j = problem.columns[i]
        if j >= 0 and problem.lower[i] == problem.upper[i]:
            D[j] += problem.weight[i]
            x0[j] += problem.weight[i] * problem.lower[i]
            row[j] = i
            found = True
    if not found:
        copy_into(D, problem.norm)
    else:
        for j in range(n):
            if D[j] > 0.0:
                x0[j] /= D[j]
    return LastLevel(D, x0, row, found)


@kernel
def _choose_rows(problem: Rows, state: StateArray, joint_rows: bool, chosen: IntArray) -> int:
    """List the equality rows that make up M and return their number; −1 if W holds an inequality row."""
    n, last, m = problem.norm.size, problem.offsets[problem.offsets.size - 2], 0
    for i in range(problem.lower.size):
        if problem.lower[i] == problem.upper[i]:
            if not (joint_rows and i >= last and problem.columns[i] >= 0):
                chosen[m] = i
                m += 1
        elif state[n + i] != Side.FREE:
            return -1
    return m


@kernel
def _held_at(problem: Rows, j: int, side: int) -> float:
    """Return the bound that holds unknown j."""
    return problem.box_upper[j] if side == Side.UPPER else problem.box_lower[j]


@kernel
def _factorise(problem: Rows, last: LastLevel, root: Array, saddle: SaddlePoint) -> bool:
    """Factorise K = S Sᵀ + 1/w with S = M_C D_C^-½, and the Schur complement G = M_Uᵀ K⁻¹ M_U + D_U.

    Returns False where one of the two is not well conditioned.
    """
    S, K, G, m, u = saddle.S, saddle.K, saddle.G, saddle.rows.size, saddle.uncovered.size
    n = root.size
    for a in range(m):
        i = saddle.rows[a]
        for j in range(n):
            S[a, j] = problem.A[i, j] * root[j]
        for b in range(u):
            saddle.MU[b, a] = K[m + b, a] = problem.A[i, saddle.uncovered[b]]
    gram(S, m, n, K)
    for a in range(m):
        if saddle.rows[a] >= saddle.first_soft:
            K[a, a] += 1.0 / problem.weight[saddle.rows[a]]
    if not cholesky(K, m, m + u):
        return False
    gram(K[m:], u, m, G)
    for b in range(u):
        G[b, b] += last.D[saddle.uncovered[b]]
    return cholesky(G, u, u)


@kernel
def _improve(
    problem: Rows, last: LastLevel, root: Array, saddle: SaddlePoint, scratch: Scratch, balance: Array, x:
    Array
) -> None:  # fmt: skip
    """Solve for the residuals that x and λ = `balance` leave, and add the correction to both."""
    n, m, u = x.size, balance.size, saddle.uncovered.size
    step, move, pull = scratch.step, scratch.move, scratch.pull
    for a in range(m):
        i = saddle.rows[a]
        step[a] = problem.lower[i] - dot_row(problem.A, i, x, n)
        if i >= saddle.first_soft:
            step[a] -= balance[a] / problem.weight[i]
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
    problem: Rows, last: LastLevel, saddle: SaddlePoint, state: StateArray, balance: Array, x: Array, out:
    Array
) -> float:  # fmt: skip
    """Fill the multipliers of rows and held columns at the level that comes last; return the largest term."""
    n, m, largest = x.size, balance.size, 1.0
    for a in range(m):
        if saddle.rows[a] < saddle.first_soft:
            out[n + saddle.rows[a]] = -balance[a]
    for j in range(n):
        if state[j] == Side.FREE:
            continue
        out[j] = last.D[j] * (last.x0[j] - x[j])
        largest = max(largest, abs(out[j]))
        for a in range(m):
            term = balance[a] * problem.A[saddle.rows[a], j]
            out[j] += term
            largest = max(largest, abs(term))
    return largest


@kernel
def _norm_multipliers(
    problem: Rows, last_row: IntArray, saddle: SaddlePoint, scratch: Scratch, state: StateArray, x: Array,
    out: Array
) -> None:  # fmt: skip
    """Balance the norm's gradient W x by rows: M for the uncovered columns, joint rows for the others."""
    n, m, u = x.size, saddle.rows.size, saddle.uncovered.size
    row, share, rest = scratch.step, scratch.move, scratch.pull
    for j in range(n):
        rest[j] = -problem.norm[j] * x[j]
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
            add_row(rest, row[a], problem.A, saddle.rows[a], n)
    for j in range(n):
        if last_row[j] >= 0:
            out[n + last_row[j]] = rest[j]
        elif state[j] != Side.FREE:
            out[j] = rest[j]


@kernel
def _judge(problem: Rows, state: StateArray, x: Array, multipliers: Array, sign: float) -> Verdict:
    """Accept if no bound is crossed and no sign is wrong; else let the worst unknown change its side."""
    n, worst, change, side = x.size, 0.0, -1, Side.FREE
    for j in range(n):
        lower, upper = problem.box_lower[j], problem.box_upper[j]
        if not np.isfinite(x[j]) or lower > upper:
            return Verdict.REFUSED
        if state[j] != Side.FREE:
            if change < 0 and -state[j] * multipliers[j] > sign and lower < upper:
                change, side = j, Side.FREE
            continue
        over = max(x[j] - upper, lower - x[j])
        if over > max(worst, FAST_PATH_FEASIBLE * max(1.0, abs(x[j]))):
            worst, change, side = over, j, Side.UPPER if x[j] > upper else Side.LOWER
    if change >= 0:
        state[change] = side
        return Verdict.AGAIN
    for i in range(problem.lower.size):
        if problem.lower[i] != problem.upper[i]:
            value = dot_row(problem.A, i, x, n)
            allowed = FAST_PATH_FEASIBLE * max(1.0, abs(value))
            if value > problem.upper[i] + allowed or value < problem.lower[i] - allowed:
                return Verdict.REFUSED
    for j in range(n):
        x[j] = min(max(x[j], problem.box_lower[j]), problem.box_upper[j])
    return Verdict.ACCEPTED
