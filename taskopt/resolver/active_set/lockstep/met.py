"""Arms whose strict levels are met: the fast path in lock-step, with a bound on its error.

The problem is that of `fast_path` without uncovered columns (U is empty): the cost ½ Σ D_j (x_j − x0_j)² with
D > 0 comes last, M x = r are all other rows, and S has 1/w for those that may keep a residual. For an arm
with the working set W, root_j is D_j^-½ in free columns and 0 in held ones, so that

    K = M R R Mᵀ + S,   R = diag(root),   x = x_W + R R Mᵀ λ in free columns,   K λ = r − M x_W

is one system of the same size for all arms, whatever they hold.

Let (x, λ) be computed, ρ = r − M x − S λ and τ = D (x0 − x) + Mᵀ λ the residuals of rows and columns. The
exact solution (x*, λ*) with the same W has

    K (λ* − λ) = ρ − M R R τ,      x* − x = R R (τ + Mᵀ (λ* − λ)) in free columns,
    y* − y = Mᵀ (λ* − λ) for the multipliers y = τ of held ones.

Residuals are computed in doubles, and g times the sum of the magnitudes of their terms is added.
"""

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
def solve_met(cost: Cost, rows: ArmRows, answers: ArmAnswers, scratch: ArmScratch) -> None:
    """Solve with the present working sets, and bound the errors.

    Args:
        cost: What all arms share.
        rows: The hierarchies.
        answers: Receives x and its bound, which is inf in free columns where K is not regular.
        scratch: Receives `pull` and `unsure`.
    """
    m, n = rows.r.shape[0], rows.x0.shape[0]
    S, dual = scratch.S, scratch.dual
    for j in range(n):
        target = where_less(
            0.5, is_free(answers.state, j), load(rows.x0, j), bound_held(rows, answers.state, j)
        )
        store(answers.x, j, target)
    for a in range(m):
        store(dual, a, spread(0.0))
        store(scratch.extra, a, spread(cost.slack[a]))
        for j in range(n):
            store(S, a * n + j, load(rows.A, a * n + j) * (is_free(answers.state, j) * cost.root[j]))
    sound = factorise(scratch.extra, S, scratch.L, scratch.diagonal, (m, n))
    for _ in range(2):  # the solution and one refinement
        for a in range(m):
            rest = load(rows.r, a) - cost.slack[a] * load(dual, a)
            for j in range(n):
                rest = rest - load(rows.A, a * n + j) * load(answers.x, j)
            store(scratch.step, a, rest)
        solve(scratch.L, scratch.step, m)
        for a in range(m):
            store(dual, a, load(dual, a) + load(scratch.step, a))
        for j in range(n):
            pull = spread(0.0)
            for a in range(m):
                pull = pull + load(S, a * n + j) * load(scratch.step, a)
            step = is_free(answers.state, j) * cost.root[j] * pull
            store(answers.x, j, load(answers.x, j) + step)
    _bound_error(cost, rows, answers, scratch, sound)


@kernel
def _bound_error(cost: Cost, rows: ArmRows, answers: ArmAnswers, scratch: ArmScratch, sound: Array) -> None:
    """Write the bounds on x and on the multipliers of held columns."""
    m, n = rows.r.shape[0], rows.x0.shape[0]
    g = ROUNDING * (m + n + 10)
    sound = sound * invert(scratch.L, scratch.inverse, scratch.diagonal, m, g)
    for j in range(n):
        total = cost.D[j] * (load(rows.x0, j) - load(answers.x, j))
        terms = load(rows.reach, j) + cost.D[j] * size(load(answers.x, j))
        for a in range(m):
            term = load(rows.A, a * n + j) * load(scratch.dual, a)
            total, terms = total + term, terms + size(term)
        store(scratch.pull, j, total)
        store(scratch.unsure, j, g * terms)
    _bound_rows(cost, rows, answers, scratch, g)
    bound_solution(scratch.inverse, scratch.step, m)
    for j in range(n):
        free = is_free(answers.state, j)
        total = cost.root[j] * (size(load(scratch.pull, j)) + load(scratch.unsure, j))
        unsure = load(scratch.unsure, j)
        for a in range(m):
            total = total + size(load(scratch.S, a * n + j)) * load(scratch.step, a)
            unsure = unsure + size(load(rows.A, a * n + j)) * load(scratch.step, a)
        bound = where_less(0.5, sound, ENLARGED * (cost.root[j] * total), INFINITE)
        store(answers.bound, j, where_less(0.5, free, bound, 0.0))
        store(scratch.unsure, j, where_less(0.5, sound, ENLARGED * unsure, INFINITE))


@kernel
def _bound_rows(cost: Cost, rows: ArmRows, answers: ArmAnswers, scratch: ArmScratch, g: float) -> None:
    """Write bounds on ρ − M R R τ into `step`."""
    m, n = rows.r.shape[0], rows.x0.shape[0]
    for a in range(m):
        term = cost.slack[a] * load(scratch.dual, a)
        rest = load(rows.r, a) - term
        terms = size(load(rows.r, a)) + size(term)
        moved = spread(0.0)
        for j in range(n):
            term = load(rows.A, a * n + j) * load(answers.x, j)
            rest, terms = rest - term, terms + size(term)
            column = size(load(scratch.pull, j)) + load(scratch.unsure, j)
            moved = moved + size(load(scratch.S, a * n + j)) * (cost.root[j] * column)
        store(scratch.step, a, size(rest) + g * terms + moved)
