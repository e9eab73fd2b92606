"""The climb of an objective: a joint velocity along its gradient."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective import Objective
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.rows import task_rate
from taskopt.kinematics.task.velocity import BoundVelocity


@dataclass(frozen=True, eq=False)
class GradientTask:
    """Climb an objective w(q): v = k0 ∇w(q), one row a velocity (3.55).

    Below a task it is the chapter's q̇ = J†ẋ + (I − J†J) q̇_0 (3.54) with q̇_0 = k0 ∇w. `gain` is k0: the
    larger, the faster the climb, and the sooner one Euler step overshoots the top. `weight` is the
    factor of ½‖·‖², one number or one a velocity.
    """

    objective: Objective
    gain: float = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if not (hasattr(self.objective, "gradient") and hasattr(self.objective, "value")):
            raise InvalidValue(f"objective must have value(at) and gradient(at), got {self.objective!r}")
        if np.ndim(self.gain) != 0 or not np.isfinite(self.gain):
            raise InvalidValue(f"gain must be one finite number, got {self.gain!r}")

    def default_name(self) -> str:
        return "gradient"

    def bind(self, robot: Robot, name: str) -> "BoundGradient":
        return BoundGradient(robot, name, self.weight, self.objective, float(self.gain))


class BoundGradient(BoundVelocity):
    """Rows v = k0 ∇w; the error is the gradient, which is zero on the top."""

    constant = False

    def __init__(self, robot: Robot, name: str, weight: ArrayLike, objective: Objective, gain: float) -> None:
        super().__init__(robot, name, weight)
        self._objective, self._k0 = objective, np.full(self.weight.size, gain)
        self._no_feedforward = np.zeros_like(self.weight)

    def start(self, at: Configuration, t: float) -> None:  # noqa: ARG002 (protocol)
        finite("gradient of the objective", self._objective.gradient(at), (at.robot.nv,))

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002 (protocol)
        self.error[:] = self._objective.gradient(at)[self._columns]
        rows.lower[:] = task_rate(self._no_feedforward, self._k0, self.error)
        rows.upper[:] = rows.lower
