"""`active-set`: the closed form where it holds, else the exact hierarchy, warm from the last tick.

Its memory is two active sets and a sign, so that a logged tick can be resolved again exactly. Where a
target is out of reach, tasks with high gains throw joints from one limit to the other and back; the
active set of two ticks ago is then the better guess.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.certificate import certify_kernel
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import PROVEN
from taskopt.jit import kernel, kernel_apart
from taskopt.resolver.active_set.fast_path import ACCEPTED, AGAIN, REFUSED, normal_tick
from taskopt.resolver.active_set.linalg import copy_into
from taskopt.resolver.active_set.search import walk
from taskopt.resolver.active_set.whitening import resolve_whitened
from taskopt.resolver.base import Memory, checked, prove_again
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.tick_review import TickReview

TRIES = 4  # of the closed form, each a bound of the box apart; a tick seldom changes more
FIRST = 150  # factorisations that the guess is worth
SOLVED, CONTRADICTED, UNPROVEN = 0, 2, 4  # the last: done, but the certificate refuses
STATUS = (Status.SOLVED, Status.ITERATION_LIMIT, Status.INFEASIBLE, Status.FAILED, Status.FAILED)


@dataclass(frozen=True)
class ActiveSet:
    """Exact lexicographic optimum of levels with equalities and inequalities, inside hard limits.

    `shortcut`: whether the closed form of a normal tick is tried first (it never changes the
    answer). Status INFEASIBLE where hard limits contradict each other; ITERATION_LIMIT after
    `iterations` factorisations.
    """

    shortcut: bool = True
    iterations: int = 1500
    name: str = "active-set"
    strict: bool = True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        layout, memory = hierarchy.layout, checked(memory, hierarchy.layout)
        if hierarchy.norm.ndim == 2:
            return resolve_whitened(self, hierarchy, memory or _nothing_active(layout))
        history, width = new_history(layout), layout.width
        if memory is not None:
            before = memory.state if memory.previous is None else memory.previous
            history[:width], history[width : 2 * width], history[-1] = memory.state, before, memory.alternates
        state, answer = np.empty(width, np.int8), np.empty(layout.answer_size)
        problem = hierarchy.buffer, hierarchy.norm, layout.offsets, layout.columns
        code, rounds = resolve_kernel(*problem, self.shortcut, self.iterations, history, state, answer)
        kept = Memory(state, previous=history[width : 2 * width], alternates=bool(history[-1]))
        return packed(hierarchy, answer, state, code, rounds), kept

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        return task_priority(hierarchy)


def packed(hierarchy: Hierarchy, answer: Array, state: StateArray, code: int, rounds: int) -> Resolution:
    """Pack what `resolve_kernel` filled; an unproven x gets a second hearing, and has failed without it."""
    if code == UNPROVEN and prove_again(hierarchy, answer):
        code = SOLVED
    return Resolution(hierarchy, answer, state, STATUS[code], rounds, TickReview)


@lru_cache(maxsize=64)
def _nothing_active(layout: Layout) -> Memory:
    return Memory(np.zeros(layout.width, dtype=np.int8))


def new_history(layout: Layout) -> StateArray:
    """What `resolve_kernel` keeps from tick to tick, before the first: the last active set, the one
    before, and whether they swing (see `Memory`)."""
    return np.zeros(2 * layout.width + 1, dtype=np.int8)


@kernel_apart
def resolve_kernel(buffer, norm, offsets, columns, shortcut, limit, history, state, answer):
    """One tick: closed form if it is accepted, else the walk; then the certificate.

    Fills `answer` (x, multipliers, certificate, the problem) and `state`, and brings `history` up to
    date; returns (status code, factorisations), zero factorisations meaning the closed form.
    """
    n, rows, levels = norm.size, offsets[-1], offsets.size - 2
    width = n + rows
    A = buffer[: rows * n].reshape((rows, n))
    bounds = buffer[rows * n :]
    lower, upper, weight = bounds[:rows], bounds[rows : 2 * rows], bounds[2 * rows : 3 * rows]
    box_lower, box_upper = bounds[3 * rows : 3 * rows + n], bounds[3 * rows + n : 3 * rows + 2 * n]
    x = answer[:n]
    y = answer[n : n + (levels + 1) * width].reshape((levels + 1, width))
    stop = n + (levels + 1) * (width + 4)
    residuals = answer[n + (levels + 1) * width : stop].reshape((levels + 1, 4))
    copy_into(answer[stop:], buffer)
    _recall(history, state)
    rows_and_box = A, lower, upper, weight, box_lower, box_upper
    code, rounds = 0, 0
    verdict, trial = REFUSED, state.copy()
    for _ in range(TRIES if shortcut else 0):
        verdict = normal_tick(*rows_and_box, norm, offsets, columns, trial, x, y)
        if verdict != AGAIN:
            break
    if verdict == ACCEPTED:
        copy_into(state, trial)
    else:
        code, rounds = _general(*rows_and_box, norm, offsets, state, FIRST, limit, x, y)
    worst = certify_kernel(buffer, norm, offsets, columns, x, y, residuals)
    if code == 1 or (code == 0 and not worst <= PROVEN):  # lost on the way; once more, without a guess
        state[:] = 0
        code, again = _general(*rows_and_box, norm, offsets, state, 1, limit, x, y)
        rounds += again
        worst = certify_kernel(buffer, norm, offsets, columns, x, y, residuals)
    _remember(history, state)
    if code == 2:
        x[:] = np.nan  # a compromise between contradicting limits is not for a robot
    elif not np.isfinite(worst):  # x is not a number, or a row was not
        code = 3
    elif code == 0 and worst > PROVEN:
        code = UNPROVEN
    return code, rounds


@kernel
def _recall(history, state):
    """The guess: last tick's active set, or, where ticks swing between two, the one before."""
    width = state.size
    copy_into(state, history[width : 2 * width] if history[2 * width] else history[:width])


