"""Eight hierarchies in lock-step: closed forms with bounds of the box, and a bound on the error of each x.

Bounds join and leave the working set W of each arm one at a time, as in `fast_path`; arms of a pack whose W
is right meanwhile repeat their answer. `met` solves arms whose strict levels are met, `unmet` those whose
first level is not. Both bound the distance of x from the exact solution with the same W, and the error of
the multipliers of W, by the rounding constants of `factor`.

If every free column keeps its bounds by more than the bound on its error, and every multiplier of W has the
right sign by more than its own, then that solution is the optimum: it is feasible, and meets its conditions
with strict signs. Only such answers are given; all other arms are left to `tick`.
"""

from taskopt.arrays import Array
from taskopt.hierarchy.tolerances import ACCURACY, FAST_PATH_FEASIBLE
from taskopt.jit import kernel
from taskopt.jit.pack import any_less, load, size, spread, store, where_less
from taskopt.resolver.active_set.lockstep.met import solve_met
from taskopt.resolver.active_set.lockstep.records import (
    FREE,
    LOWER,
    UPPER,
    ArmAnswers,
    ArmRows,
    ArmScratch,
    Cost,
    is_free,
)
from taskopt.resolver.active_set.lockstep.unmet import solve_unmet

ATTEMPTS = 10  # working sets that are tried; each differs from the last by one bound
_FAR = 1e300  # bounds beyond are none


@kernel
def resolve_pack(cost: Cost, rows: ArmRows, answers: ArmAnswers, scratch: ArmScratch) -> None:
    """Resolve eight hierarchies; write answers, error bounds and which of them are proven.

    Args:
        cost: What all arms share.
        rows: The hierarchies.
        answers: The answers, whose working sets are tried first.
        scratch: Memory.
    """
    _fit_working_set(rows, answers.state)
    strict = 0
    for a in range(rows.r.shape[0]):
        strict += cost.slack[a] == 0.0
    for _ in range(ATTEMPTS):
        solve_met(cost, rows, answers, scratch)
        if cost.first.size > 0:
            count = spread(0.0)
            for j in range(rows.x0.shape[0]):
                count = count + is_free(answers.state, j)
            if any_less(count, float(strict)):
                solve_unmet(cost, rows, answers, scratch, where_less(count, float(strict), 1.0, 0.0))
        if not any_less(0.5, _judge(rows, answers, scratch)):
            break


@kernel
def _fit_working_set(rows: ArmRows, state: Array) -> None:
    """Hold the columns whose bounds are equal, and release those whose bound is infinite."""
    for j in range(state.shape[0]):
        lower, upper, held = load(rows.lower, j), load(rows.upper, j), load(state, j)
        held = where_less(size(upper), _FAR, held, where_less(0.0, held, 0.0, held))
        held = where_less(size(lower), _FAR, held, where_less(held, 0.0, 0.0, held))
        store(state, j, where_less(lower, upper, held, UPPER))


@kernel
def _judge(rows: ArmRows, answers: ArmAnswers, scratch: ArmScratch) -> Array:
    """Write which answers are proven, and change one bound of others; return 1 where that was done."""
    proven, worst, where = spread(1.0), spread(0.0), spread(-1.0)
    wrong, held_wrongly, regular = spread(0.0), spread(-1.0), spread(1.0)
    for j in range(answers.x.shape[0]):
        x, bound, free = load(answers.x, j), load(answers.bound, j), is_free(answers.state, j)
        lower, upper = load(rows.lower, j), load(rows.upper, j)
        room = where_less(x - lower, upper - x, x - lower, upper - x)
        asked = ACCURACY * where_less(1.0, size(x) - bound, size(x) - bound, 1.0)
        kept = where_less(bound, room, where_less(bound, asked, 1.0, 0.0), 0.0)
        fixed = where_less(lower, upper, 0.0, where_less(upper, lower, 0.0, 1.0))
        pull, unsure = load(answers.state, j) * load(scratch.pull, j), load(scratch.unsure, j)
        right = where_less(upper, lower, 0.0, where_less(unsure, pull, 1.0, fixed))
        proven = where_less(0.5, where_less(0.5, free, kept, right), proven, 0.0)
        regular = where_less(bound, _FAR, regular, 0.0)
        over = where_less(0.5, free, -room, 0.0)
        least = FAST_PATH_FEASIBLE * where_less(1.0, size(x), size(x), 1.0)
        least = where_less(least, worst, worst, least)
        where, worst = where_less(least, over, float(j), where), where_less(least, over, over, worst)
        against = where_less(0.5, fixed, 0.0, -pull - unsure)
        held_wrongly = where_less(wrong, against, float(j), held_wrongly)
        wrong = where_less(wrong, against, against, wrong)
    changed = where_less(-0.5, where, where, held_wrongly)
    changed = where_less(0.5, proven, -1.0, changed)
    store(answers.proven, 0, proven)
    return _change(rows, answers, changed, regular)


@kernel
def _change(rows: ArmRows, answers: ArmAnswers, changed: Array, regular: Array) -> Array:
    """Change the side of one column of each arm, or release all where nothing could be solved.

    Args:
        rows: The hierarchies.
        answers: The answers, whose working sets change.
        changed: The column, −1 for none.
        regular: 1 where the system could be solved, else 0.

    Returns:
        1 where the working set changed, else 0.
    """
    any_changed = where_less(-0.5, changed, regular, 0.0)
    for j in range(answers.x.shape[0]):
        x, free, held = load(answers.x, j), is_free(answers.state, j), load(answers.state, j)
        lower, upper = load(rows.lower, j), load(rows.upper, j)
        side = where_less(0.5, free, where_less(upper, x, UPPER, LOWER), FREE)
        side = where_less(size(changed - float(j)), 0.5, side, held)
        released = where_less(lower, upper, FREE, held)
        any_changed = where_less(0.5, size(released - held) - regular, 1.0, any_changed)
        store(answers.state, j, where_less(0.5, regular, side, released))
    return any_changed
