"""One tick of a stack, which is the same in `run` and in `Controller`.

    targets at t, rows at q ─▶ answer ─▶ may it be sent? ─▶ if not: conflict policy ─▶ tell who follows v

After a tick whose answer may not be sent, the next tick starts without memory, since the active set of a
hierarchy with contradictory limits is not a useful warm start for one whose limits agree.
"""

from time import perf_counter_ns
from typing import NamedTuple, cast

import numpy as np

from taskopt.arrays import Array, ArrayLike, StateArray
from taskopt.errors import NotSolved
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import NO_OPTIMUM, Status
from taskopt.hierarchy.tolerances import CLAIM_KEEPS_LIMITS, STOPPED_KEEPS_LIMITS
from taskopt.jit import nanoseconds_preparing
from taskopt.kinematics.stack import Plan
from taskopt.loop.one_call import OneCall, one_call
from taskopt.loop.rest import Rest
from taskopt.loop.rest_of_accelerations import RestOfAccelerations
from taskopt.resolver.base import Memory, Resolver, is_finite, require_answer
from taskopt.resolver.infeasible import ConflictPolicy, apply_conflict_policy
from taskopt.solver.inside import nanoseconds_inside

# A look-up in the Enum on every tick would cost as much as a short call.
_SOLVED, _STOPPED = Status.SOLVED, Status.ITERATION_LIMIT
_WITHOUT_OPTIMUM = NO_OPTIMUM | {Status.RELAXED}


class Seconds(NamedTuple):
    """Durations of the parts of one tick.

    Attributes:
        rows: Time for kinematics, targets and rows [s].
        resolver: Time in the resolver [s].
        solver: Part of it that was spent inside the package of a solver [s]; 0 without one.
    """

    rows: float
    resolver: float
    solver: float


