"""A stack inside somebody's own control loop."""

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, finite
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.jit import kernel_apart
from taskopt.kinematics.plan import fill_tick
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Stack
from taskopt.loop.run import not_solved, usable
from taskopt.resolver.active_set.resolver import ActiveSet, new_history, packed, resolve_kernel
from taskopt.resolver.base import Memory, Resolver
from taskopt.resolver.fallback import ActiveSetWithFallback, conclude
from taskopt.resolver.infeasible import ConflictPolicy, apply_conflict_policy, checked_policy
from taskopt.resolver.registry import resolver as resolver_named
from taskopt.resolver.tick_review import TickReview


class Controller:
    """Resolves a stack at the q and t that it is given, tick by tick.

    `dt` [s] is the time until the next step. `on_conflict` as in `Scenario`. A start outside the
    limits is allowed here: the limits let a joint stop or return. A resolution stays true when later
    steps are taken.
    """

    def __init__(
        self,
        robot: Robot,
        stack: Stack,
        resolver: str | Resolver = "active-set",
        dt: float = 1e-3,
        on_conflict: ConflictPolicy = "raise",
    ) -> None:
        self._policy: ConflictPolicy = checked_policy(on_conflict)
        self.plan = stack.compile(robot, dt)
        self.resolver = resolver_named(resolver) if isinstance(resolver, str) else resolver
        self._robot, self._tells = robot, bool(self.plan.rate_limits)
        self._resolve = self._in_two
        layout, norm = self.plan.layout, self.plan.hierarchy.norm
        self._history, self._sizes = new_history(layout), (layout.width, layout.answer_size)
        guarded = isinstance(self.resolver, ActiveSetWithFallback)
        search = self.resolver.search if isinstance(self.resolver, ActiveSetWithFallback) else self.resolver
        self._conclude = conclude if guarded else lambda resolution: resolution
        if isinstance(search, ActiveSet) and self.plan.in_one_call and norm.ndim == 1:
            self._resolve = self._in_one_call
            settings = search.shortcut, search.iterations
            self._arguments = *self.plan.tick, norm, *settings, self._history
        self._forget()

    def start(self, q: ArrayLike, t: float = 0.0) -> None:
        """Anchor the references that begin at the posture, and forget the last tick.

        The first `step` does so by itself. Everything is compiled here, if it was not before.
        """
        q = self._robot.checked_q(q)
        self.plan.start(q, t)
        self._forget()
        self._resolve(q, t)
        self._forget()

    def step(self, q: Array, t: float, v: Array | None = None) -> Resolution:
        """The resolution at q (nq,) and t [s]; `resolution.v` is the velocity to command.

        `v` (nv,): the velocity that the robot has, where it is not the one commanded last. Raises
        `InvalidValue` for a q of another size or with NaN, `Infeasible` where hard limits contradict each
        other, if that is the policy, and `NotSolved` where there is no answer that may be sent to a robot.
        """
        if q.__class__ is not np.ndarray:
            q = self._robot.checked_q(q)
        if v is not None:
            self.plan.moved(finite("v", v, (self._robot.nv,)))
        resolution = self._resolve(q, t)
        if resolution.status is not Status.SOLVED:
            resolution = self._without_optimum(resolution, f"t = {t:.6g} s")
        if self._tells:
            self.plan.moved(resolution.x)
        return resolution

    def _without_optimum(self, resolution: Resolution, when: str) -> Resolution:
        """What is sent all the same, or an error; the next tick begins without memory."""
        if usable(resolution):
            return resolution
        self._forget()
        plan = self.plan
        resolution = apply_conflict_policy(
            self._policy, self.resolver, plan.hierarchy, resolution, plan.brakes(), when
        )
        if not usable(resolution):
            raise not_solved(self.resolver.name, resolution, when)
        return resolution

    def _forget(self) -> None:
        """Begin the next tick from nothing."""
        self._memory: Memory | None = None
        self._history[:] = 0

    def _in_two(self, q: Array, t: float) -> Resolution:
        """Rows first, then any resolver."""
        resolution, self._memory = self.resolver(self.plan.at(q, t), self._memory)
        return resolution if usable(resolution) else self._without_optimum(resolution, f"t = {t:.6g} s")

    def _in_one_call(self, q: Array, t: float) -> Resolution:
        """The same for a plan and a resolver that are both compiled: calls cost more than rows."""
        self.plan.aim(q, t)
        width, size = self._sizes
        state, answer = np.empty(width, np.int8), np.empty(size)
        code, rounds = _fill_and_resolve(*self._arguments, state, answer)
        if code == 0:
            return Resolution(self.plan.hierarchy, answer, state, Status.SOLVED, rounds, TickReview)
        if code < 0:
            self.plan.blame(t)
        return self._conclude(packed(self.plan.hierarchy, answer, state, code, rounds))


@kernel_apart
def _fill_and_resolve(
    program, numbers, q, J, placements, buffer, norm, shortcut, limit, history, state, answer
):
    """`fill_tick`, then `resolve_kernel`; code −1 where the rows are flawed."""
    if fill_tick(program, numbers, q, J, placements, buffer):
        return -1, 0
    split = 3 + program[2] + 2
    offsets, columns = program[3:split], program[split : split + program[1]]
    return resolve_kernel(buffer, norm, offsets, columns, shortcut, limit, history, state, answer)
