"""`active-set`: the closed form where it holds, else the exact hierarchy, warm from the last tick.

Its memory is the active set alone, so that a logged tick can be resolved again exactly.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from taskopt.arrays import Array
from taskopt.jit import kernel
from taskopt.problem.certificate import certify_kernel
from taskopt.problem.hierarchy import Hierarchy
from taskopt.problem.layout import Layout
from taskopt.problem.resolution import Resolution, Status
from taskopt.resolver.base import Memory
from taskopt.resolver.cholesky import copy_into
from taskopt.resolver.normal_tick import ACCEPTED, AGAIN, REFUSED, normal_tick
from taskopt.resolver.review import TickReview
from taskopt.resolver.whitening import resolve_whitened
from taskopt.resolver.working_set import walk

TRIES = 4  # of the closed form, each a bound of the box apart; a tick seldom changes more
STATUS = (Status.SOLVED, Status.ITERATION_LIMIT, Status.INFEASIBLE, Status.FAILED)


@dataclass(frozen=True)
class ActiveSet:
    """Exact lexicographic optimum of levels with equalities and inequalities, inside hard limits.

    `shortcut`: whether the closed form of a normal tick is tried first (it never changes the
    answer). Status INFEASIBLE where hard limits contradict each other; ITERATION_LIMIT after
    `iterations` factorisations.
    """

    shortcut: bool = True
    iterations: int = 500
    name: str = "active-set"
    strict: bool = True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        layout = hierarchy.layout
        if memory is None:
            memory = _nothing_active(layout)
        if hierarchy.norm.ndim == 2:
            return resolve_whitened(self, hierarchy, memory)
        state = memory.state.copy()
        answer = np.empty(layout.answer_size)
        problem = hierarchy.buffer, hierarchy.norm, layout.offsets, layout.columns
        code, rounds = resolve_kernel(*problem, self.shortcut, self.iterations, state, answer)
        return Resolution(hierarchy, answer, state, STATUS[code], rounds, TickReview), Memory(state)

    def twin(self, hierarchy: Hierarchy) -> Array:
        from taskopt.resolver.closed_form import task_priority

        return task_priority(hierarchy)


@lru_cache(maxsize=64)
def _nothing_active(layout: Layout) -> Memory:
    return Memory(np.zeros(layout.n + layout.row_count, dtype=np.int8))


@kernel
def resolve_kernel(buffer, norm, offsets, columns, shortcut, limit, state, answer):
    """One tick: closed form if it is accepted, else the walk; then the certificate.

    Fills `answer` (x, multipliers, certificate, the problem) and `state`; returns (status code,
    factorisations), zero factorisations meaning the closed form.
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
    code, rounds = 0, 0
    verdict, trial = REFUSED, state.copy()
    for _ in range(TRIES if shortcut else 0):
        verdict = normal_tick(
            A, lower, upper, weight, box_lower, box_upper, norm, offsets, columns, trial, x, y
        )
        if verdict != AGAIN:
            break
    if verdict == ACCEPTED:
        copy_into(state, trial)
    else:
        code, rounds = _general(
            A, lower, upper, weight, box_lower, box_upper, norm, offsets, state, limit, x, y
        )
    certify_kernel(buffer, norm, offsets, columns, x, y, residuals)
    if code == 2:
        x[:] = np.nan  # a compromise between contradicting limits is not for a robot
    else:
        for residual in residuals.ravel():  # infinite where x is not a number, or a row was not
            if not np.isfinite(residual):
                code = 3
    return code, rounds


@kernel
def _general(A, lower, upper, weight, box_lower, box_upper, norm, offsets, state, limit, x, y):
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
    code, rounds = walk(S, scale, low, high, low_box, high_box, offsets, state, limit, x, y)
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