class Loop:
    """Resolve a stack tick by tick: fill the rows, answer, check the answer, apply the conflict policy.

    A stack whose tasks and limits all have kernels is filled and resolved in one compiled call, if the
    resolver is `active-set` and the norm is diagonal, since a call from Python costs more than filling the
    rows. In every other case, and in a loop that is `timed`, the plan fills the rows first, and then the
    resolver is called with them.

    Args:
        plan: The stack, compiled for the robot.
        resolver: Resolves the hierarchy of each tick.
        policy: What to do if hard limits contradict each other.
        timed: Measure the times of rows and resolver separately, see `seconds`.

    Attributes:
        rest: Damps ticks that need it; None if the stack has no damping, or the resolver is not strict.
        restarts: How often a memory was forgotten, or taken from another loop.
    """

    def __init__(
        self, plan: Plan, resolver: Resolver, policy: ConflictPolicy, *, timed: bool = False
    ) -> None:
        self.plan, self.resolver = plan, resolver
        self._policy: ConflictPolicy = policy
        self._tells_velocity = bool(plan.rate_limits or plan.rate_tasks or plan.motion)
        self._memory: Memory | None = None
        self.restarts = 0
        self._nanoseconds = 0, 0, 0
        damps = plan.stack.damping is not None and resolver.strict
        kind = Rest if plan.motion is None else RestOfAccelerations
        self.rest = kind(plan, resolver) if damps else None
        self._one_call: OneCall | None = None if timed else one_call(plan, resolver, self.rest)
        two_calls = self._timed_calls if timed else self._in_two_calls
        self._answer = two_calls if self._one_call is None else self._one_call.answer
        self._solved_keeps_limits = self._one_call is not None  # else SOLVED is the claim of some resolver

    @property
    def seconds(self) -> Seconds:
        """Times of the last tick [s]; zeros in a loop that is not `timed`."""
        return Seconds(*(1e-9 * each for each in self._nanoseconds))

    def start(self, q: ArrayLike, t: float) -> None:
        """Start all targets from a posture, forget the last tick, and compile what a tick needs.

        Args:
            q: Start posture, (nq,) [rad, m].
            t: Time of the start [s].

        Raises:
            InvalidValue: q has the wrong size, q or a target is not finite, or the first answer of the
                resolver does not have the form that `Resolver` promises.
        """
        q = self.plan.robot.checked_q(q)
        self.plan.start(q, t)
        self.forget()
        if self._one_call is None:
            self._answer(q, t)
        else:
            self._one_call.compile(q, t)
        self.forget()

    def tick(self, q: Array, t: float) -> Resolution:
        """Resolve the stack at one posture and time, and pass the velocity to the parts that depend on it.

        Args:
            q: Posture, (nq,) [rad, m].
            t: Time [s].

        Returns:
            A resolution whose velocity may be sent to the robot, see `may_be_sent`.

        Raises:
            InvalidValue: q has the wrong size, q or a target is not finite, or the first answer without a
                memory does not have the form that `Resolver` promises.
            Infeasible: Hard limits contradict each other, and the policy is "raise".
            NotSolved: There is no answer that may be sent to a robot.
        """
        resolution = self._answer(q, t)
        if resolution.status is not _SOLVED or not self._solved_keeps_limits:
            resolution = self._checked(resolution, t)
        if self._tells_velocity:
            self.plan.answered(resolution.x)
        else:
            self.plan.velocity = resolution.x
        return resolution

    def next_posture(self) -> Array:
        """Return the posture at the next tick, if the robot follows the answer of the last one.

        Returns:
            New array (nq,), see `Plan.next_posture`.
        """
        plan, one_call = self.plan, self._one_call
        known = None if one_call is None else one_call.posture_after(plan.velocity)
        return plan.next_posture(plan.configuration.q) if known is None else known

    def forget(self) -> None:
        """Forget the last tick, so that the next one has no warm start."""
        self._memory = None
        self.restarts += 1
        if self._one_call is not None:
            self._one_call.forget()
        if self.rest is not None:
            self.rest.last = None

    def recall(self) -> object:
        """Return a copy of the memory of the last tick, for `remember` of a copy of this loop."""
        return self.memory, None if self.rest is None else self.rest.last

    @property
    def memory(self) -> Memory | StateArray | None:
        """A copy of the memory that the resolver begins the next tick with, for logs.

        It is the history (3, n + M) of the compiled entries if ticks are resolved in one call.
        """
        return self._memory if self._one_call is None else self._one_call.history.copy()

    @property
    def history(self) -> StateArray | None:
        """The same memory itself, which ticks in one call change in place; None if there are two calls."""
        return None if self._one_call is None else self._one_call.history

    def remember(self, memory: object) -> None:
        """Continue with the memory of another loop of the same stack and resolver.

        Args:
            memory: Memory that `recall` returned.
        """
        self.restarts += 1
        own, last = cast("tuple[object, tuple[Array, StateArray] | None]", memory)
        if self._one_call is None:
            self._memory = cast("Memory | None", own)
        else:
            self._one_call.history[:] = cast("StateArray", own)
        if self.rest is not None:
            self.rest.last = last

    def _in_two_calls(self, q: Array, t: float) -> Resolution:
        """Fill the rows, and call the resolver with them."""
        return self._resolved(self.plan.at(q, t))

    def _timed_calls(self, q: Array, t: float) -> Resolution:
        """Fill the rows, call the resolver with them, and measure the times of both."""
        begin = _now()
        hierarchy = self.plan.at(q, t)
        built, inside = _now(), nanoseconds_inside()
        resolution = self._resolved(hierarchy)
        self._nanoseconds = built - begin, _now() - built, nanoseconds_inside() - inside
        return resolution

    def _resolved(self, hierarchy: Hierarchy) -> Resolution:
        """Call the resolver with the rows of a tick."""
        returned = self.resolver(hierarchy, self._memory)
        if self._memory is None:  # on every tick the check of the form would cost half a microsecond
            require_answer(returned, self.resolver.name, hierarchy)
        resolution, self._memory = returned
        return resolution if self.rest is None else self.rest.answer(resolution)

    def _checked(self, answer: Resolution, t: float) -> Resolution:
        """Return the answer if it may be sent, else forget the last tick and apply the conflict policy."""
        if may_be_sent(answer):
            return answer
        self.forget()
        plan, when = self.plan, f"t = {t:.6g} s"
        answer = apply_conflict_policy(
            self._policy, self.resolver, plan.hierarchy, answer, plan.brakes(), when
        )
        if not may_be_sent(answer):
            raise NotSolved(f"{self.resolver.name} at {when}: {_reason(answer)}", answer)
        return answer


def _now() -> int:
    """Return the time [ns] of a clock that does not count the compilation and loading of kernels."""
    return perf_counter_ns() - nanoseconds_preparing()


def may_be_sent(resolution: Resolution) -> bool:
    """Decide if an answer may be sent to a robot.

    If the resolver claims an optimum, or stopped shortly before it, the answer must keep the hard limits: the
    largest primal residual of its certificate must not exceed the tolerance of that status. A closed form
    does not consider limits, and a conflict policy gives some of them up, so that their answers are not
    checked for limits.

    Args:
        resolution: The answer of any resolver, or of a conflict policy.

    Returns:
        True if the velocity is finite, the status allows sending it, and the hard limits hold to the
        tolerance of that status.
    """
    if not is_finite(resolution.x):
        return False
    status = resolution.status
    if status is _SOLVED:
        return resolution.broken_limit <= CLAIM_KEEPS_LIMITS
    if status is _STOPPED:
        return resolution.broken_limit <= STOPPED_KEEPS_LIMITS
    return status in _WITHOUT_OPTIMUM


def _reason(resolution: Resolution) -> str:
    """Return the reason why an answer may not be sent, with the advice of its status."""
    verdict = resolution.status.name.lower().replace("_", " ")
    if not np.isfinite(resolution.x).all() and (resolution.claimed or resolution.status in _WITHOUT_OPTIMUM):
        verdict = "not a number"
    elif resolution.claimed:
        verdict = "a velocity that breaks a hard limit"
    return f"{verdict}; {resolution.status.value}"
