"""Tasks and limits of a stack, bound to a robot and laid out as the rows of a hierarchy."""

from collections.abc import Sequence
from dataclasses import is_dataclass, replace
from itertools import chain
from reprlib import repr as shortened
from typing import TypeVar

from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import Block, Layout
from taskopt.kinematics.geometry.shapes import Shape, checked_obstacles, named_apart
from taskopt.kinematics.limit import BoundLimit, Limit
from taskopt.kinematics.part import RowPart, check_complete
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task import BoundTask, Task
from taskopt.kinematics.task.base import acceleration_units, rate_units
from taskopt.kinematics.task.level_damping import BoundLevelDamping

_ROWS = ("name", "row_names", "row_units", "column")
_TASK = (*_ROWS, "gain", "weight", "error")
_BOUNDS = ("name", "owners")
Kind = TypeVar("Kind", Task, Limit)


def require_robot(robot: object) -> None:
    """Check that an argument is a robot whose model is as it was when the robot was made.

    Args:
        robot: The argument.

    Raises:
        InvalidValue: It is something else, such as the name of a robot, or its model was changed since.
    """
    if not isinstance(robot, Robot):
        raise InvalidValue(
            f"robot must be a Robot, as Robot.load and Robot.from_urdf make one, got {shortened(robot)}"
        )
    robot.require_unchanged()


def declared_in(items: object, what: str, kind: type[Kind]) -> tuple[Kind, ...]:
    """Check a list of tasks, or of limits, and return it as a tuple.

    Args:
        items: The list that the user gave.
        what: Its name in messages.
        kind: `Task` or `Limit`.

    Returns:
        The items in order.

    Raises:
        InvalidValue: It is no list, or an item is of another kind, is incomplete, or has a name that is no
            text.
    """
    of = kind.__name__.lower() + "s"
    if not isinstance(items, Sequence):
        raise InvalidValue(f"{what} must be a list of {of}, got {items!r}")
    for item in items:
        if not isinstance(item, kind):
            raise InvalidValue(
                f"{what} must be a list of {of}, got {item!r} in it; own {of} derive from {kind.__name__}"
            )
        if type(item).bind is kind.bind:
            raise InvalidValue(f"{type(item).__name__} lacks bind() of {kind.__name__}")
        if not isinstance(item.name, str | None):
            raise InvalidValue(f"name of {type(item).__name__} must be text, got {shortened(item.name)}")
    return tuple(items)


def bound_task(task: Task, robot: Robot, name: str) -> BoundTask:
    """Bind a task to a robot, and check that the result is complete.

    Args:
        task: The declaration.
        robot: The robot.
        name: Name of the task in its plan.

    Returns:
        The bound task.

    Raises:
        UnknownName: The robot lacks a frame or a joint of the task.
        InvalidValue: The bound task lacks something, which the message names.
    """
    bound = task.bind(robot, name)
    check_complete(bound, BoundTask, f"'{name}'", _TASK)
    return bound


def named_obstacles(
    limits: Sequence[Limit], levels: Sequence[Sequence[Task]]
) -> tuple[list[Limit], dict[str, Shape]]:
    """Give each obstacle of a stack one name for the whole stack.

    Args:
        limits: Limits of the stack.
        levels: Tasks of the stack, by level.

    Returns:
        The limits with named obstacles, and a mapping from name to obstacle.
    """
    declared = [*limits, *chain(*levels)]
    groups = named_apart(checked_obstacles(owner.obstacles) if owner.obstacles else () for owner in declared)
    named = [
        replace(limit, obstacles=group) if group and is_dataclass(limit) else limit
        for limit, group in zip(limits, groups, strict=False)
    ]
    return named, {shape.name: shape for group in groups for shape in group}


def bound_limit(limit: Limit, robot: Robot, dt: float) -> BoundLimit | RowPart:
    """Bind a limit to a robot, and check that the result is complete.

    Args:
        limit: The declaration.
        robot: The robot.
        dt: Time [s] from one tick to the next.

    Returns:
        The bound limit.

    Raises:
        UnknownName: The robot lacks a joint or a link of the limit.
        InvalidValue: The bound limit lacks something, which the message names.
    """
    bound, what = limit.bind(robot, dt), f"'{limit.name}'"
    if isinstance(bound, RowPart) or not isinstance(bound, BoundLimit):
        check_complete(bound, RowPart, what, _ROWS)
    if isinstance(bound, BoundLimit):
        check_complete(bound, BoundLimit, what, _BOUNDS)
        if bound.kernel is None and type(bound).narrow is BoundLimit.narrow:
            raise InvalidValue(f"{type(bound).__name__} of {what} lacks narrow() or a kernel of BoundLimit")
    return bound


def damping_of(level: Sequence[BoundTask], k: int) -> list[tuple[BoundLevelDamping, int]]:
    """Find the damping of a level, and make it fit the other tasks of that level.

    Args:
        level: The tasks of the level.
        k: Number of the level, from 1.

    Returns:
        The pair of damping and k in a list, which is empty if the level has no damping.

    Raises:
        InvalidValue: The level has two dampings, or no rows that could be damped.
    """
    found = [task for task in level if isinstance(task, BoundLevelDamping)]
    others = sum(len(task.row_names) for task in level if task not in found)
    if len(found) > 1 or (found and not others):
        raise InvalidValue(
            f"'{found[0].name}' damps the other tasks of level {k}: one a level, beside at least one task"
        )
    for damping in found:
        damping.fit(others)
    return [(damping, k) for damping in found]


def set_dt(tasks: Sequence[BoundTask], dt: float) -> None:
    """Set the time between ticks of all tasks, and refuse a gain with which a task would not converge.

    Args:
        tasks: Bound tasks.
        dt: Time [s] from one tick to the next.

    Raises:
        InvalidValue: gain · dt ≥ 2 in a task.
    """
    for task in tasks:
        task.dt = dt
        task.each_gain(task.gain)


def layout_of(
    robot: Robot,
    hard: Sequence[tuple[str, RowPart]],
    levels: Sequence[Sequence[BoundTask]],
    owners: tuple[str, ...],
    order: int = 1,
) -> Layout:
    """Lay out the hierarchy of a plan.

    Args:
        robot: The robot.
        hard: Limits with rows, each with its name in the plan.
        levels: Bound tasks, by level.
        owners: Names that the bounds of single velocities may have.
        order: 1 if the unknowns are velocities, 2 if they are accelerations.

    Returns:
        Names and sizes.
    """
    blocks: list[Block] = []
    column: list[int] = []
    tasks = [(k, part.name, part) for k, level in enumerate(levels, 1) for part in level]
    for k, name, part in [*((0, name, limit) for name, limit in hard), *tasks]:
        start = len(column)
        column += part.column
        row_units = part.row_units if order == 1 else acceleration_units(part.row_units)
        names = part.row_names, row_units, part.choices
        blocks.append(Block(name, k, start, len(column), *names))
    units = rate_units(robot.coordinate_units)
    units = units if order == 1 else acceleration_units(units)
    return Layout(robot.velocity_names, tuple(blocks), len(levels), owners, tuple(column), units)
