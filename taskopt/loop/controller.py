"""A stack inside somebody's own control loop."""

from collections.abc import Mapping

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.hierarchy.resolution import Resolution
from taskopt.kinematics.parameter import Setting
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

    @property
    def parameters(self) -> Mapping[str, Setting]:
        """Present values of all parameters by address, such as "hand.weight"; see `set`."""
        return self.plan.changes.read()

    def set(self, changes: Mapping[str, Setting], over: float = 0.0) -> None:
        """Change parameters of tasks and limits from the next step on; nothing is compiled again.

        The memory of the last step is kept, so that the next one starts warm. Changes that are set together
        are applied together. Another thread than that of the loop may call this.

            <task>.weight     one number, or one for each row; 0 takes a row out
            <task>.gain       K [1/s], likewise
            <task>.target     a value to hold, or a `Target`, which begins at the present desired value
            <task>.axes       rows in force, among those that were compiled
            <task>.enabled    False takes the task out of its level
            level <k>.enabled        the same for all tasks of the k-th level
            joint_position.margin    and whatever else `parameters` lists

        Args:
            changes: New values by address, such as {"hand.weight": 0.1, "elbow.enabled": False}.
            over: Time over which the change is blended [s]: weights by equal ratios, other numbers by equal
                steps, targets on a `Line`, rows that come and go by the band of `During`, which keeps
                velocities from jumping. 0: at once.

        Raises:
            UnknownName: There is no parameter of that address.
            InvalidValue: A parameter does not take its value, or not over a time. Nothing is changed then.
        """
        self.plan.set(changes, over)

    def step(self, q: Array, t: float, v: Array | None = None, dt: float | None = None) -> Resolution:
        """Resolve the stack at one posture and time.

        Args:
            q: Posture of the robot, (nq,) [rad, m].
            t: Time [s].
            v: Velocity that the robot has, (nv,) [rad/s, m/s], where it is not the one commanded last.
                Limits on acceleration start from it.
            dt: Time until the next step [s], for this step and those after it; None: as before.

        Returns:
            The resolution; `resolution.v`, (nv,) [rad/s, m/s], is the velocity to command.

        Raises:
            InvalidValue: q or v has the wrong size, or it or a target is not finite; or dt ≤ 0, or it is too
                large for a gain.
            Infeasible: Hard limits contradict each other, and `on_conflict` is "raise".
            NotSolved: There is no answer that may be sent to a robot. The next step starts without memory.
        """
        if q.__class__ is not np.ndarray:
            q = self._robot.checked_q(q)
        if dt is not None and dt != self.plan.dt:
            self.plan.retime(dt)
        if v is not None:
            self.plan.moved(finite("v", v, (self._robot.nv,)))
        return self._tick(q, t)
