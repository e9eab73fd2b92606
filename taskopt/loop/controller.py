"""A stack inside somebody's own control loop."""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.hierarchy.resolution import Resolution
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Stack
from taskopt.loop.loop import Loop
from taskopt.resolver.base import Resolver
from taskopt.resolver.infeasible import ConflictPolicy, checked_policy
from taskopt.resolver.registry import as_resolver


class Controller:
    """Resolve a stack tick by tick, at the postures and times that a control loop hands over.

    A start outside the limits is allowed, unlike in a `Scenario`: the limits let a joint stop or return.
    A resolution stays true when later steps are taken.

    Args:
        robot: The robot.
        stack: What it is to do.
        resolver: A resolver, or the name of one (`taskopt list` shows them).
        dt: Time until the next step [s].
        on_conflict: What to do at a tick whose hard limits contradict each other: "raise" `Infeasible`,
            "relax" them by the least that lets them agree, or "brake" to standstill.

    Attributes:
        plan: The stack, compiled for the robot; its tasks have the errors and poses of the last step.
        resolver: The resolver.

    Raises:
        UnknownName: There is no resolver, frame, joint or policy of that name.
        InvalidValue: dt ≤ 0, a size does not fit the robot, or a gain is too large for dt.
    """

    def __init__(
        self,
        robot: Robot,
        stack: Stack,
        resolver: str | Resolver = "active-set",
        dt: float = 1e-3,
        on_conflict: ConflictPolicy = "raise",
    ) -> None:
        policy = checked_policy(on_conflict)
        self.plan = stack.compile(robot, dt)
        self.resolver = as_resolver(resolver)
        self._robot = robot
        self._loop = Loop(self.plan, self.resolver, policy)
        self._tick = self._loop.tick

    def start(self, q: ArrayLike, t: float = 0.0) -> None:
        """Anchor the targets that begin at the posture, forget the last step, and compile everything.

        The first `step` anchors the targets by itself.

        Args:
            q: Posture of the start, (nq,) [rad, m].
            t: Time of the start [s].

        Raises:
            InvalidValue: q has the wrong size, or it or a target is not finite.
        """
        self._loop.start(q, t)

    def step(self, q: Array, t: float, v: Array | None = None) -> Resolution:
        """Resolve the stack at one posture and time.

        Args:
            q: Posture of the robot, (nq,) [rad, m].
            t: Time [s].
            v: Velocity that the robot has, (nv,) [rad/s, m/s], where it is not the one commanded last.
                Limits on acceleration start from it.

        Returns:
            The resolution; `resolution.v`, (nv,) [rad/s, m/s], is the velocity to command.

        Raises:
            InvalidValue: q or v has the wrong size, or it or a target is not finite.
            Infeasible: Hard limits contradict each other, and `on_conflict` is "raise".
            NotSolved: There is no answer that may be sent to a robot. The next step starts without memory.
        """
        if q.__class__ is not np.ndarray:
            q = self._robot.checked_q(q)
        if v is not None:
            self.plan.moved(finite("v", v, (self._robot.nv,)))
        return self._tick(q, t)
