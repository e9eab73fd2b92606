"""A stack inside somebody's own control loop."""

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array
from taskopt.problem.resolution import Resolution, Status
from taskopt.resolver.base import Resolver
from taskopt.resolver.registry import resolver as resolver_named
from taskopt.robot import Robot
from taskopt.run import not_solved, usable
from taskopt.stack import Stack


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
        self._memory = None

    def start(self, q: ArrayLike, t: float = 0.0) -> None:
        """Anchor the references that begin at the posture, and forget the last tick.

        The first `step` does so by itself. Everything is compiled here, if it was not before.
        """
        q = self._robot.checked_q(q)
        self.plan.start(q, t)
        self.resolver(self.plan.at(q, t), None)
        self._memory = None

    def step(self, q: Array, t: float) -> Resolution:
        """The resolution at q (nq,) and t [s]; `resolution.v` is the velocity to command.

        Raises `InvalidValue` for a q of another size or with NaN, and `NotSolved` where there is no
        answer that may be sent to a robot.
        """
        if q.__class__ is not np.ndarray:
            q = self._robot.checked_q(q)
        resolution, self._memory = self.resolver(self.plan.at(q, t), self._memory)
        if resolution.status is not Status.SOLVED and not usable(resolution):
            self._memory = None
            raise not_solved(self.resolver.name, resolution, f"t = {t:.6g} s")
        return resolution
