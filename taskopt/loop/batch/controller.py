"""`BatchController`, which resolves one stack for many arms at once."""

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from reprlib import repr as shortened
from typing import cast

import numpy as np

from taskopt.arrays import Array, ArrayLike, StateArray, finite
from taskopt.errors import InvalidValue, NotSolved
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.jit.pack import PACK
from taskopt.kinematics.lockstep.tables import Reader
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.second_order import require_first_order
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.task.aimed import AimedTask
from taskopt.loop.batch.lockstep import Arms, new_memory, resolve_arms
from taskopt.loop.batch.step import BatchStep
from taskopt.loop.batch.targets import BatchTargets
from taskopt.loop.loop import Loop
from taskopt.resolver.registry import as_resolver


class BatchController:
    """Resolve one stack for many arms at once: NumPy arrays in, NumPy arrays out.

    Kinematics, rows, closed form with the bounds of the box, and a bound on the error of every velocity are
    computed for eight arms at a time, in lock-step. An arm whose answer is not proven there, such as one at a
    singularity, is resolved by a tick of `active-set`, as `Controller` does it. Velocities are those of
    `Controller` up to rounding.

    It takes robots with revolute and prismatic joints; the tasks FrameTask, PositionTask, OrientationTask,
    JointTask and DampingTask in any levels, with targets that stand still or are set; JointPositionLimit and
    JointVelocityLimit; RestDamping. Whatever else a stack has is refused by name.

    Args:
        robot: The robot, of which every arm is one.
        stack: The tasks and limits.
        dt: Time until the next step [s].
        threads: Number of threads; None for one for each core. More than one saves time from some thousand
            arms on.

    Raises:
        InvalidValue: The stack, or the robot, has a part that a batch does not know, or a number is out of
            its range.
        UnknownName: The robot lacks a frame or a joint of the stack.
    """

    def __init__(self, robot: Robot, stack: Stack, dt: float = 1e-3, *, threads: int | None = 1) -> None:
        if not isinstance(stack, Stack):
            raise InvalidValue(
                f"stack must be a Stack, such as Stack([[task], [task]], [limit]), got {shortened(stack)}"
            )
        if threads is not None and (not isinstance(threads, int) or threads < 1):
            raise InvalidValue(f"threads must be a number from 1 on, or None for all cores, got {threads!r}")
        require_first_order(stack.order, "BatchController")
        self.plan = stack.compile(robot, dt)
        reader = Reader(self.plan)
        self._robot = robot
        self._targets = BatchTargets(reader, robot)
        self._tables = reader.tables()
        self._loop = Loop(self.plan, as_resolver("active-set"), "raise")
        self._memory = [new_memory(self._tables) for _ in range(threads or os.cpu_count() or 1)]
        self._state: StateArray | None = None
        self._kept: dict[int, object] = {}  # memory of arms that took a tick of their own at the last step
        self._damped: set[int] = set()  # arms whose last step was damped

    def start(self, q: ArrayLike) -> None:
        """Start all targets from the postures of the arms, and forget the last step.

        Calling this is optional: the first `step` starts the targets, too. The number of arms may be another
        one than before.

        Args:
            q: Postures, (N, nq) [rad, m].

        Raises:
            InvalidValue: q has the wrong shape or is not finite.
        """
        postures = self._postures(q, None)
        self._targets.start(postures)
        self._state = np.zeros((len(postures), self._robot.nv), np.int8)
        self._kept, self._damped = {}, set()
        self._loop.start(postures[0], 0.0)
        for task in self.plan.tasks:
            if isinstance(task, AimedTask):
                task.redirect(task.goal.copy(), 0.0)

    def set(self, targets: Mapping[str, ArrayLike]) -> None:
        """Give each arm a target of its own, from the next step on.

        Args:
            targets: By address "<task>.target". For a task of a frame: poses (N, 4, 4), or positions (N, 3)
                [m], with which the rotation stays that of the start. For a joint task: postures (N, nq), or
                one number for each of its joints (N, k) [rad, m].

        Raises:
            UnknownName: There is no such task.
            InvalidValue: `start` was not called yet, or a value does not fit; nothing is changed then.
        """
        if self._state is None:
            raise InvalidValue(
                "set() needs to know the number of arms; call start(q) with their postures first"
            )
        self._targets.set(targets)

    def step(self, q: ArrayLike) -> BatchStep:
        """Resolve the stack for all arms.

        Args:
            q: Postures, (N, nq) [rad, m].

        Returns:
            Velocities, bounds on their errors, active bounds, and the status of each arm.

        Raises:
            InvalidValue: q has the wrong shape or is not finite, or a target does not fit.
        """
        if self._state is None:
            self.start(q)
        assert self._state is not None
        postures = self._postures(q, len(self._state))
        self._targets.follow()
        count, nv = self._state.shape
        targets = self._targets.goals, self._targets.joint_goals
        v, bound = np.empty((count, nv)), np.empty((count, nv))
        proven, doubt = np.empty(count, np.bool_), np.zeros(count, np.bool_)
        order = np.argsort(np.count_nonzero(self._state, axis=1), kind="stable")
        self._in_lockstep(Arms(order, postures, *targets, self._state, v, bound, proven, doubt))
        status = np.full(count, Status.SOLVED, dtype=object)
        resolutions = {}
        kept, self._kept = self._kept, {}
        proven[doubt] = False
        proven[list(self._damped)] = False  # single undamped ticks would throw an arm that rests
        self._damped = set()
        for arm in np.flatnonzero(~proven).tolist():
            try:
                resolution = self._in_own_tick(arm, postures[arm], kept.get(arm))
                v[arm] = resolution.v
            except NotSolved as error:
                resolution = cast("Resolution", error.resolution)
                v[arm] = np.nan
            resolutions[arm], status[arm], bound[arm] = resolution, resolution.status, np.inf
            self._state[arm] = resolution.state[:nv]
        return BatchStep(v, bound, self._state.copy(), proven, status, resolutions)

    def integrate(self, q: ArrayLike, v: Array) -> Array:
        """Return the postures after one step with given velocities, q + v Δt.

        Args:
            q: Postures, (N, nq) [rad, m].
            v: Velocities, (N, nv) [rad/s, m/s].

        Returns:
            The postures (N, nq), a new array.

        Raises:
            InvalidValue: q has the wrong shape or is not finite.
        """
        after = finite("q", q, (None, self._robot.nq))
        after[:, self._tables.chain.position] += self.plan.dt * v
        return after

    def _postures(self, q: ArrayLike, count: int | None) -> Array:
        """Return checked postures of all arms."""
        postures = finite("q", q, (count, self._robot.nq))
        if not len(postures):
            raise InvalidValue("q must have the posture of one arm at least, got none")
        return postures

    def _in_lockstep(self, arms: Arms) -> None:
        """Resolve all arms in lock-step, each thread a part of them."""
        count = len(arms.v)
        share = -(-count // (PACK * len(self._memory))) * PACK
        parts = [
            (first, min(first + share, count), memory)
            for first, memory in zip(range(0, count, share), self._memory, strict=False)
        ]
        if len(parts) == 1:
            resolve_arms(self._tables, arms, *parts[0])
            return
        with ThreadPoolExecutor(len(parts)) as pool:
            for done in [pool.submit(resolve_arms, self._tables, arms, *part) for part in parts]:
                done.result()

    def _in_own_tick(self, arm: int, q: Array, kept: object) -> Resolution:
        """Resolve one arm as `Controller` does, from the memory of its last such tick.

        Raises `NotSolved` if there is no answer that may be sent.
        """
        self._targets.give(arm)
        self._loop.forget()
        if kept is not None:
            self._loop.remember(kept)
        resolution = self._loop.tick(q, 0.0)
        self._kept[arm] = self._loop.recall()
        if resolution.is_damped:
            self._damped.add(arm)
        return resolution
