"""The description of a log whose ticks are those of a plan, and the parts of a tick that a plan knows."""

from collections.abc import Mapping, Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.layout import Layout
from taskopt.kinematics.geometry.shapes import facts_of
from taskopt.kinematics.plan import base_box
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.robot.tree import tree_of
from taskopt.kinematics.stack import Plan
from taskopt.kinematics.task import BoundTask
from taskopt.log.description import Description
from taskopt.log.provenance import Json, plain
from taskopt.log.raw import Tick
from taskopt.resolver.base import Memory, Resolver

_NO_POSE = np.full((4, 4), np.nan)


def description_of(
    plan: Plan, resolvers: Sequence[Resolver], damped: Layout | None, facts: Mapping[str, Json]
) -> Description:
    """Describe the ticks of a plan.

    Args:
        plan: The stack, compiled for the robot.
        resolvers: The resolvers, in the order of their numbers.
        damped: Layout of problems with damping at rest; None if there are none.
        facts: More facts for the metadata, such as the text of a scenario.

    Returns:
        The description.
    """
    robot, blocks = plan.robot, {block.name: block for block in plan.layout.blocks if block.level}
    names, units = coordinates(robot)
    errors = {}
    for task in plan.tasks:
        block = blocks[task.name]
        if task.error.size == block.stop - block.start:
            errors[task.name] = block.row_names, tuple(_integrated(unit) for unit in block.row_units)
    own: dict[str, Json] = {
        "robot": robot_facts(robot),
        "dt_s": plan.dt,
        "parameters": {name: plain(value) for name, value in plan.changes.read().items()},
        "stack": [
            {"name": t.name, "level": blocks[t.name].level, "kind": type(t).__name__, "frame": t.frame}
            for t in plan.tasks
        ],
        "limits": [{"name": limit.name, "kind": type(limit).__name__} for limit in plan.limits],
        "obstacles": {name: facts_of(shape) for name, shape in plan.obstacles.items()},
        "regions": {t.name: _region(t) for t in plan.tasks if t.box is not None or t.cone is not None},
    }
    return Description(
        layout=plan.layout,
        norm=plan.hierarchy.norm,
        resolvers=tuple(resolvers),
        damped=damped,
        coordinates=names,
        coordinate_units=units,
        errors=errors,
        poses=tuple(task.name for task in plan.tasks if task.frame is not None),
        moving=tuple(plan.moving),
        facts=own | dict(facts),
    )


def robot_facts(robot: Robot) -> dict[str, Json]:
    """List what a reader needs to know about a robot.

    Args:
        robot: The robot.

    Returns:
        Names, units and limits, with null where there is no limit.
    """

    return {
        "name": robot.name,
        "nq": robot.nq,
        "nv": robot.nv,
        "velocities": list(robot.velocity_names),
        "units": list(robot.coordinate_units),
        "position_index": robot.position_index.tolist(),
        "position_lower": _limits(robot.position_lower),
        "position_upper": _limits(robot.position_upper),
        "velocity_limit": _limits(robot.velocity_limit),
        "tree": tree_of(robot),
    }


def coordinates(robot: Robot) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Name the entries of a posture.

    Args:
        robot: The robot.

    Returns:
        Name and unit of each entry of q, (nq,): those of its joint, or "q3" without unit, as in quaternions.
    """
    names, units = [f"q{i}" for i in range(robot.nq)], [""] * robot.nq
    for k, index in enumerate(robot.position_index.tolist()):
        if index >= 0:
            names[index], units[index] = robot.velocity_names[k], robot.coordinate_units[k]
    return tuple(names), tuple(units)


class Part(NamedTuple):
    """Numbers of a tick that a plan keeps in the same memory at all ticks, and their place in a slot.

    Attributes:
        field: Name of the field of the slot.
        start: First number of the field.
        numbers: The numbers, of any shape.
        owner: Task that has them; None if nothing can put other memory in their place.
        name: Attribute of the owner by which they are found.
    """

    field: str
    start: int
    numbers: Array
    owner: BoundTask | None = None
    name: str = ""


class PlanTicks:
    """Collects what a plan knows about its present tick.

    Args:
        plan: The plan.
        description: Description that `description_of` made of a plan of the same stack.

    Attributes:
        plan: The plan.
    """

    def __init__(self, plan: Plan, description: Description) -> None:
        self.plan, self._base = plan, base_box(plan.tick)
        self._erring = [task for task in plan.tasks if task.name in description.errors]
        self._framed = [task for task in plan.tasks if task.name in description.poses]

    def tick(
        self, index: int, t: float, q: Array, v_before: Array, memory: Memory | StateArray | None
    ) -> Tick:
        """Return the present tick.

        Args:
            index: Number of the tick.
            t: Time [s].
            q: Posture, (nq,).
            v_before: Velocity before the tick, (nv,).
            memory: Memory that the resolver began with, see `Tick`.

        Returns:
            The tick, without times and without the number of the resolver.
        """
        plan, framed = self.plan, self._framed
        return Tick(
            index, t, plan.dt, q, v_before, memory, self._base,
            errors=[task.error for task in self._erring],
            desired=[_pose(task.desired) for task in framed],
            actual=[_pose(task.actual) for task in framed],
            moving=list(plan.moving.values()),
        )  # fmt: skip

    def parts(self) -> list[Part]:
        """List what `tick` collects, besides posture and velocity, by place."""
        starts = accumulate((task.error.size for task in self._erring), initial=0)
        found = [Part("base", 0, self._base)]
        for task, start in zip(self._erring, starts, strict=False):
            found.append(Part("errors", start, task.error, task, "error"))
        for i, task in enumerate(self._framed):
            found.append(Part("desired", 16 * i, _pose(task.desired), task, "desired"))
            found.append(Part("actual", 3 * i, _pose(task.actual)[:3, 3], task, "actual"))
        return [*found, *(Part("moving", 16 * i, pose) for i, pose in enumerate(self.plan.moving.values()))]


def _pose(pose: Array | None) -> Array:
    """Return a pose, or NaN where there is none."""
    return _NO_POSE if pose is None else pose


def _limits(values: Array) -> list[float | None]:
    """Return numbers, with null for what is no limit."""
    return [float(value) if np.isfinite(value) else None for value in values]


def _region(task: BoundTask) -> dict[str, Json]:
    """Describe the box and the cone of a task, which a viewer draws."""
    region: dict[str, Json] = {}
    if task.box is not None:
        region["box"] = [_limits(side) for side in task.box]
    if task.cone is not None:
        frame, axis, half_angle = task.cone
        region["cone"] = {"frame": frame, "axis": axis.tolist(), "half_angle": float(half_angle)}
    return region


def _integrated(unit: str) -> str:
    """Return the unit of an error whose rate has a unit."""
    return unit.removesuffix("/s").removesuffix("/s²")
