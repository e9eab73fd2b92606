"""The inequality task that keeps the centre of mass above a polygon; `SupportPolygonLimit` is the limit."""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import ArrayLike
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.polygon import Edges, polygon_edges
from taskopt.kinematics.part import check_mass
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import BoundTask, Task, gains, weights


@dataclass(frozen=True, eq=False)
class SupportPolygonTask(Task):
    """Keep the centre of mass c above a convex polygon: n_i·J_c v ≤ K (o_i − margin − n_i·c) for each edge.

    n_i is the outward normal of an edge and o_i its offset, both horizontal; J_c is the Jacobian of the
    centre of mass. One row [m/s] for each edge, named "edge 1" and so on. The error is o_i − margin − n_i·c
    where that is negative, else 0 [m].

    Args:
        points: Corners (k, 2) or (k, 3) [m] in the world, in any order; their heights do not matter, and the
            polygon is their convex hull.
        margin: Distance that is kept from each edge, inside [m].
        gain: K [1/s]. More lets the centre of mass come closer to an edge before the row brakes, and brings
            it back faster from outside.
        weight: Factor of ½ d² within the level [s²/m²], with d the violation of a row. More lets this task
            win over others of the same level.
        name: Name in logs and plots. Default: "support polygon".

    Raises:
        InvalidValue: The points enclose no area, the margin leaves no area, or a number is out of its range;
            or, when bound, the robot has no mass.

    Source:
        The velocity damper of Faverjon and Tournassoud (1987), applied to each edge.
    """

    points: ArrayLike
    margin: float = field(default=0.0, kw_only=True)
    gain: float = field(default=1.0, kw_only=True)
    weight: float = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        polygon_edges(self.points, self.margin)
        gains(self.gain, 1)
        weights(self.weight, 1)

    def bind(self, robot: Robot, name: str) -> "BoundSupport":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            InvalidValue: The robot has no mass.
        """
        check_mass(robot, name)
        return BoundSupport(name, polygon_edges(self.points, self.margin), self.gain, self.weight)


class BoundSupport(BoundTask):
    """One row for each edge of the polygon.

    Args:
        name: Name of the task in its plan.
        edges: Edges of the polygon, moved inwards by the margin, m of them.
        gain: K [1/s].
        weight: Weight of every row.

    Attributes:
        value: n·c of each edge, as of the last `fill`, (m,) [m].
    """

    def __init__(self, name: str, edges: Edges, gain: float, weight: float) -> None:
        m = len(edges.offsets)
        names = [f"edge {i}" for i in range(1, m + 1)]
        super().__init__(name, names, ("m/s",) * m, gain, weight)
        self._edges, self.value = edges, np.zeros(m)

    def prepare(self, rows: LevelRows) -> None:
        """Open the lower side; see `RowPart.prepare`."""
        rows.lower[:] = -np.inf

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the rows; see `RowPart.fill`."""
        centre, J = configuration.centre_of_mass()
        rows.A[:] = self._edges.normals @ J[:2]
        self.value[:] = self._edges.normals @ centre[:2]
        rows.upper[:] = self.gain * (self._edges.offsets - self.value)
        self.error[:] = np.minimum(self._edges.offsets - self.value, 0.0)
