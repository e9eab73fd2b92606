"""Distance from obstacles."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from taskopt.arrays import Array, finite
from taskopt.configuration import Configuration
from taskopt.distance import Distances
from taskopt.errors import InvalidValue
from taskopt.objective.base import Objective
from taskopt.robot.collision import Collision, checked_obstacles
from taskopt.robot.robot import Robot
from taskopt.robot.shapes import Shape


@dataclass(frozen=True, init=False)
class ObstacleDistance(Objective):
    """w = min over moving links and obstacles of the distance between them [m] (3.58), made smooth.

    The minimum has a kink where another pair takes over, at which a climb would chatter. So
    w = −τ log Σ exp(−dᵢ/τ) over all pairs, with gradient Σ exp((w − dᵢ)/τ) ∇dᵢ: between
    min d − τ log(number of pairs) and min d, and pairs that are farther by τ count a third.
    `temperature` is τ [m]; 0 is the plain minimum. Where (3.58) takes a point of the obstacle, such as a
    sphere's centre, we take its surface; for one sphere w differs by the radius, the gradient not at all.
    `links` chooses by name (default: every link that moves).
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
        tau = float(finite("temperature", temperature, ()))
        if tau < 0.0:
            raise InvalidValue(f"temperature must be ≥ 0, got {tau:g}")
        object.__setattr__(self, "obstacles", checked_obstacles(obstacles))
        object.__setattr__(self, "temperature", tau)
        object.__setattr__(self, "links", None if links is None else tuple(links))

    def value(self, at: Configuration) -> float:
        d = _measured(self, at).distance
        nearest = float(d.min())
        if self.temperature == 0.0:
            return nearest
        return nearest - self.temperature * float(np.log(np.exp((nearest - d) / self.temperature).sum()))

    def gradient(self, at: Configuration) -> Array:
        """Σ pᵢ ∇dᵢ, pᵢ = exp(−dᵢ/τ) / Σ exp(−dⱼ/τ)."""
        of = _measured(self, at)
        if self.temperature == 0.0:
            return of.gradient[np.argmin(of.distance)].copy()
        share = np.exp((of.distance.min() - of.distance) / self.temperature)
        return (share / share.sum()) @ of.gradient


def _measured(objective: ObstacleDistance, at: Configuration) -> Distances:
    out = _distances(objective, at.robot)
    out.update(at)
    return out


@lru_cache(maxsize=32)
def _distances(objective: ObstacleDistance, robot: Robot) -> Distances:
    return Distances(Collision.with_obstacles(robot, objective.obstacles, objective.links))
