"""Keeping away from obstacles."""

from collections.abc import Sequence
from dataclasses import dataclass

from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.geometry.shapes import Shape, checked_obstacles
from taskopt.kinematics.limit.distance import BoundDistance, checked_distances
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True)
class ObstacleLimit:
    """No link that moves comes nearer than `margin` [m] to any obstacle.

    ḋ ≥ −ξ (d − d_s)/(d_i − d_s) for d < d_i, the velocity damper of Faverjon and Tournassoud (1987),
    ICRA, in discrete form: within `influence` d_i [m] a link approaches by no more than a fraction `gain`
    in (0, 1] of what is left per step, ξ = gain (d_i − d_s)/Δt. d_s is the margin and a reserve for what
    one Euler step can lose; `bind(robot, dt).reserve` states it. A link that starts inside the margin may
    stop or leave. `links` chooses by name (default: every link that moves). Meshes count as their
    convex hulls. One row for each shape and obstacle, named "link – obstacle".
    """

    obstacles: Sequence[Shape] | Shape
    margin: float = 0.02
    influence: float = 0.1
    gain: float = 0.1
    links: Sequence[str] | None = None
    name: str = "obstacle"

    def __post_init__(self) -> None:
        object.__setattr__(self, "obstacles", checked_obstacles(self.obstacles))
        checked_distances(self.margin, self.influence, self.gain)

    def bind(self, robot: Robot, dt: float) -> BoundDistance:
        collision = Collision.with_obstacles(robot, checked_obstacles(self.obstacles), self.links)
        return BoundDistance(
            collision, dt, self.name, *checked_distances(self.margin, self.influence, self.gain)
        )
