"""Tasks that climb an objective w(q), or keep it above a value."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Shape
from taskopt.kinematics.objective import Objective
from taskopt.kinematics.parameter import Numbers, Parameter
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import BoundTask, Task, gains, rate_units, task_rate, weights
from taskopt.kinematics.task.damping import BoundVelocity


@dataclass(frozen=True, eq=False)
class GradientTask(Task):
    """Climb an objective w(q): v = k₀ ∇w(q), one row for each velocity [rad/s, m/s].

    On the level below a task with the rows J q̇ = ẋ it gives q̇ = J†ẋ + (I − J†J) q̇₀ with q̇₀ = k₀ ∇w, as in
    the chapter. The error is the gradient, which is zero where w is largest.

    Args:
        objective: w(q), larger being better.
        gain: k₀, in the unit of v divided by that of ∇w. More climbs faster, and lets an Euler step overshoot
            the top sooner; a negative number descends.
        weight: Factor of ½ (v − k₀ ∇w)² within the level, one number or one for each velocity. More lets this
            task win over others of the same level.
        name: Name in logs and plots. Default: "gradient".

    Raises:
        InvalidValue: `objective` is no `Objective`, or a number is out of its range.

    Source:
        Equations (3.54) and (3.55).
    """

    objective: Objective
    gain: float = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        _check_objective(self.objective)
        if np.ndim(self.gain) != 0 or not np.isfinite(self.gain):
            raise InvalidValue(f"gain must be one finite number, got {self.gain!r}")

    @property
    def obstacles(self) -> Sequence[Shape]:
        """Shapes that the objective depends on, which a viewer draws."""
        return self.objective.obstacles

    def bind(self, robot: Robot, name: str) -> "BoundGradient":
        """Return the rows for a robot; see `Task.bind`."""
        return BoundGradient(robot, name, self)


class BoundGradient(BoundVelocity):
    """Rows v = k₀ ∇w.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        task: The declared task.
    """

    constant = False

    def __init__(self, robot: Robot, name: str, task: GradientTask) -> None:
        super().__init__(robot, name, task.weight)
        self._objective, self._k0 = task.objective, np.full(self.weight.size, float(task.gain))
        self._no_feedforward = np.zeros_like(self.weight)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return the gain k₀; see `Part.adjustable`."""
        return {"gain": Numbers(self._k0, self._each_k0)}

    def _each_k0(self, gain: ArrayLike) -> Array:
        """Convert one number of any sign to k₀ for each row."""
        return np.full_like(self._k0, finite(f"gain of '{self.name}'", gain, ()))

    def start(self, configuration: Configuration, t: float) -> None:  # noqa: ARG002
        """Evaluate the gradient at the start, so that a wrong one is found before the first tick.

        Args:
            configuration: Robot at the start.
            t: Time [s], not used.

        Raises:
            InvalidValue: The gradient is not finite, or does not have nv entries.
        """
        _try_gradient(self._objective, configuration)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the rows; see `RowPart.fill`."""
        self.error[:] = self._objective.gradient(configuration)[self._columns]
        rows.lower[:] = task_rate(self._no_feedforward, self._k0, self.error)
        rows.upper[:] = rows.lower


@dataclass(frozen=True, eq=False)
class ObjectiveTask(Task):
    """Keep an objective above a value, w(q) ≥ w_min: ∇w·v ≥ K (w_min − w), one inequality row.

    The row is in the unit of w per second. Put it above the task of the hand where an obstacle stands in the
    path; w is then the distance (3.58). Unlike `GradientTask` it leaves at least nv − 1 directions to the
    levels below, and all nv as long as w approaches w_min more slowly than K allows. Where w < w_min, the row
    makes w grow again. The error is max(w_min − w, 0).

    Args:
        objective: w(q), larger being better.
        at_least: w_min, in the unit of w.
        gain: K [1/s]. More lets w fall faster and brakes it later; it must stay below 2/Δt.
        weight: Factor of ½ d² within the level, with d the violation of the row. More lets this task win over
            others of the same level.
        name: Name in logs and plots. Default: "objective".

    Raises:
        InvalidValue: `objective` is no `Objective`, or a number is out of its range.

    Source:
        Footnote 7 of Section 3.5.1.
    """

    objective: Objective
    at_least: float = field(kw_only=True)
    gain: float = field(default=10.0, kw_only=True)
    weight: float = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        _check_objective(self.objective)
        finite("at_least", self.at_least, ())
        gains(self.gain, 1)
        weights(self.weight, 1)

    @property
    def obstacles(self) -> Sequence[Shape]:
        """Shapes that the objective depends on, which a viewer draws."""
        return self.objective.obstacles

    def bind(self, robot: Robot, name: str) -> "BoundObjective":  # noqa: ARG002
        """Return the row for a robot; see `Task.bind`."""
        return BoundObjective(name, self)


class BoundObjective(BoundTask):
    """The one row of an `ObjectiveTask`.

    Args:
        name: Name of the task in its plan.
        task: The declared task.
    """

    def __init__(self, name: str, task: ObjectiveTask) -> None:
        super().__init__(name, ("at least",), rate_units((task.objective.unit,)), task.gain, task.weight)
        self._objective, self._least = task.objective, float(task.at_least)

    def prepare(self, rows: LevelRows) -> None:
        """Open the upper side; see `RowPart.prepare`."""
        rows.upper[:] = np.inf

    def start(self, configuration: Configuration, t: float) -> None:  # noqa: ARG002
        """Evaluate the gradient of the objective once, before the first tick; see `BoundGradient.start`.

        Args:
            configuration: Robot at the start.
            t: Time [s], not used.

        Raises:
            InvalidValue: The gradient is not finite, or does not have nv entries.
        """
        _try_gradient(self._objective, configuration)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the row; see `RowPart.fill`."""
        lack = self._least - self._objective.value(configuration)
        rows.A[0] = self._objective.gradient(configuration)
        rows.lower[:] = task_rate(0.0, self.gain, lack)
        self.error[:] = max(lack, 0.0)


def _try_gradient(objective: Objective, configuration: Configuration) -> None:
    """Raise `InvalidValue` unless the gradient of an objective is finite and has nv entries."""
    finite("gradient of the objective", objective.gradient(configuration), (configuration.robot.nv,))


def _check_objective(objective: object) -> None:
    """Raise `InvalidValue` unless this is an objective."""
    if not isinstance(objective, Objective):
        raise InvalidValue(
            f"objective must derive from taskopt.Objective, with value(configuration) and "
            f"gradient(configuration), got {objective!r}"
        )
