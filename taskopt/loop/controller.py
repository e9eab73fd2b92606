"""`Controller`, which resolves a stack inside a user's own control loop."""

from collections.abc import Callable, Mapping
from copy import deepcopy
from pathlib import Path
from reprlib import repr as shortened

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.resolution import Resolution
from taskopt.kinematics.parameter import Setting
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Plan, Stack
from taskopt.log.raw import RawLog
from taskopt.loop.continuity import Continuity
from taskopt.loop.logged import LoggedLoop, described
from taskopt.loop.loop import Loop
from taskopt.resolver.base import Resolver
from taskopt.resolver.infeasible import ConflictPolicy, checked_policy
from taskopt.resolver.registry import as_resolver


class Controller:
    """Resolve a stack tick by tick, at the postures and times that your control loop passes to it.

    Unlike in a `Scenario`, the robot may start outside its limits; they then let a joint stop or return. A
    returned resolution does not change when later steps are taken. A copy or a pickle continues where the
    original is, with a memory of its own; a `Latest` target is copied, too. A loop in which a change is being
    blended, or in which a moving target began, refuses to be copied.

    Args:
        robot: The robot.
        stack: The tasks and limits.
        resolver: A resolver, or the name of one (`taskopt list` shows them).
        dt: Time until the next step [s].
        on_conflict: What to do at a tick whose hard limits contradict each other: "raise" `Infeasible`,
            "relax" them by the least that lets them agree, or "brake" to standstill.
        watch: Whether `continuity` is kept. It costs tens of microseconds at a step whose velocities change
            much, and five at the others.
        log: File to which all steps are logged, see `open_log`; one that exists is replaced. The step copies
            numbers, and another process writes them. The log is closed by `log.close()`, or when the
            program ends. Copies and pickles of a controller have no log.

    Attributes:
        plan: The stack compiled for the robot; its tasks hold the errors and poses of the last step.
        resolver: The resolver.
        continuity: How smooth the steps were: jumps with their causes, alternating limits; None unless
            `watch` is True.
        log: The log that is being written; None if there is none.

    Raises:
        UnknownName: There is no resolver, frame, joint or policy of that name.
        InvalidValue: dt ≤ 0, a size does not fit the robot, a gain is too large for dt, or robot or stack
            is none.
    """

    def __init__(
        self,
        robot: Robot,
        stack: Stack,
        resolver: str | Resolver = "active-set",
        dt: float = 1e-3,
        on_conflict: ConflictPolicy = "raise",
        *,
        watch: bool = False,
        log: str | Path | None = None,
    ) -> None:
        if not isinstance(stack, Stack):
            raise InvalidValue(
                f"stack must be a Stack, such as Stack([[task], [task]], [limit]), got {shortened(stack)}"
            )
        self._follow(stack.compile(robot, dt), as_resolver(resolver), checked_policy(on_conflict))
        self.continuity = Continuity(self.plan) if watch else None
        if log is not None:
            description = described(self._loop, on_conflict=self._policy)
            self.log = RawLog(log, description)
            self._tick = LoggedLoop(self._loop, self.log, description).tick

    def _follow(self, plan: Plan, resolver: Resolver, policy: ConflictPolicy) -> None:
        """Make the loop."""
        self.plan, self.resolver, self._policy = plan, resolver, policy
        self._robot = plan.robot
        self._loop = Loop(plan, resolver, policy)
        self._tick = self._loop.tick
        self.log: RawLog | None = None

    def __reduce__(self) -> tuple[Callable[..., "Controller"], tuple[object, ...]]:
        watch = self.continuity is not None
        return _copied, (self.plan, self.resolver, self._policy, self._loop.recall(), watch)

    def __copy__(self) -> "Controller":
        return deepcopy(self)

    def __repr__(self) -> str:
        parameters = self.plan.changes.parameters
        levels: dict[str, list[str]] = {"limits": [limit.name for limit in self.plan.limits]}
        for block in self.plan.layout.blocks:
            if block.level:
                enabled = parameters.get(f"{block.name}.enabled")
                off = " (off)" if enabled is not None and not enabled.read() else ""
                levels.setdefault(f"level {block.level}", []).append(block.name + off)
        parts = "; ".join(f"{level}: {', '.join(names) or 'none'}" for level, names in levels.items())
        return f"<Controller of {self._robot.name}, {self.resolver.name}, dt {self.plan.dt:g} s; {parts}>"

    def start(self, q: ArrayLike, t: float = 0.0) -> None:
        """Start all targets from a posture, with the robot at rest, forget the last step, compile everything.

        Calling this is optional: the first `step` starts the targets, too.

        Args:
            q: Posture of the start, (nq,) [rad, m].
            t: Time of the start [s].

        Raises:
            InvalidValue: q has the wrong size, or it or a target is not finite.
        """
        self._loop.start(q, t)

    def after(self) -> tuple[Array, Array]:
        """Return posture and velocity at the next tick, if the robot follows the answer of the last step.

        A stack of order 2 is integrated in this way: v⁺ = v + q̈ Δt, and q⁺ = q ⊕ (v Δt + ½ q̈ Δt²).

        Returns:
            q⁺ (nq,) [rad, m] and v⁺ (nv,) [rad/s, m/s]; at order 1 q⁺ = q ⊕ v Δt (3.48), and v⁺ = v.
        """
        return self._loop.next_posture(), self.plan.velocity.copy()

    @property
    def damped_ticks(self) -> int:
        """Number of steps that were damped, see `RestDamping`; `resolution.undamped` says it for one step."""
        return 0 if self._loop.rest is None else self._loop.rest.ticks

    @property
    def parameters(self) -> Mapping[str, Setting]:
        """Present values of all parameters by address, such as "hand.weight"; see `set`.

        A target is that of the last step; before `start` and the first step it is not known yet, and zero.
        """
        return self.plan.changes.read()

    def set(self, changes: Mapping[str, Setting], over: float = 0.0) -> None:
        """Change parameters of tasks and limits from the next step on; nothing is compiled again.

        The memory of the last step is kept, so that the next step has a warm start. Changes that are set
        together are applied together. Any thread may call this method.

            <task>.weight     one number, or one for each row; 0 takes a row out
            <task>.gain       K [1/s], likewise
            <task>.target     a value to hold, or a `Target`, which begins at the present desired value
            <task>.axes       rows in force, among those that were compiled
            <task>.enabled    False takes the task out of its level
            level <k>.enabled        the same for all tasks of the k-th level
            obstacle.<name>.pose     pose of an obstacle that the limit names in `moving`, likewise a `Target`
            obstacle.margin          of all pairs, or by names as in `ObstacleLimit(margins=…)`
            joint_position.margin    and whatever else `parameters` lists

        Args:
            changes: New values by address, such as {"hand.weight": 0.1, "elbow.enabled": False}.
            over: Time over which the change is blended [s]; 0 for at once. Weights change by equal ratios,
                other numbers by equal steps, and targets along a `Line`. Rows are switched on and off as in
                `During`, so that velocities do not jump.

        Raises:
            UnknownName: There is no parameter of that address.
            InvalidValue: A parameter does not accept its value, or cannot be blended. Nothing is changed
                then.
        """
        self.plan.set(changes, over)

    def step(self, q: Array, t: float, v: Array | None = None, dt: float | None = None) -> Resolution:
        """Resolve the stack at one posture and time.

        Args:
            q: Posture of the robot, (nq,) [rad, m].
            t: Time [s].
            v: Actual velocity of the robot, (nv,) [rad/s, m/s], from which limits on acceleration start, and
                at order 2 the motion itself. None: the velocity commanded last; see `after`.
            dt: Time until the next step [s], for this and all later steps; None: as before.

        Returns:
            The resolution; `resolution.v`, (nv,) [rad/s, m/s], is the velocity to command. At order 2 it is
            `resolution.a`, (nv,) [rad/s², m/s²], the acceleration to command.

        Raises:
            InvalidValue: q or v has the wrong size; q, v, t or a target is not finite; q is a mapping;
                dt ≤ 0; or dt is too large for a gain.
            Infeasible: Hard limits contradict each other, and `on_conflict` is "raise".
            NotSolved: There is no answer that may be sent to a robot. The next step then starts without
                memory.
            LogFailed: The log cannot be written any more, as on a full disk. The error has the resolution,
                and later steps are not logged.
        """
        if q.__class__ is not np.ndarray:
            if isinstance(q, Mapping):  # joints that it leaves out would be where nobody put them
                raise InvalidValue("q of a step must be an array; `robot.posture({joint: number})` makes one")
            q = self._robot.checked_q(q)
        if not isinstance(t, float | int) or t - t != 0.0:
            t = float(finite("t", t, ()))
        if dt is not None and dt != self.plan.dt:
            self.plan.retime(dt)
        if v is not None:
            self.plan.moved(finite("v", v, (self._robot.nv,)))
        resolution = self._tick(q, t)
        if self.continuity is not None:
            self.continuity.add(t, resolution)
        return resolution


def _copied(
    plan: Plan, resolver: Resolver, policy: ConflictPolicy, memory: object, watch: bool
) -> Controller:
    """Make a controller that continues with a plan and a memory; what it has watched begins anew."""
    control = Controller.__new__(Controller)
    control._follow(plan, resolver, policy)
    control.continuity = Continuity(plan) if watch else None
    control._loop.remember(memory)
    return control
