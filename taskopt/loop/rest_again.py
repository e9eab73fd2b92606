"""The kernel that damps a tick after a damped one, beginning with what damped that one.

    last damped answer ─▶ damp what is free at it ─▶ solve ─▶ are the same joints free? ─▶ if not: once more

At rest one round is enough. The undamped answer is not needed, nor is the solve with ε I that `Rest` begins
with where there is no last damped answer. What joints and hard rows hold back is that of this tick: bounds
are known before the first round; if a hard row holds another value than before, there is a second one.
"""

import numpy as np

from taskopt.arrays import Array, IntArray, StateArray
from taskopt.hierarchy.rest_rows import Arrangement, Numbers, Stops, copy_declared, damp_free
from taskopt.hierarchy.tolerances import STANDS
from taskopt.hierarchy.view import Rows, view_box, view_rows
from taskopt.jit import kernel, kernel_apart
from taskopt.jit.borrowed import borrowed
from taskopt.resolver.active_set.linalg import copy_into, dot_row
from taskopt.resolver.active_set.tick import tick
from taskopt.resolver.active_set.workspace import Count, Outcome

NOT_DAMPED = -3  # nothing is left to damp, so that the undamped answer is needed after all
Declared = tuple[Array, IntArray, IntArray]
"""Buffer and columns of the hierarchy as declared; `sources` of a `RestLayout`."""
Found = tuple[StateArray, StateArray, StateArray, Array]
"""Arrays to fill: history (3, n + M), a copy of it from before the last solution, active set, flat answer."""


@kernel_apart
def damp_again(
    declared: Declared, numbers: Numbers, arrangement: Arrangement, stops: Stops,
    notes: tuple[float, Array, StateArray], last: tuple[Array, StateArray], settings: tuple[int, int, int],
    found: Found,
) -> tuple[np.int64, Count]:  # fmt: skip
    """Damp a tick, and resolve it.

    Args:
        declared: The hierarchy as declared, filled for this tick.
        numbers: The hierarchy with rows of damping, whose buffer is written to.
        arrangement: Kinds and places of its rows.
        stops: As of `damp_free`, with a speed of 0.
        notes: Δt [s]; memory for ε² of each level, (levels + 1,); and `held` of `damp_free`, (n + M₀,).
        last: Answer (n,) and active set (n + M,) of the tick before, with damping.
        settings: As of `taskopt.resolver.active_set.tick`, and the largest number of rounds.
        found: Filled. The history is that of the damped hierarchy, and is continued.

    Returns:
        The `Outcome` of the last solution, or NOT_DAMPED; and the number of factorisations.
    """
    history, begun, state, answer = found
    history, begun, state, answer = borrowed(history), borrowed(begun), borrowed(state), borrowed(answer)
    before, dt, thresholds, held = borrowed(last[1]), notes[0], notes[1], borrowed(notes[2])
    buffer, norm, offsets, columns = numbers
    n, rounds = norm.size, np.int64(0)
    copy_declared(declared[0], declared[1], declared[2], numbers, arrangement[0])
    x, box = borrowed(last[0]).copy(), view_box(borrowed(buffer), n)
    for j in range(n):  # a bound that holds has moved since
        if before[j] != 0:
            x[j] = box[0, j] if before[j] < 0 else box[1, j]
    for j in range(held.size):
        held[j] = 2  # neither held nor not
    damped = damp_free(numbers, arrangement, x, before, stops, held, dt, thresholds)
    stands = _hard_rows_stand(view_rows(borrowed(buffer), n, norm, offsets, columns), x, before, held)
    for _ in range(settings[2]):
        if damped <= 0:
            break
        for k in range(3):
            copy_into(begun[k], history[k])
        outcome, count = tick(
            buffer, norm, offsets, columns, (settings[0], settings[1]), history, state, answer
        )
        rounds += count
        if not stands:
            held[0], stands = 2, True
        if outcome != Outcome.SOLVED:
            return outcome, rounds
        damped = damp_free(numbers, arrangement, answer[:n], state, stops, held, dt, thresholds)
    return np.int64(NOT_DAMPED if damped == 0 else Outcome.SOLVED), rounds


@kernel
def _hard_rows_stand(problem: Rows, x: Array, state: StateArray, held: StateArray) -> bool:
    """Return True if all hard rows that hold have at x the value that they hold now."""
    n, stand = x.size, True
    for i in range(problem.offsets[1]):
        if held[n + i] == 1:
            bound = problem.lower[i] if state[n + i] < 0 else problem.upper[i]
            stand &= abs(dot_row(problem.A, i, x, n) - bound) <= STANDS
    return stand
