"""One compiled call that fills the rows of a tick and resolves them."""

from collections.abc import Callable
from functools import lru_cache
from typing import cast

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank_doubt import rank_in_doubt, watch_size
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.jit import kernel_apart
from taskopt.jit.borrowed import borrowed
from taskopt.kinematics.plan import Fill, Header, problem_in
from taskopt.kinematics.stack import Plan
from taskopt.loop.rest import Rest
from taskopt.resolver.active_set.resolver import ActiveSet, resolution_of
from taskopt.resolver.active_set.tick import LazyTick, new_history, tick, tick_fast
from taskopt.resolver.active_set.workspace import Outcome
from taskopt.resolver.base import Resolver
from taskopt.resolver.fallback import ActiveSetWithFallback
from taskopt.resolver.tick_review import TickReview

FLAWED = -1  # the rows or bounds of a tick hold NaN, or a bound that nothing can meet
IN_DOUBT = -2  # solved, but a level may be so near a loss of rank that the tick must be damped
# Looking a member up in its Enum on every tick would cost as much as a short call.
_SOLVED, _CLAIMED = int(Outcome.SOLVED), Status.SOLVED


Entry = Callable[..., tuple[int, int]]  # returns outcome and number of factorisations


class OneCall:
    """Fill the rows of a plan and resolve them by the active-set method, in one compiled call.

    Args:
        plan: A plan that is filled by compiled code alone, with a diagonal norm.
        search: The active-set method with its settings.
        conclude: Function that checks or replaces an answer that the search does not claim to be the optimum.
        rest: Damps ticks that need it; None for no damping.

    Attributes:
        history: Working sets of the last ticks, see `taskopt.resolver.active_set.tick`.
    """

    def __init__(
        self,
        plan: Plan,
        search: ActiveSet,
        conclude: Callable[[Resolution], Resolution],
        rest: Rest | None = None,
    ) -> None:
        self._plan, self._conclude, self._rest = plan, conclude, rest
        self._width, self._size = plan.layout.width, plan.layout.answer_size
        self.history = new_history(plan.layout)
        self._arguments = *plan.tick, self.history
        self._settings, self._apart = search.settings, LazyTick()
        self._rests = type(rest) is Rest  # not that of accelerations
        fast, limit = (int(number) for number in search.settings)
        form = _fill_and_tick if rest is None else _fill_tick_and_doubt
        self._with_search = form(plan.fill, tick, fast, limit)
        self._entry = form(plan.fill, tick_fast, fast, limit) if fast else self._with_search

    def answer(self, q: Array, t: float) -> Resolution:
        """Resolve the stack at one posture and time; the answer is not checked.

        Args:
            q: Posture, (nq,) [rad, m].
            t: Time [s].

        Returns:
            The answer. If its status is SOLVED, it meets its KKT conditions to `KKT_MET`.

        Raises:
            InvalidValue: q has the wrong size, or it or a target is not finite.
        """
        plan = self._plan
        plan.aim(q, t)
        if self._rest is not None:
            self._rest.look()
        state, answer = np.empty(self._width, np.int8), np.empty(self._size)
        rest = self._rest
        rests = rest if self._rests and rest is not None and rest.last is not None else None
        if plan.altered or rests is not None:  # Python may have to follow the kernels of the rows
            problem = _problem(plan.filled(t))
            damped = None if rests is None else rests.again(self._settings, self.history)
            if damped is not None:
                return damped
            outcome, count = self._apart(problem, self._settings, self.history, state, answer)
            code, rounds = int(outcome), int(count)
            code = IN_DOUBT if code == _SOLVED and self._rest is not None else code
        else:
            code, rounds = self._entry(*self._arguments, state, answer)
        if code == _SOLVED and self._rest is not None and self._rest.last is not None:
            code = IN_DOUBT  # for one tick after damped ones, whatever the quick look says
        if code == _SOLVED:
            return Resolution(plan.hierarchy, answer, state, _CLAIMED, rounds, TickReview)
        if code == IN_DOUBT and self._rest is not None:
            return self._rest.answer(Resolution(plan.hierarchy, answer, state, _CLAIMED, rounds, TickReview))
        if code == Outcome.FAST_PATH_REFUSED:  # from now on with the search, which is compiled here
            self._entry = self._with_search
            return self.answer(q, t)
        if code == FLAWED:
            plan.blame(t)
        resolution = resolution_of(plan.hierarchy, answer, state, code, rounds)
        resolution = resolution if resolution.claimed else self._conclude(resolution)
        return resolution if self._rest is None else self._rest.answer(resolution)

    def compile(self, q: Array, t: float) -> None:
        """Compile the fast path and the search, so that no later tick has to wait for the compiler.

        Args:
            q: Posture, (nq,) [rad, m].
            t: Time [s].
        """
        first = self._entry
        self._entry = self._with_search
        self.answer(q, t)
        self._entry = first
        self.answer(q, t)
        self._entry = first  # a refusal by the fast path has changed it

    def forget(self) -> None:
        """Forget the last tick, so that the next one has no warm start."""
        self.history[:] = 0


