"""A stack inside somebody's own control loop."""

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array
from taskopt.jit import kernel
from taskopt.problem.resolution import Resolution, Status
from taskopt.resolver.active_set import STATUS, ActiveSet, resolve_kernel
from taskopt.resolver.base import Memory, Resolver
from taskopt.resolver.registry import resolver as resolver_named
from taskopt.robot import Robot
from taskopt.run import not_solved, usable
from taskopt.stack import Stack
from taskopt.tick import fill_tick


class Controller:
    """Resolves a stack at the q and t that it is given, tick by tick.

    `dt` [s] is the time until the next step. A start outside the limits is allowed here: the limits
    let a joint stop or return. A resolution stays true when later steps are taken.
    """

    def __init__(
        self, robot: Robot, stack: Stack, resolver: str | Resolver = "active-set", dt: float = 1e-3
    ) -> None:
        self.plan = stack.compile(robot, dt)
        self.resolver = resolver_named(resolver) if isinstance(resolver, str) else resolver
        self._robot = robot
        self._memory: Memory | None = None
        one_call = isinstance(self.resolver, ActiveSet) and self.plan.in_one_call
        self._resolve = self._in_one_call if one_call and self.plan.hierarchy.norm.ndim == 1 else self._in_two

    def start(self, q: ArrayLike, t: float = 0.0) -> None:
        """Anchor the references that begin at the posture, and forget the last tick.

        The first `step` does so by itself. Everything is compiled here, if it was not before.
        """
        q = self._robot.checked_q(q)
        self.plan.start(q, t)
        self._memory = None
        self._resolve(q, t)
        self._memory = None

    def step(self, q: Array, t: float) -> Resolution:
        """The resolution at q (nq,) and t [s]; `resolution.v` is the velocity to command.

        Raises `InvalidValue` for a q of another size or with NaN, and `NotSolved` where there is no
        answer that may be sent to a robot.
        """
        if q.__class__ is not np.ndarray:
            q = self._robot.checked_q(q)
        resolution = self._resolve(q, t)
        if resolution.status is not Status.SOLVED and not usable(resolution):
            self._memory = None
            raise not_solved(self.resolver.name, resolution, f"t = {t:.6g} s")
        return resolution

    def _in_two(self, q: Array, t: float) -> Resolution:
        """Rows first, then any resolver."""
        resolution, self._memory = self.resolver(self.plan.at(q, t), self._memory)
        return resolution

    def _in_one_call(self, q: Array, t: float) -> Resolution:
        """The same for a plan and a resolver that are both compiled: calls cost more than rows."""
        plan, hierarchy, resolver = self.plan, self.plan.hierarchy, self.resolver
        plan.aim(q, t)
        layout = hierarchy.layout
        state = np.zeros(layout.width, np.int8) if self._memory is None else self._memory.state.copy()
        answer = np.empty(layout.answer_size)
        code, rounds = _fill_and_resolve(
            *plan.tick, hierarchy.norm, layout.offsets, layout.columns, resolver.shortcut, resolver.iterations,
            state, answer,
        )  # fmt: skip
        if code < 0:
            plan.blame(t)
        self._memory = Memory(state)
        return Resolution(hierarchy, answer, state, STATUS[code], rounds)


@kernel
def _fill_and_resolve(
    program, numbers, tables, q, J, placements, buffer, norm, offsets, columns, shortcut, limit, state, answer
):
    """`fill_tick`, then `resolve_kernel`; code −1 where the rows are flawed."""
    if fill_tick(program, numbers, tables, q, J, placements, buffer):
        return -1, 0
    return resolve_kernel(buffer, norm, offsets, columns, shortcut, limit, state, answer)
