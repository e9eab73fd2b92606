"""Rows and answer of a tick in one compiled call, for a plan and a resolver that are both compiled."""

from collections.abc import Callable

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.jit import kernel_apart
from taskopt.kinematics.plan import fill_tick
from taskopt.kinematics.stack import Plan
from taskopt.resolver.active_set.resolver import ActiveSet, packed
from taskopt.resolver.active_set.tick import new_history, tick, tick_fast
from taskopt.resolver.active_set.workspace import Outcome
from taskopt.resolver.base import Resolver
from taskopt.resolver.fallback import ActiveSetWithFallback, conclude
from taskopt.resolver.tick_review import TickReview

FLAWED = -1  # the rows or bounds of a tick hold NaN, or a bound that nothing can meet
_SOLVED = int(Outcome.SOLVED)  # a plain integer: a comparison with a member of an Enum costs more


class OneCall:
    """Fill the rows of a plan and resolve them by the active-set method, in one compiled call.

    Args:
        plan: A plan that is filled by compiled code alone, with a diagonal norm.
        search: The active-set method with its settings.
        conclude: What is made of an answer that the search does not claim to be the optimum.
    """

    def __init__(self, plan: Plan, search: ActiveSet, conclude: Callable[[Resolution], Resolution]) -> None:
        self._plan, self._conclude = plan, conclude
        self._width, self._size = plan.layout.width, plan.layout.answer_size
        self._history = new_history(plan.layout)
        self._arguments = *plan.tick, plan.hierarchy.norm, search.settings, self._history
        self._entry = _fill_and_tick_fast if search.fast_path else _fill_and_tick

    def __call__(self, q: Array, t: float) -> Resolution:
        """Resolve the stack at one posture and time, without a check of the answer.

        Args:
            q: Posture, (nq,) [rad, m].
            t: Time [s].

        Returns:
            The answer; with the status SOLVED, its certificate is a proof.

        Raises:
            InvalidValue: q has the wrong size, or it or a target is not finite.
        """
        plan = self._plan
        plan.aim(q, t)
        state, answer = np.empty(self._width, np.int8), np.empty(self._size)
        code, rounds = self._entry(*self._arguments, state, answer)
        if code == _SOLVED:
            return Resolution(plan.hierarchy, answer, state, Status.SOLVED, rounds, TickReview)
        if code == Outcome.FAST_PATH_REFUSED:  # from now on with the search, which is compiled here
            self._entry = _fill_and_tick
            return self(q, t)
        if code == FLAWED:
            plan.blame(t)
        resolution = packed(plan.hierarchy, answer, state, code, rounds)
        return resolution if resolution.claimed else self._conclude(resolution)

    def compile(self, q: Array, t: float) -> None:
        """Compile the fast path and the search, so that no later tick has to wait for the compiler.

        Args:
            q: Posture, (nq,) [rad, m].
            t: Time [s].
        """
        first = self._entry
        self._entry = _fill_and_tick
        self(q, t)
        self._entry = first
        self(q, t)
        self._entry = first  # a refusal by the fast path has changed it

    def forget(self) -> None:
        """Let the next tick start without a warm start."""
        self._history[:] = 0


def one_call(plan: Plan, resolver: Resolver) -> OneCall | None:
    """Return rows and answer in one compiled call, where plan and resolver allow it.

    Args:
        plan: The stack, compiled for the robot.
        resolver: Any resolver.

    Returns:
        The call, or None if a row or a bound comes from Python after the compiled ones, if the norm is not
        diagonal, or if the resolver is not the active-set method.
    """
    if not plan.in_one_call or plan.hierarchy.norm.ndim == 2:
        return None
    if isinstance(resolver, ActiveSetWithFallback):
        return OneCall(plan, resolver.search, conclude)
    return OneCall(plan, resolver, _as_it_is) if isinstance(resolver, ActiveSet) else None


def _as_it_is(resolution: Resolution) -> Resolution:
    """Return the answer of a search that has no fallback."""
    return resolution


@kernel_apart
def _fill_and_tick_fast(
    program, numbers, q, J, placements, buffer, norm, settings, history, state, answer
):  # fmt: skip
    """`fill_tick`, then `tick_fast`; FLAWED where the rows are flawed."""
    if fill_tick(program, numbers, q, J, placements, buffer):
        return np.int64(FLAWED), np.int64(0)
    split = 3 + program[2] + 2
    offsets, columns = program[3:split], program[split : split + program[1]]
    return tick_fast(buffer, norm, offsets, columns, settings, history, state, answer)


@kernel_apart
def _fill_and_tick(
    program, numbers, q, J, placements, buffer, norm, settings, history, state, answer
):  # fmt: skip
    """`fill_tick`, then `tick`; FLAWED where the rows are flawed."""
    if fill_tick(program, numbers, q, J, placements, buffer):
        return np.int64(FLAWED), np.int64(0)
    split = 3 + program[2] + 2
    offsets, columns = program[3:split], program[split : split + program[1]]
    return tick(buffer, norm, offsets, columns, settings, history, state, answer)
