"""The task that keeps distances to obstacles and between links at a posture, before all goals."""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import IntArray, Mask
from taskopt.hierarchy.problem import LevelRows
from taskopt.hierarchy.tolerances import GOAL_POSITION
from taskopt.kinematics.collision.near import NearDistances
from taskopt.kinematics.collision.step_bounds import between
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import ObstacleLimit, SelfCollisionLimit
from taskopt.kinematics.limit.bound_distance import BoundDistance, Pair
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task import BoundTask, Task

STEP = 1.0  # [s] Δt of a tick of the search
ROWS = 64  # pairs that have a row at a tick, the nearest ones


@dataclass(frozen=True, eq=False)
class ClearanceTask(Task):
    """Keep the distances of a limit at one posture: d + ∇d·v ≥ margin for pairs nearer than the influence.

    Attributes:
        limit: An `ObstacleLimit` or a `SelfCollisionLimit`; its `gain` is not used.
        moved: (nv,) True for velocities that move the goals; pairs that none of them moves are ignored.
    """

    limit: ObstacleLimit | SelfCollisionLimit
    moved: Mask

    def default_name(self) -> str:
        """Return the name of the limit."""
        return self.limit.name

    def bind(self, robot: Robot, name: str) -> "BoundClearance":
        """Return the rows for a robot; see `Task.bind`."""
        return BoundClearance(self.limit.bind(robot, STEP), name, self.moved)


class BoundClearance(BoundTask):
    """Rows [m/s] for the nearest pairs of shapes; the error is the depth of each inside its margin [m].

    Since the nearest pairs have the rows, all pairs keep their margins if those with rows do.

    Args:
        limit: The limit, bound to the robot.
        name: Name of the task in its plan.
        moved: (nv,) velocities that move the goals.
    """

    def __init__(self, limit: BoundDistance, name: str, moved: Mask) -> None:
        collision = limit.distances.collision
        count = min(ROWS, len(collision.pairs))
        names = [f"row {i + 1}" for i in range(count)]
        super().__init__(name, names, ("m/s",) * count)
        self.choices = collision.names
        self._margin, self._influence = limit.known[Pair.MARGIN], limit.known[Pair.INFLUENCE]
        self._distances = NearDistances(collision, between(collision), self._influence)
        self._counts = (collision.turn[:, moved] != 0.0).any(axis=1)

    def prepare(self, rows: LevelRows) -> None:
        """Open the upper side; see `RowPart.prepare`."""
        rows.upper[:] = np.inf

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Measure the distances of near pairs and write their rows; see `RowPart.fill`."""
        of = self._distances
        near = self._near(configuration)
        room = of.distance[near] - self._margin[near]
        if near.size > len(self.error):
            nearest = np.argpartition(room, len(self.error))[: len(self.error)]
            near, room = near[nearest], room[nearest]
        count = near.size
        rows.A[:count], rows.A[count:] = of.gradient[near], 0.0
        rows.lower[:count], rows.lower[count:] = GOAL_POSITION - room, -np.inf
        self.error[:count], self.error[count:] = np.maximum(-room, 0.0), 0.0
        if rows.label.size:
            rows.label[:count], rows.label[count:] = near + 1.0, 0.0

    def is_kept(self, configuration: Configuration) -> bool:
        """Return True if all pairs keep their margins.

        Args:
            configuration: The robot at q.
        """
        near = self._near(configuration)
        return bool((self._distances.distance[near] >= self._margin[near]).all())

    def _near(self, configuration: Configuration) -> IntArray:
        """Measure the pairs that may be near; return those within their influence that the goals move."""
        of = self._distances
        of.update_near(configuration)
        return of.near[self._counts[of.near] & (of.distance[of.near] < self._influence[of.near])]
