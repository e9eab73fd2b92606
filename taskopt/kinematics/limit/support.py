"""The limit that keeps the centre of mass above a polygon."""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike
from taskopt.kinematics.collision.point_motion import PointMotion, point_motion
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.polygon import Edges, polygon_edges
from taskopt.kinematics.limit.base import Limit
from taskopt.kinematics.limit.point_limit import BoundPointLimit, PointRows, checked_braking
from taskopt.kinematics.part import check_mass
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True, eq=False)
class SupportPolygonLimit(Limit):
    """Keep the centre of mass c above a convex polygon: −n_i·J_c v ≥ −κ (g_i − reserve)/Δt.

    g_i = o_i − margin − n_i·c is the distance of c from edge i less the margin, with the outward normal n_i
    and the offset o_i of that edge; J_c is the Jacobian of c. There is one row [m/s] for each edge, named
    "edge 1" and so on. Bounds on the velocities limit the error of one step (`BoundPointLimit`). A centre of
    mass that starts outside may stop or return.

    Args:
        points: Corners (k, 2) or (k, 3) [m] in the world, in any order; their heights do not matter, and the
            polygon is their convex hull.
        margin: Distance that is kept from each edge, inside [m].
        influence: Value of g_i at which braking begins [m]. More begins to brake earlier.
        gain: κ in (0, 1], the largest fraction of the remaining distance that one step may take. Less brakes
            earlier and more gently.
        name: Name in explanations, logs and plots.

    Raises:
        InvalidValue: The points enclose no area, the margin leaves no area, or a number is out of its range;
            or, when bound, the robot has no mass.

    Source:
        The velocity damper of Faverjon and Tournassoud (1987), applied to each edge.
    """

    points: ArrayLike
    margin: float = 0.0
    influence: float = field(default=0.05, kw_only=True)
    gain: float = field(default=0.1, kw_only=True)
    name: str = field(default="support_polygon", kw_only=True)

    def __post_init__(self) -> None:
        polygon_edges(self.points, self.margin)
        checked_braking(self.influence, self.gain)

    def bind(self, robot: Robot, dt: float) -> "BoundSupportLimit":
        """Return rows and bounds for a robot; see `Limit.bind`.

        Raises:
            InvalidValue: The robot has no mass, or a joint in it slides without limits.
        """
        check_mass(robot, self.name)
        edges = polygon_edges(self.points, self.margin)
        motion, m = _motion(robot, dt), len(edges.offsets)
        names, counted = [f"edge {i}" for i in range(1, m + 1)], np.ones((m, robot.nv), dtype=bool)
        declared = PointRows(names, [motion] * m, counted, *checked_braking(self.influence, self.gain))
        return BoundSupportLimit(self.name, robot, dt, declared, edges)


class BoundSupportLimit(BoundPointLimit):
    """The rows of a `SupportPolygonLimit`.

    Args:
        name: Name of the limit.
        robot: The robot.
        dt: Δt [s].
        declared: Numbers of the rows.
        edges: Edges of the polygon, moved inwards by the margin.
    """

    def __init__(self, name: str, robot: Robot, dt: float, declared: PointRows, edges: Edges) -> None:
        super().__init__(name, robot, dt, declared)
        self._edges = edges

    def measure(self, configuration: Configuration, gradient: Array) -> Array:
        """Measure the distance from each edge; see `BoundPointLimit.measure`."""
        centre, J = configuration.centre_of_mass()
        gradient[:] = -self._edges.normals @ J[:2]
        return self._edges.offsets - self._edges.normals @ centre[:2]


def _motion(robot: Robot, dt: float) -> PointMotion:
    """Return bounds on the motion of the centre of mass in one step: the mean of those of the bodies."""
    _, bodies = robot.carried()
    every = np.ones(robot.nv, dtype=bool)
    motions = np.array(
        [
            body[0] * np.array(point_motion(robot, joint, float(np.linalg.norm(body[1:])), every, dt))
            for joint, body in enumerate(bodies)
            if joint > 0 and body[0] > 0.0
        ]
    )
    return PointMotion(*(motions.sum(axis=0) / bodies[:, 0].sum()).tolist())
