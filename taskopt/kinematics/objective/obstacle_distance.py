"""Distance from obstacles."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.geometry.shapes import Shape, checked_obstacles
from taskopt.kinematics.objective.distance import Nearest, checked_temperature
from taskopt.kinematics.robot.robot import Robot


@dataclass(frozen=True, init=False)
class ObstacleDistance(Nearest):
    """w = min over moving links and obstacles of their distance [m] (3.58), smooth as in `Nearest`.

    Where (3.58) takes a point of the obstacle, such as a sphere's centre, we take its surface; for one
    sphere w differs by the radius, the gradient not at all. `links` chooses by name (default: every link
    that moves). `temperature` is τ [m].
    """

    obstacles: tuple[Shape, ...]
    temperature: float
    links: tuple[str, ...] | None

    def __init__(
        self,
        obstacles: Sequence[Shape] | Shape,
        temperature: float = 0.01,
        links: Iterable[str] | None = None,
    ) -> None:
        object.__setattr__(self, "obstacles", checked_obstacles(obstacles))
        object.__setattr__(self, "temperature", checked_temperature(temperature))
        object.__setattr__(self, "links", None if links is None else tuple(links))

    def collision(self, robot: Robot) -> Collision:
        return Collision.with_obstacles(robot, self.obstacles, self.links)
