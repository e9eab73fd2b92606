"""`ActiveSet`, which finds the exact lexicographic optimum by our own active-set method.

Its memory has the working sets of the last two ticks and a flag. If a target is out of reach, tasks with high
gains drive joints from one limit to the other and back; the working set of two ticks ago is then the better
warm start, and the flag says so. A logged tick can be resolved again exactly from its memory.
"""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.certificate import PRIMAL, certify
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof import Verdict, judge, prove
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import ACCURACY, CERTIFICATE_ROUNDING, PLAIN_CONTRADICTION
from taskopt.hierarchy.view import answer_of
from taskopt.resolver.active_set.full_norm import resolve_full_norm
from taskopt.resolver.active_set.search import search
from taskopt.resolver.active_set.tick import (
    ALTERNATES,
    FIRST_SEARCH_LIMIT,
    LAST,
    PREVIOUS,
    LazyTick,
    new_history,
)
from taskopt.resolver.active_set.workspace import Held, Outcome
from taskopt.resolver.base import Memory, checked, fit_again
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.tick_review import TickReview

_STATUS = {
    Outcome.SOLVED: Status.SOLVED,
    Outcome.ITERATION_LIMIT: Status.ITERATION_LIMIT,
    Outcome.CONTRADICTION: Status.INFEASIBLE,
    Outcome.NOT_FINITE: Status.FAILED,
    Outcome.KKT_MISSED: Status.FAILED,
    Outcome.NEARLY_DEPENDENT: Status.SOLVED,
    Outcome.CYCLED: Status.FAILED,
    Outcome.STILL_PERTURBED: Status.SOLVED,
}
_TO_ENCLOSE = (
    Outcome.KKT_MISSED,
    Outcome.NEARLY_DEPENDENT,
    Outcome.CONTRADICTION,
    Outcome.STILL_PERTURBED,
)
LAST_SEARCH_LIMIT = 1000  # factorisations of each search that follows one without an answer
_FURTHER_SEARCHES = (  # factorisations with the true bounds, and the share up to which multipliers are zero
    (LAST_SEARCH_LIMIT, 0.0),
    (1, CERTIFICATE_ROUNDING),
    (FIRST_SEARCH_LIMIT, CERTIFICATE_ROUNDING),
)
_run_tick = LazyTick()


