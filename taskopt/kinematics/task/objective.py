"""A task of one row: an objective is to stay above a value."""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective import Objective
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.rows import gains, task_rate, weights


@dataclass(frozen=True, eq=False)
class ObjectiveTask:
    """Keep w(q) ≥ w_min: ∇w·v ≥ K (w_min − w), one inequality row.

    Above the task of the hand it inverts the order of priority, as footnote 7 of Sect. 3.5.1 advises
    where an obstacle stands in the path: w is then the distance (3.58). Unlike `GradientTask` it leaves
    nv − 1 directions to the levels below, and all of them while w approaches w_min more slowly than K
    allows. Below w_min the row asks for the way back. `gain` K [1/s]: more lets w come down faster and
    brakes later. `at_least` is w_min, in the unit of w.
    """

    objective: Objective
    at_least: float = field(kw_only=True)
    gain: float = field(default=10.0, kw_only=True)
    weight: float = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if not (hasattr(self.objective, "gradient") and hasattr(self.objective, "value")):
            raise InvalidValue(f"objective must have value(at) and gradient(at), got {self.objective!r}")
        finite("at_least", self.at_least, ())
        gains(self.gain, 1)
        weights(self.weight, 1)

    def default_name(self) -> str:
        return "objective"

    def bind(self, robot: Robot, name: str) -> "BoundObjective":  # noqa: ARG002 (protocol)
        return BoundObjective(name, self)


class BoundObjective:
    """The row; `error` is what w lacks, 0 where it lacks nothing."""

    frame = desired = actual = None
    constant = False
    row_names: tuple[str, ...] = ("at least",)
    row_units: tuple[str, ...] = ("1/s",)
    column: tuple[int, ...] = (-1,)

    def __init__(self, name: str, declared: ObjectiveTask) -> None:
        self.name = name
        self.weight, self.gain = weights(declared.weight, 1), gains(declared.gain, 1)
        self.error: Array = np.zeros(1)
        self._objective, self._least = declared.objective, float(declared.at_least)

    def prepare(self, rows: LevelRows) -> None:
        rows.upper[:] = np.inf

    def start(self, at: Configuration, t: float) -> None:  # noqa: ARG002 (protocol)
        finite("gradient of the objective", self._objective.gradient(at), (at.robot.nv,))

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002 (protocol)
        lack = self._least - self._objective.value(at)
        rows.A[0] = self._objective.gradient(at)
        rows.lower[:] = task_rate(0.0, self.gain, lack)
        self.error[:] = max(lack, 0.0)