def _problem(hierarchy: Hierarchy) -> tuple[Array, Array, IntArray, IntArray]:
    """Return buffer, norm, offsets and columns of a hierarchy."""
    return hierarchy.buffer, hierarchy.norm, hierarchy.layout.offsets, hierarchy.layout.columns


def one_call(plan: Plan, resolver: Resolver, rest: Rest | None = None) -> OneCall | None:
    """Make the compiled call of a plan, if plan and resolver allow it.

    Args:
        plan: The stack, compiled for the robot.
        resolver: Any resolver.
        rest: Damps ticks that need it; None for no damping.

    Returns:
        The call; None if Python code fills a row or a bound after the kernels, if the norm is not diagonal,
        or if the resolver is not the active-set method.
    """
    if not plan.in_one_call or plan.hierarchy.norm.ndim == 2:
        return None
    if isinstance(resolver, ActiveSetWithFallback):
        return OneCall(plan, resolver.search, resolver.conclude, rest)
    return OneCall(plan, resolver, _as_it_is, rest) if isinstance(resolver, ActiveSet) else None


def _as_it_is(resolution: Resolution) -> Resolution:
    """Return the answer of a search that has no fallback."""
    return resolution


@lru_cache(maxsize=256)
def _fill_and_tick(fill: Fill, resolve: Entry, fast: int, limit: int) -> Entry:
    """Return the compiled tick of a plan: its fill function, then `tick` or `tick_fast`.

    The function returns FLAWED if the rows are flawed.
    """

    @kernel_apart
    def fill_and_tick(program, numbers, q, jacobians, placements, history, state, answer):
        """Fill the rows, then resolve them."""
        program, numbers, q = borrowed(program), borrowed(numbers), borrowed(q)
        jacobians, placements = borrowed(jacobians), borrowed(placements)
        history, state, answer = borrowed(history), borrowed(state), borrowed(answer)
        if fill(program, numbers, q, jacobians, placements):
            return FLAWED, 0
        buffer, norm, offsets, columns = problem_in(program, numbers)
        settings = np.int64(fast), np.int64(limit)
        return resolve(buffer, norm, offsets, columns, settings, history, state, answer)

    return cast("Entry", fill_and_tick)


@lru_cache(maxsize=256)
def _fill_tick_and_doubt(fill: Fill, resolve: Entry, fast: int, limit: int) -> Entry:
    """Return the same function with IN_DOUBT in place of SOLVED if the tick may have to be damped."""
    entry = _fill_and_tick(fill, resolve, fast, limit)

    @kernel_apart
    def fill_tick_and_doubt(program, numbers, q, jacobians, placements, history, state, answer):
        """Fill the rows, resolve them, and look whether a level may be near a loss of rank."""
        code, rounds = entry(program, numbers, q, jacobians, placements, history, state, answer)
        program, numbers = borrowed(program), borrowed(numbers)
        buffer, norm, offsets, columns = problem_in(program, numbers)
        n, start = norm.size, program[Header.BOX]
        watch = numbers[numbers.size - watch_size(n, columns.size) :]
        if code == _SOLVED and watch[0] > 0.0:
            base = numbers[start : start + 2 * n]
            if rank_in_doubt(buffer, norm, offsets, columns, borrowed(answer)[:n], state, base, watch):
                return IN_DOUBT, rounds
        return code, rounds

    return cast("Entry", fill_tick_and_doubt)
