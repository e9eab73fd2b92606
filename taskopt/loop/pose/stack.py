"""The stack for a single posture: goals that stand still, limits on postures, and a bound on the step.

A step of the search takes Δt = 1 s and gain 1 1/s, so that a tick asks for Newton's step, and the velocity of
a tick is a displacement. Tasks and limits of velocity and acceleration speak of motions and bind no posture.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace

import numpy as np

from taskopt.arrays import Mask
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.jit import kernel_apart
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import (
    BoundLimit,
    JointPositionLimit,
    JointVelocityLimit,
    Limit,
    ObstacleLimit,
    RateLimit,
    SelfCollisionLimit,
)
from taskopt.kinematics.limit.base import narrow_one
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Hold, Target, WithoutRate
from taskopt.kinematics.task import (
    BoundTask,
    DampedTask,
    During,
    JointVelocityTask,
    LevelDamping,
    LowAccelerationTask,
    Task,
)
from taskopt.loop.pose.clearance import STEP, ClearanceTask

TRUST_REGION = "trust region"  # name of the bound on the step
LARGEST_STEP = 1.0  # [rad, m] of one joint in one step


@dataclass(frozen=True)
class PostureStack:
    """A stack as it is asked of one posture.

    Attributes:
        levels: Levels of tasks with gain 1 and targets that stand still; the first has the goals.
        clearances: Tasks that keep the distances of the stack's limits; they come before all goals.
        limits: Limits on joint positions, and limits of other classes as declared.
        norm: Norm of the stack, or None.
        moved: (nv,) True for the velocities that change what the goals ask for.
    """

    levels: tuple[tuple[Task, ...], ...]
    clearances: tuple[Task, ...]
    limits: tuple[Limit, ...]
    norm: object
    moved: Mask

    def compiled(self, *, below: bool = True, with_limits: bool = True, last: Task | None = None) -> Stack:
        """Return the stack that the search resolves at each of its ticks.

        Args:
            below: False leaves out the levels below the goals.
            with_limits: False leaves out clearances and limits.
            last: Task of a level below all others, or None.

        Returns:
            The stack, with the trust region among its limits.
        """
        first = [self.clearances] if self.clearances and with_limits else []
        levels = [*first, *self.levels[: None if below else 1], *([[last]] if last else [])]
        limits = [*(self.limits if with_limits else ()), TrustRegion()]
        return Stack(levels, limits, self.norm, damping=None)  # type: ignore[arg-type]


def posture_stack(stack: Stack, robot: Robot) -> PostureStack:
    """Convert a stack to the goals, clearances and limits of one posture.

    Targets are taken without their rates. A limit on distances becomes a task of its own before all goals,
    which asks for d ≥ margin at the posture itself: a step of the search may pass through an obstacle. Pairs
    of links that no joint of the goals moves are left as they are.

    Args:
        stack: The declared stack.
        robot: The robot.

    Returns:
        Levels, clearances and limits.

    Raises:
        UnknownName: The robot lacks a joint or link of a limit.
        InvalidValue: A limit does not fit the robot, or the first level has no goal.
    """
    levels = tuple(tuple(_still(task) for task in level if not _of_motion(task)) for level in stack.levels)
    if not levels[0]:
        raise InvalidValue("the first level has only tasks of velocities, which are no goals; give it a goal")
    distances = [limit for limit in stack.limits if isinstance(limit, ObstacleLimit | SelfCollisionLimit)]
    others = [limit for limit in stack.limits if limit not in distances]
    moved = columns_moved(levels[0], robot)
    clearances = tuple(ClearanceTask(limit, moved) for limit in distances)
    kept = tuple(_of_postures(others, robot))
    return PostureStack(tuple(filter(None, levels)), clearances, kept, stack.norm, moved)


def columns_moved(tasks: Sequence[Task], robot: Robot) -> Mask:
    """Find the velocities that change the errors of some tasks.

    Args:
        tasks: The tasks.
        robot: The robot.

    Returns:
        (nv,) True for a velocity with an entry in their rows at one of three generic postures.
    """
    moved = np.zeros(robot.nv, dtype=bool)
    for turn in (0.3, 0.7, 1.1):
        at = Configuration(robot, robot.integrate(robot.posture("middle"), np.full(robot.nv, turn), 1.0))
        for task in tasks:
            if not isinstance(task, LevelDamping):
                bound = task.bind(robot, task.name or task.default_name())
                m = len(bound.row_names)
                rows = LevelRows(np.zeros((m, robot.nv)), np.zeros(m), np.zeros(m), np.ones(m))
                bound.prepare(rows)
                bound.start(at, 0.0)
                bound.fill(at, 0.0, rows)
                moved |= (rows.A != 0.0).any(axis=0)
    return moved


def _of_motion(task: Task) -> bool:
    """Return True for a task that speaks of velocities alone, perhaps inside another one."""
    if isinstance(task, DampedTask | During):
        return _of_motion(task.task)
    return isinstance(task, JointVelocityTask | LowAccelerationTask)


_TARGETS = "target", "direction"  # fields of tasks that may be a `Target`


def _still(task: Task) -> Task:
    """Return a task with gain 1 and a target without rate, where it or the task inside it has them."""
    if not is_dataclass(task):
        return task
    changes: dict[str, object] = {}
    for field in fields(task):
        value = getattr(task, field.name)
        if field.name == "gain":
            changes["gain"] = 1.0
        elif field.name in _TARGETS and isinstance(value, Target) and not isinstance(value, Hold):
            changes[field.name] = WithoutRate(value)
        elif isinstance(value, Task):
            changes[field.name] = _still(value)
    return replace(task, **changes)


def _of_postures(limits: Iterable[Limit], robot: Robot) -> Iterable[Limit]:
    """Yield the limits that bind a posture, with position limits that a step may reach at once."""
    for limit in limits:
        if isinstance(limit, JointPositionLimit):
            yield replace(limit, gain=1.0)
        elif not isinstance(limit, JointVelocityLimit) and not isinstance(limit.bind(robot, STEP), RateLimit):
            yield limit


@dataclass(frozen=True)
class TrustRegion(Limit):
    """Bound every joint's step: −r ≤ v Δt ≤ r [rad, m], with a radius r that the search changes.

    Attributes:
        name: Name of its bounds.
    """

    name: str = TRUST_REGION

    def bind(self, robot: Robot, dt: float) -> "BoundTrustRegion":  # noqa: ARG002
        """Return the bounds for a robot; see `Limit.bind`."""
        return BoundTrustRegion(self.name)


class BoundTrustRegion(BoundLimit):
    """The bound on the step, whose radius is the one number in its memory.

    Args:
        name: Name of the limit.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.kernel = narrow_by_radius
        self.memory = np.full(1, LARGEST_STEP)


@kernel_apart
def narrow_by_radius(parameters, memory, state, bounds, owner):  # noqa: ARG001 (the plan hands them)
    """Narrow the bounds of a `TrustRegion`.

    Args:
        parameters: Not used.
        memory: Radius r [rad, m], (1,).
        state: Not used.
        bounds: (4, nv), see `BoundLimit.narrow`.
        owner: Number of the limit.
    """
    for j in range(bounds.shape[1]):
        narrow_one(bounds, j, -memory[0], memory[0], owner)


def framed(tasks: Sequence[BoundTask]) -> list[BoundTask]:
    """Return the tasks that have a frame with a desired pose.

    Args:
        tasks: Tasks of a plan.

    Returns:
        Those with `frame`, `desired` and `actual`.
    """
    return [task for task in tasks if task.frame and task.desired is not None and task.actual is not None]
