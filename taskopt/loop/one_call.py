"""One compiled call that fills the rows of a tick and resolves them."""

from collections.abc import Callable
from functools import lru_cache
from typing import cast

import numpy as np

from taskopt.arrays import Array, IntArray, StateArray
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank_doubt import rank_in_doubt, watch_size
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.jit import kernel_apart
from taskopt.jit.borrowed import ArrayTable, borrowed, floats_in, integers_in, states_in
from taskopt.kinematics.placing import joint_tables, move_joints, place_joints
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
# Numbers of the arrays in the table of a whole tick; the last one receives the posture to which x leads.
PROGRAM, NUMBERS, POSTURE, JACOBIANS, PLACEMENTS, HISTORY, JOINTS, PLACES, NEXT = range(9)


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
        joints, self._next = _joints_of(plan), np.zeros(plan.robot.nq)
        self._places = len(joints[0]) > 1
        self._table = ArrayTable(*plan.tick, self.history, *joints, self._next)
        self._settings, self._apart = search.settings, LazyTick()
        self._rests = type(rest) is Rest  # not that of accelerations
        self._leads: Array | None = None  # the velocity that leads to `_next`
        fast, limit = (int(number) for number in search.settings)
        self._with_search = _whole_tick(plan.fill, tick, fast, limit)
        self._entry = _whole_tick(plan.fill, tick_fast, fast, limit) if fast else self._with_search

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
        plan, rest = self._plan, self._rest
        if self._places and not plan.altered and (rest is None or rest.last is None):
            plan.aim(q, t, place=False)
        else:
            plan.aim(q, t)
            if rest is not None:
                rest.look()
            if plan.altered or (self._rests and rest is not None and rest.last is not None):
                return self._in_steps(t)  # Python may have to follow the kernels of the rows
        state, answer = np.empty(self._width, np.int8), np.empty(self._size)
        code, rounds = self._entry(self._table.handle, plan.dt, state, answer)
        if code == _SOLVED and (rest is None or rest.last is None):
            resolution = Resolution(plan.hierarchy, answer, state, _CLAIMED, rounds, TickReview)
            self._leads = resolution.x if self._places else None
            return resolution
        if code == Outcome.FAST_PATH_REFUSED:  # from now on with the search, which is compiled here
            self._entry = self._with_search
            return self.answer(q, t)
        return self._concluded(code, rounds, state, answer, t)

    def _in_steps(self, t: float) -> Resolution:
        """Fill the rows, and resolve them in a second call."""
        rest, state, answer = self._rest, np.empty(self._width, np.int8), np.empty(self._size)
        problem = _problem(self._plan.filled(t))
        if rest is not None and self._rests:
            damped = rest.again(self._settings, self.history)
            if damped is not None:
                return damped
        code, rounds = self._apart(problem, self._settings, self.history, state, answer)
        return self._concluded(int(code), int(rounds), state, answer, t)

    def _concluded(self, code: int, rounds: int, state: StateArray, answer: Array, t: float) -> Resolution:
        """Return the answer of a tick that may need damping, a fallback, or an error."""
        plan, rest = self._plan, self._rest
        self._leads = None
        if code == FLAWED:
            plan.blame(t)
        if code in (_SOLVED, IN_DOUBT):
            resolution = Resolution(plan.hierarchy, answer, state, _CLAIMED, rounds, TickReview)
        else:
            resolution = resolution_of(plan.hierarchy, answer, state, code, rounds)
            resolution = resolution if resolution.claimed else self._conclude(resolution)
        return resolution if rest is None else rest.answer(resolution)

    def posture_after(self, v: Array) -> Array | None:
        """Return a copy of the posture to which the last answer leads, if kernels found it.

        Args:
            v: The velocity that the robot has.

        Returns:
            q ⊕ v Δt (nq,) [rad, m]; None if v is not the last answer itself, or Pinocchio must integrate.
        """
        return self._next.copy() if v is self._leads else None

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


def _joints_of(plan: Plan) -> tuple[IntArray, Array]:
    """Return the kinematic tree for `place_joints`; the world alone if Pinocchio must place the joints.

    It must at second order, where it computes more than the kernel does, and if Python fills rows.
    """
    parts = *plan.tasks, *plan.limits
    in_python = any(part.kernel is None and not part.constant for part in parts)
    known = None if plan.motion is not None or in_python else joint_tables(plan.robot)
    return (np.zeros((1, 4), np.int64), np.zeros((1, 15))) if known is None else known


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
def _whole_tick(fill: Fill, resolve: Entry, fast: int, limit: int) -> Entry:
    """Return the compiled tick of a plan: place the joints, fill the rows, resolve them, move the joints on.

    The function returns FLAWED if the rows are flawed, and IN_DOUBT in place of SOLVED if the tick may have
    to be damped.
    """

    @kernel_apart
    def whole_tick(table, dt, state, answer):
        """Do the whole tick with the arrays of a table."""
        program, numbers = integers_in(table, PROGRAM), floats_in(table, NUMBERS)
        q, state, answer = floats_in(table, POSTURE), borrowed(state), borrowed(answer)
        buffer, norm, offsets, columns = problem_in(program, numbers)
        n = norm.size
        joints = integers_in(table, JOINTS)
        joints = joints.reshape((joints.size // 4, 4))
        places = floats_in(table, PLACES).reshape((joints.shape[0], 15))
        placements = floats_in(table, PLACEMENTS)
        placements = placements.reshape((placements.size // 12, 12))
        jacobians = floats_in(table, JACOBIANS).reshape((n, 6)).T
        place_joints(joints, places, q, placements, jacobians)
        if fill(program, numbers, q, jacobians, placements):
            return FLAWED, 0
        history = states_in(table, HISTORY).reshape((3, state.size))
        settings = np.int64(fast), np.int64(limit)
        code, rounds = resolve(buffer, norm, offsets, columns, settings, history, state, answer)
        if code == _SOLVED:
            move_joints(joints, q, answer[:n], dt, floats_in(table, NEXT))
            watch = numbers[numbers.size - watch_size(n, columns.size) :]
            base = numbers[program[Header.BOX] : program[Header.BOX] + 2 * n]
            if watch[0] > 0.0 and rank_in_doubt(
                buffer, norm, offsets, columns, answer[:n], state, base, watch
            ):
                return IN_DOUBT, rounds
        return code, rounds

    return cast("Entry", whole_tick)
