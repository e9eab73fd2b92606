"""The arms of a review: one for each resolver of each log."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.layout import Block, numbered
from taskopt.kinematics.geometry.shapes import Shape, shape_of
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.robot.tree import robot_of
from taskopt.kinematics.task.base import Cone
from taskopt.log.reading import Log
from taskopt.recording.batch import Nanoseconds
from taskopt.recording.derived.answers import Answers
from taskopt.recording.derived.events import Event, events
from taskopt.recording.derived.lanes import Lane, lanes
from taskopt.recording.viewer.motion import Motion

_LOOKS = 120  # closer looks at an arm, evenly spread: each takes milliseconds


@dataclass(frozen=True, eq=False)
class Arm:
    """One resolver of one log, as the viewer shows it.

    Attributes:
        name: Its name, which no other arm has.
        answers: Its ticks.
        robot: The robot.
    """

    name: str
    answers: Answers
    robot: Robot

    @cached_property
    def lanes(self) -> tuple[Lane, ...]:
        """When its limits were active or broken."""
        return lanes(self.answers)

    @cached_property
    def events(self) -> list[Event]:
        """What happened."""
        return events(self.answers, self.lanes)

    @cached_property
    def looks(self) -> IntArray:
        """The ticks of closer looks, (s,), which depend on the numbers of the ticks only."""
        every = max(1, -(-len(self.index) // _LOOKS))
        return np.flatnonzero(self.index % every == 0)

    @property
    def index(self) -> IntArray:
        """Numbers of the ticks, (k,)."""
        return self.answers.index

    @property
    def time(self) -> Nanoseconds:
        """Times of the ticks, (k,)."""
        return self.answers.time

    @property
    def q(self) -> Array:
        """Postures, (k, nq) [rad, m]."""
        return self.answers.q

    @cached_property
    def motion(self) -> Motion:
        """Postures, and poses of the obstacles that move."""
        columns = {name: self.answers.column(f"moving/{name}") for name in self.answers.log.facts["moving"]}
        moving = {name: poses.reshape(-1, 4, 4) for name, poses in columns.items()}
        return Motion(self.index, self.time, self.q, moving)

    @cached_property
    def obstacles(self) -> dict[str, Shape]:
        """The obstacles, by name."""
        return {name: shape_of(facts) for name, facts in self.answers.log.facts["obstacles"].items()}

    @cached_property
    def boxes(self) -> dict[str, Array]:
        """Lower and upper corner (2, 3) [m] of the box of each task that has one; ±inf at open sides."""
        return {
            task: np.array(
                [
                    [open_side if value is None else value for value in side]
                    for side, open_side in zip(region["box"], (-np.inf, np.inf), strict=True)
                ]
            )
            for task, region in self.answers.log.facts["regions"].items()
            if "box" in region
        }

    @cached_property
    def cones(self) -> dict[str, Cone]:
        """Frame, axis and half angle of the cone of each task that has one."""
        cones = {t: r["cone"] for t, r in self.answers.log.facts["regions"].items() if "cone" in r}
        return {t: (c["frame"], np.array(c["axis"]), c["half_angle"]) for t, c in cones.items()}

    @cached_property
    def frames(self) -> dict[str, str]:
        """Frame of each task that has poses, by the name of the task."""
        facts = self.answers.log.facts
        return {task["name"]: task["frame"] for task in facts["stack"] if task["name"] in facts["poses"]}

    @cached_property
    def placed(self) -> tuple[Block, ...]:
        """The tasks with poses that place their frame, as some of their rows are in metres."""
        return tuple(
            block
            for block in self.answers.tasks
            if block.name in self.frames and any(unit.startswith("m") for unit in block.row_units)
        )

    def desired(self, task: str) -> Array:
        """Return the desired poses of a task.

        Args:
            task: Its name.

        Returns:
            (k, 4, 4) [m]; NaN where there is none.
        """
        return self.answers.column(f"desired/{task}").reshape(-1, 4, 4)

    def actual(self, task: str) -> Array:
        """Return where the frame of a task is.

        Args:
            task: Its name.

        Returns:
            (k, 3) [m].
        """
        return self.answers.column(f"actual/{task}")


def arms_of(logs: Sequence[Log]) -> list[Arm]:
    """List the resolvers of logs.

    Args:
        logs: The logs.

    Returns:
        An arm for each resolver with ticks; equal robots are one.

    Raises:
        InvalidValue: A log cannot be drawn.
    """
    robots: dict[str, Robot] = {}
    found, names = [], []
    for log in logs:
        for resolver in log.resolvers:
            if not len(log.rows(resolver)):
                continue
            answers = Answers(log, resolver)
            tree = log.facts["robot"]["tree"]
            key = repr(tree)
            if key not in robots:
                robots[key] = robot_of(tree)
            found.append((answers, robots[key]))
            names.append(resolver if len(logs) == 1 else f"{log.path.stem} {resolver}")
    return [Arm(name, *rest) for name, rest in zip(numbered(names), found, strict=True)]
