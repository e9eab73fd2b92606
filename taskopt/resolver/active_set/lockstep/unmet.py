"""Arms whose first level cannot be met: its least squares in lock-step, with a bound on its error.

Where an arm holds so many columns that the free ones cannot meet the strict rows, the first level alone
decides the free columns, if its rows A have full rank there. With the residuals s = b − A x and W diag(w),

    G x_f = A_fᵀ W (b − A x_W),   G = A_fᵀ W A_f,   y = Aᵀ W s for the held columns.

If every y has strictly the right sign, each optimum of the first level holds the same columns, because their
multipliers are not zero; what is left is decided by full rank. x is then the only optimum of the first level,
and no later level can change it.

For a computed x, G (x* − x)_f = A_fᵀ W s, and |y* − y| ≤ |A|ᵀ W |A| |x* − x|. Residuals are computed in
doubles, and g times the sum of the magnitudes of their terms is added.

Source: Escande, Mansard and Wieber (2014), Sect. 3, for the conditions of a level.
"""

import numpy as np

from taskopt.arrays import Array
from taskopt.jit import kernel
from taskopt.jit.pack import load, size, spread, store, where_less
from taskopt.resolver.active_set.lockstep.factor import (
    ENLARGED,
    INFINITE,
    ROUNDING,
    bound_solution,
    factorise,
    invert,
    solve,
)
from taskopt.resolver.active_set.lockstep.records import (
    ArmAnswers,
    ArmRows,
    ArmScratch,
    Cost,
    bound_held,
    is_free,
)


@kernel
def solve_unmet(cost: Cost, rows: ArmRows, answers: ArmAnswers, scratch: ArmScratch, chosen: Array) -> None:
    """Solve with the present working sets, and bound the errors.

    Args:
        cost: What all arms share.
        rows: The hierarchies.
        answers: Receives x and its bound, which is inf in free columns where G is not regular.
        scratch: Receives `pull` and `unsure`.
        chosen: 1 for the arms that are written, 0 for all others.
    """
    k, n = cost.first.size, rows.x0.shape[0]
    S, trial, step = scratch.S, scratch.trial, scratch.step
    for j in range(n):
        free = is_free(answers.state, j)
        store(trial, j, where_less(0.5, free, 0.0, bound_held(rows, answers.state, j)))
        store(scratch.extra, j, 1.0 - free)
        for a in range(k):
            store(S, j * k + a, load(rows.A, a * n + j) * (free * np.sqrt(cost.first[a])))
    sound = factorise(scratch.extra, S, scratch.L, scratch.diagonal, (n, k))
    for _ in range(2):  # the solution and one refinement
        _residuals(rows, trial, scratch.dual, k)
        for j in range(n):
            total = spread(0.0)
            for a in range(k):
                total = total + load(rows.A, a * n + j) * (cost.first[a] * load(scratch.dual, a))
            store(step, j, is_free(answers.state, j) * total)
        solve(scratch.L, step, n)
        for j in range(n):
            store(trial, j, load(trial, j) + is_free(answers.state, j) * load(step, j))
    _residuals(rows, trial, scratch.dual, k)
    _bound_error(cost, rows, answers, scratch, (sound, chosen))


@kernel
def _residuals(rows: ArmRows, x: Array, out: Array, k: int) -> None:
    """Write the residuals of the first k rows at x."""
    n = x.shape[0]
    for a in range(k):
        rest = load(rows.r, a)
        for j in range(n):
            rest = rest - load(rows.A, a * n + j) * load(x, j)
        store(out, a, rest)


@kernel
def _bound_error(
    cost: Cost, rows: ArmRows, answers: ArmAnswers, scratch: ArmScratch, masks: tuple[Array, Array]
) -> None:
    """Bound the errors of x and of the multipliers; write the chosen arms."""
    k, n = cost.first.size, rows.x0.shape[0]
    g = ROUNDING * (k + n + 10)
    sound = masks[0] * invert(scratch.L, scratch.inverse, scratch.diagonal, n, g)
    for j in range(n):
        total, terms = spread(0.0), spread(0.0)
        for a in range(k):
            entry = cost.first[a] * load(rows.A, a * n + j)
            reach = size(load(rows.r, a))
            for i in range(n):
                reach = reach + size(load(rows.A, a * n + i) * load(scratch.trial, i))
            total, terms = total + entry * load(scratch.dual, a), terms + size(entry) * reach
        store(scratch.pull, j, where_less(0.5, masks[1], total, load(scratch.pull, j)))
        unsure = where_less(0.5, masks[1], (2.0 * g) * terms, load(scratch.unsure, j))
        store(scratch.unsure, j, unsure)
        store(scratch.step, j, is_free(answers.state, j) * (size(total) + (2.0 * g) * terms))
    bound_solution(scratch.inverse, scratch.step, n)
    for j in range(n):
        bound = where_less(0.5, sound, load(scratch.step, j), INFINITE)
        bound = where_less(0.5, is_free(answers.state, j), bound, 0.0)
        store(answers.bound, j, where_less(0.5, masks[1], bound, load(answers.bound, j)))
        store(answers.x, j, where_less(0.5, masks[1], load(scratch.trial, j), load(answers.x, j)))
    _bound_pulls(cost, rows, answers, scratch, masks[1])


@kernel
def _bound_pulls(cost: Cost, rows: ArmRows, answers: ArmAnswers, scratch: ArmScratch, chosen: Array) -> None:
    """Add to `unsure` of the chosen arms what the error of x makes of the multipliers."""
    k, n = cost.first.size, rows.x0.shape[0]
    for a in range(k):
        moved = spread(0.0)
        for i in range(n):
            moved = moved + size(load(rows.A, a * n + i)) * load(answers.bound, i)
        for j in range(n):
            more = ENLARGED * (cost.first[a] * size(load(rows.A, a * n + j)) * moved)
            store(scratch.unsure, j, load(scratch.unsure, j) + where_less(0.5, chosen, more, 0.0))