@kernel
def _remember(history, state):
    """Shift the history by a tick."""
    width, like_last, like_before = state.size, 0, 0
    for i in range(width):
        like_last += state[i] == history[i]
        like_before += state[i] == history[width + i]
        history[width + i], history[i] = history[i], state[i]
    history[2 * width] = like_before > like_last


@kernel_apart
def _general(A, lower, upper, weight, box_lower, box_upper, norm, offsets, state, first, limit, x, y):
    """Scale (rows by √w, unknowns by √W), walk, and scale back."""
    n, rows = norm.size, lower.size
    S, scale, root = np.empty((rows, n)), np.empty(rows), np.empty(rows)
    low, high = np.empty(rows), np.empty(rows)
    stretch, low_box, high_box = np.empty(n), np.empty(n), np.empty(n)
    for j in range(n):
        stretch[j] = np.sqrt(norm[j])
        low_box[j], high_box[j] = box_lower[j] * stretch[j], box_upper[j] * stretch[j]
    for i in range(rows):
        root[i] = 1.0 if i < offsets[1] else np.sqrt(weight[i])
        squared = 0.0
        for j in range(n):
            S[i, j] = A[i, j] * root[i] / stretch[j]
            squared += A[i, j] * A[i, j] / norm[j]
        scale[i] = root[i] * max(1.0, np.sqrt(squared))
        low[i], high[i] = lower[i] * root[i], upper[i] * root[i]
    code, rounds = walk(S, scale, low, high, low_box, high_box, offsets, state, first, limit, x, y)
    for j in range(n):
        x[j] /= stretch[j]
        if state[j] != 0:
            x[j] = box_upper[j] if state[j] > 0 else box_lower[j]
        x[j] = min(max(x[j], box_lower[j]), box_upper[j])
    for k in range(y.shape[0]):
        for j in range(n):
            y[k, j] *= stretch[j]
        for i in range(rows):
            y[k, n + i] *= root[i]
    return code, rounds
