"""The compiled entries: one tick, from the buffer of a hierarchy to its answer.

There are two entries with the same arguments and the same answers. `tick_fast` has only the fast path and the
certificate, and therefore compiles in a small part of the time; `tick` has the search as well. Begin with
`tick_fast`. Once it returns FAST_PATH_REFUSED, call `tick` with the same arguments, and use `tick` from then
on, so that no later tick waits for the compiler.
"""

from collections.abc import Callable

import numpy as np

from taskopt.arrays import Array, IntArray, StateArray
from taskopt.hierarchy.certificate import PRIMAL, certify_kernel, largest_entry
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.tolerances import DIGITS_LOST, KKT_MET, STILL_PERTURBED
from taskopt.hierarchy.view import Answer, Rows, view_answer, view_rows
from taskopt.jit import kernel, kernel_apart
from taskopt.jit.borrowed import borrowed
from taskopt.resolver.active_set.fast_path import fast_path
from taskopt.resolver.active_set.linalg import copy_into
from taskopt.resolver.active_set.search import search
from taskopt.resolver.active_set.workspace import Count, Held, Outcome, Verdict

FAST_PATH_ATTEMPTS = 4  # of the fast path, each a bound of the box apart; a tick seldom changes more
FIRST_SEARCH_LIMIT = (
    150  # factorisations of the first search; a tick that needs more is better off with another start
)
LAST, PREVIOUS, ALTERNATES = 0, 1, 2  # rows of the history


def new_history(layout: Layout) -> StateArray:
    """Allocate the history that the entries keep from tick to tick.

    Args:
        layout: Layout of the hierarchies that will be resolved.

    Returns:
        (3, n + M): the last working set, the working set before it, and a row whose first entry is 1 if the
        two alternate.
    """
    return np.zeros((3, layout.width), dtype=np.int8)


@kernel_apart
def tick_fast(
    buffer: Array, norm: Array, offsets: IntArray, columns: IntArray, settings: tuple[int, int], history:
    StateArray, state: StateArray, answer: Array,
) -> tuple[np.int64, Count]:  # fmt: skip
    """Resolve one tick by the fast path alone.

    Args:
        buffer: As in `tick`, which takes the same arguments.
        norm: As in `tick`.
        offsets: As in `tick`.
        columns: As in `tick`.
        settings: As in `tick`.
        history: As in `tick`.
        state: As in `tick`.
        answer: As in `tick`.

    Returns:
        The `Outcome` and 0 factorisations. If the outcome is FAST_PATH_REFUSED, `history` is unchanged.
    """
    buffer, norm, offsets, columns = borrowed(buffer), borrowed(norm), borrowed(offsets), borrowed(columns)
    history, state, answer = borrowed(history), borrowed(state), borrowed(answer)
    problem = view_rows(buffer, norm.size, norm, offsets, columns)
    found = view_answer(answer, norm.size, offsets[-1], offsets.size - 2)
    _recall(history, state)
    if settings[0] == 0 or not _try_fast_path(problem, state, found):
        return np.int64(Outcome.FAST_PATH_REFUSED), np.int64(0)
    worst = certify_kernel(buffer, norm, offsets, columns, found.x, found.multipliers, found.residuals)
    if not worst <= KKT_MET:  # the search may find what meets them
        return np.int64(Outcome.FAST_PATH_REFUSED), np.int64(0)
    copy_into(found.problem, buffer)
    _remember(history, state)
    return np.int64(Outcome.SOLVED), np.int64(0)


