"""The task of little kinetic energy, by which joints that carry much mass move less than others."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.parameter import Parameter
from taskopt.kinematics.part import check_mass
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import BoundTask, Task, weights


@dataclass(frozen=True, eq=False)
class KineticEnergyTask(Task):
    """Move with little kinetic energy: √λ_i u_iᵀ v = 0 for each eigenvalue λ_i of the mass matrix M(q).

    The rows cost ½ Σ λ_i (u_iᵀ v)² = ½ vᵀ M v, the kinetic energy [J]. They are nv rows without a unit, which
    decide the velocity of every joint, so that nothing is left to the levels below. On a level of its own the
    task chooses the velocity of least energy among all that the levels before leave free.

    Args:
        weight: Factor of ½ vᵀ M v within the level. More lets this task win over others of the same level.
        name: Name in logs and plots. Default: "kinetic energy".

    Raises:
        InvalidValue: The weight is out of its range; or, when bound, the robot has no mass.

    Source:
        Khatib (1987), IEEE Journal of Robotics and Automation 3(1): the inverse of J that is weighted by M.
    """

    weight: float = 1.0
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        weights(self.weight, 1)

    def bind(self, robot: Robot, name: str) -> "BoundKineticEnergy":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            InvalidValue: The robot has no mass.
        """
        check_mass(robot, name)
        return BoundKineticEnergy(robot, name, self.weight)


class BoundKineticEnergy(BoundTask):
    """One row for each eigenvalue of the mass matrix, in increasing order.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        weight: Factor of ½ vᵀ M v.
    """

    def __init__(self, robot: Robot, name: str, weight: float) -> None:
        names = [f"mode {i}" for i in range(1, robot.nv + 1)]
        super().__init__(name, names, ("",) * robot.nv, 0.0, weight)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return no gain, since no error dies out here; see `Part.adjustable`."""
        return {}

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the rows; see `RowPart.fill`."""
        values, vectors = np.linalg.eigh(configuration.mass_matrix())
        rows.A[:] = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
        rows.lower[:] = rows.upper[:] = 0.0