@dataclass(frozen=True)
class ActiveSet:
    """Exact lexicographic optimum of levels with equalities and inequalities, inside hard limits.

    This is the method alone: it has no fallback, and its status INFEASIBLE is not confirmed by phase one.
    `taskopt.resolver.fallback` adds both.

    Attributes:
        fast_path: True to try the closed form before the search; the answer is the same either way.
        iterations: Factorisations after which the search stops with ITERATION_LIMIT.
    """

    fast_path: bool = True
    iterations: int = 1500
    name: str = "active-set"
    strict: bool = True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        """Resolve one tick.

        Args:
            hierarchy: The problem.
            memory: The memory that the last tick returned, or None at the first tick.

        Returns:
            The resolution, and the memory for the next tick.

        Raises:
            InvalidValue: The memory belongs to a hierarchy of another layout.
        """
        layout, memory = hierarchy.layout, checked(memory, hierarchy.layout)
        if hierarchy.norm.ndim == 2:
            return resolve_full_norm(self, hierarchy, memory)
        history = new_history(layout)
        if memory is not None:
            history[LAST] = memory.state
            history[PREVIOUS] = memory.state if memory.previous is None else memory.previous
            history[ALTERNATES] = memory.alternates
        state, answer = np.empty(layout.width, np.int8), np.empty(layout.answer_size)
        problem = hierarchy.buffer, hierarchy.norm.copy(), layout.offsets, layout.columns
        outcome, rounds = _run_tick(problem, self.settings, history, state, answer)
        kept = Memory(state, previous=history[PREVIOUS], alternates=bool(history[ALTERNATES, 0]))
        return resolution_of(hierarchy, answer, state, int(outcome), int(rounds)), kept

    @property
    def settings(self) -> tuple[int, int]:
        """The settings of the compiled entries: 1 to try the fast path, else 0; and `iterations`."""
        return int(self.fast_path), self.iterations

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of the closed form of the same problem, which ignores inequalities and limits."""
        return task_priority(hierarchy)


def resolution_of(
    hierarchy: Hierarchy, answer: Array, state: StateArray, outcome: int, rounds: int
) -> Resolution:
    """Make a resolution of the arrays that a compiled entry filled.

    Where x keeps moved bounds, the search goes on with the true ones. Where that does not end, where rows
    nearly depend on each other, or where an answer misses its KKT conditions, x is taken from the
    enclosure of the optimum that the working set leads to. If there is none and the answer misses its KKT
    conditions, other multipliers are computed for its x. If it misses them with these as well, only a proof
    that x is the optimum counts: where rows of one level differ in size by many powers of ten, no tolerance
    on a residual fits all of them. Without that, and where the search cycled, `search_further` is the last
    resort.

    Args:
        hierarchy: The problem.
        answer: (layout.answer_size,) as filled; multipliers and residuals are replaced by a second fit.
        state: (n + M,) the final working set.
        outcome: The `Outcome`.
        rounds: The number of factorisations.

    Returns:
        The resolution, without any fallback.
    """
    went_on = outcome == Outcome.STILL_PERTURBED and search_on(hierarchy, answer, state)
    to_enclose = outcome in _TO_ENCLOSE and not (
        outcome == Outcome.CONTRADICTION and _is_plain(hierarchy, answer)
    )
    if went_on or (to_enclose and take_enclosed(hierarchy, answer, state)):
        outcome = Outcome.SOLVED
    elif outcome == Outcome.KKT_MISSED:
        x = answer_of(answer, hierarchy.n, hierarchy.layout.row_count, hierarchy.layout.level_count).x
        fitted = fit_again(hierarchy, answer) or judge(hierarchy, x, state).proven
        if fitted or search_further(hierarchy, answer, state):
            outcome = Outcome.SOLVED
    elif outcome == Outcome.CYCLED and search_further(hierarchy, answer, state):
        outcome = Outcome.SOLVED
    return Resolution(hierarchy, answer, state, _STATUS[Outcome(outcome)], rounds, TickReview)


def _is_plain(hierarchy: Hierarchy, answer: Array) -> bool:
    """Return True if hard rows contradict each other by more than rounding."""
    layout = hierarchy.layout
    parts = answer_of(answer, layout.n, layout.row_count, layout.level_count)
    return not parts.residuals[0, PRIMAL] <= PLAIN_CONTRADICTION  # NaN if an interval is empty


def search_on(hierarchy: Hierarchy, answer: Array, state: StateArray) -> bool:
    """Search on with the true bounds from a working set that was found with moved ones.

    Args:
        hierarchy: The problem, with a diagonal norm.
        answer: (layout.answer_size,) of which x, multipliers and residuals are replaced if that ends well.
        state: (n + M,) the final working set; so is this.

    Returns:
        True if the search ends, and x meets its KKT conditions.
    """
    layout, held, found = hierarchy.layout, state.copy(), answer.copy()
    parts = answer_of(found, layout.n, layout.row_count, layout.level_count)
    limits = np.int64(FIRST_SEARCH_LIMIT), FIRST_SEARCH_LIMIT  # none is left for moved bounds
    outcome, *_ = search(hierarchy.rows, held, parts.x, parts.multipliers, *limits, 0.0)
    own = certify(hierarchy, parts.x, parts.multipliers)
    if outcome != Outcome.SOLVED or not own.kkt_met():
        return False
    parts.residuals[:] = own.residuals
    answer[:], state[:] = found, held
    return True


def search_further(hierarchy: Hierarchy, answer: Array, state: StateArray) -> bool:
    """Search without haste; then coarsely, taking for zero what no certificate can tell from rounding.

    The first of these searches has many factorisations with the true bounds. Where rows depend on each other
    nearly to rounding, a multiplier of 1e-22 may hold a bound for a residual of 1e-12, and neither its sign
    nor the rank is certain. The same is true of a row that repeats one of a level before, far out of reach:
    rounding times its residual moves weak directions, other ones for each working set, and the search cycles.
    The coarse searches take directions between `LOST` and `REGAINED` as lost, what is left of such rows as
    zero, and multipliers up to `CERTIFICATE_ROUNDING` as zero.

    Args:
        hierarchy: The problem, with a diagonal norm.
        answer: (layout.answer_size,) of which x, multipliers and residuals are replaced.
        state: (n + M,) filled with the final working set.

    Returns:
        True if x meets its KKT conditions and is not refuted, or is the middle of an enclosure.
    """
    layout = hierarchy.layout
    parts = answer_of(answer, layout.n, layout.row_count, layout.level_count)
    for first, rounding in _FURTHER_SEARCHES:
        state[:] = Held.FREE
        limits = np.int64(first), LAST_SEARCH_LIMIT
        outcome, *_ = search(hierarchy.rows, state, parts.x, parts.multipliers, *limits, rounding)
        found = certify(hierarchy, parts.x, parts.multipliers)
        parts.residuals[:] = found.residuals
        if outcome == Outcome.SOLVED and found.kkt_met():
            return judge(hierarchy, parts.x, state).verdict is not Verdict.REFUTED
        if outcome == Outcome.SOLVED and take_enclosed(hierarchy, answer, state):
            return True
    return False


def take_enclosed(hierarchy: Hierarchy, answer: Array, state: StateArray) -> bool:
    """Replace x by the middle of an enclosure of the optimum, if the working set leads to a narrow one.

    Args:
        hierarchy: The problem.
        answer: (layout.answer_size,) of which x, multipliers and residuals are replaced.
        state: (n + M,) the final working set; the set of the optimum replaces it.

    Returns:
        True if x was replaced: then every entry is within `ACCURACY` · max(1, |x_i|) of the optimum.
    """
    found = prove(hierarchy, state.copy())
    if not found.candidates or found.doubtful:  # ranks up to rounding are a matter of the search
        return False
    layout = hierarchy.layout
    if (found.distance(found.x) > ACCURACY * np.maximum(1.0, np.abs(found.x))).any():
        return False
    parts = answer_of(answer, layout.n, layout.row_count, layout.level_count)
    parts.x[:] = np.clip(found.x, hierarchy.box_lower, hierarchy.box_upper)
    own = certify(hierarchy, parts.x, parts.multipliers)
    parts.residuals[:] = own.residuals
    if not own.kkt_met():
        fitted = find_multipliers(hierarchy, parts.x)
        other = certify(hierarchy, parts.x, fitted)
        if other.worst < own.worst:
            parts.multipliers[:], parts.residuals[:] = fitted, other.residuals
    lower, upper = hierarchy.bounds()
    state[:] = np.where(lower == upper, Held.UPPER, found.state)
    return True