@kernel_apart
def tick(
    buffer: Array, norm: Array, offsets: IntArray, columns: IntArray, settings: tuple[int, int], history:
    StateArray, state: StateArray, answer: Array,
) -> tuple[np.int64, Count]:  # fmt: skip
    """Resolve one tick by the fast path or, if that refuses, by the search; then compute the certificate.

    Args:
        buffer: (layout.size,) the hierarchy.
        norm: (n,) diagonal of W.
        offsets: (levels + 2,) first row of each level, as in `Layout`.
        columns: (M,) the unknown that a row is the unit vector of, or −1, as in `Layout`.
        settings: 1 to try the fast path, else 0; and the largest number of factorisations.
        history: (3, n + M) history that `new_history` allocated; updated here.
        state: (n + M,) filled with the final working set.
        answer: (layout.answer_size,) filled with x, multipliers, certificate and a copy of the hierarchy.

    Returns:
        The `Outcome` as a plain integer, and the number of factorisations: 0 if the fast path was accepted.
    """
    buffer, norm, offsets, columns = borrowed(buffer), borrowed(norm), borrowed(offsets), borrowed(columns)
    history, state, answer = borrowed(history), borrowed(state), borrowed(answer)
    problem = view_rows(buffer, norm.size, norm, offsets, columns)
    found = view_answer(answer, norm.size, offsets[-1], offsets.size - 2)
    x, multipliers, residuals = found.x, found.multipliers, found.residuals
    limit = settings[1]
    copy_into(found.problem, buffer)
    _recall(history, state)
    outcome, rounds, weakest = Outcome.SOLVED, np.int64(0), 1.0
    if settings[0] == 0 or not _try_fast_path(problem, state, found):
        first = np.int64(FIRST_SEARCH_LIMIT)
        outcome, rounds, weakest = search(problem, state, x, multipliers, first, limit, 0.0)
    worst = certify_kernel(buffer, norm, offsets, columns, x, multipliers, residuals)
    if outcome in (Outcome.ITERATION_LIMIT, Outcome.CYCLED) or (
        outcome == Outcome.SOLVED and not worst <= KKT_MET
    ):
        for i in range(state.size):  # once more, from an empty working set
            state[i] = Held.FREE
        outcome, more, weakest = search(problem, state, x, multipliers, np.int64(1), limit, 0.0)
        rounds += more
        worst = certify_kernel(buffer, norm, offsets, columns, x, multipliers, residuals)
    _remember(history, state)
    if outcome == Outcome.CONTRADICTION:
        for j in range(x.size):
            x[j] = np.nan  # a compromise between contradicting limits is not for a robot
    elif not np.isfinite(worst):
        outcome = Outcome.NOT_FINITE
    elif outcome == Outcome.SOLVED and worst > KKT_MET:
        outcome = Outcome.KKT_MISSED
    elif outcome == Outcome.SOLVED and residuals[0, PRIMAL] > STILL_PERTURBED:
        outcome = Outcome.STILL_PERTURBED
    elif outcome == Outcome.SOLVED and weakest < DIGITS_LOST * max(1.0, largest_entry(x)):
        outcome = Outcome.NEARLY_DEPENDENT
    return np.int64(outcome), rounds


@kernel
def _try_fast_path(problem: Rows, state: StateArray, found: Answer) -> bool:
    """Try the fast path from `state`, which becomes its working set if it accepts, else stays unchanged."""
    trial, verdict = state.copy(), Verdict.AGAIN
    for _ in range(FAST_PATH_ATTEMPTS):
        verdict = fast_path(problem, trial, found.x, found.multipliers)
        if verdict != Verdict.AGAIN:
            break
    if verdict != Verdict.ACCEPTED:
        return False
    copy_into(state, trial)
    return True


@kernel
def _recall(history: StateArray, state: StateArray) -> None:
    """Choose the initial working set: the last one or, if ticks alternate between two, the one before it."""
    copy_into(state, history[PREVIOUS] if history[ALTERNATES, 0] else history[LAST])


@kernel
def _remember(history: StateArray, state: StateArray) -> None:
    """Shift the history by one tick; note if this working set is more like the last but one than the last."""
    like_last, like_previous = 0, 0
    for i in range(state.size):
        like_last += state[i] == history[LAST, i]
        like_previous += state[i] == history[PREVIOUS, i]
        history[PREVIOUS, i] = history[LAST, i]
        history[LAST, i] = state[i]
    history[ALTERNATES, 0] = like_previous > like_last


class LazyTick:
    """Call `tick_fast` until it first refuses, and `tick` from then on, which is compiled only then.

    A control loop that cannot afford this additional call can do the same itself, as the module describes.
    """

    def __init__(self) -> None:
        self._entry: Callable[..., tuple[np.int64, Count]] = tick_fast

    def __call__(
        self, problem: tuple[Array, Array, IntArray, IntArray], settings: tuple[int, int],
        history: StateArray, state: StateArray, answer: Array,
    ) -> tuple[np.int64, Count]:  # fmt: skip
        """Resolve one tick.

        Args:
            problem: Buffer, norm, offsets and columns.
            settings: As of `tick`.
            history: As of `tick`.
            state: As of `tick`.
            answer: As of `tick`.

        Returns:
            The `Outcome` as a plain integer, and the number of factorisations.
        """
        outcome, rounds = self._entry(*problem, settings, history, state, answer)
        if outcome == Outcome.FAST_PATH_REFUSED:
            self._entry = tick
            outcome, rounds = tick(*problem, settings, history, state, answer)
        return outcome, rounds
