"""Objectives that are the smallest distance to obstacles, or between the links of a robot."""

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from taskopt.arrays import Array, finite
from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.choice import choose_pairs
from taskopt.kinematics.collision.measure import Distances
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.pairs import named_pairs
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Shape, checked_obstacles
from taskopt.kinematics.objective.base import Objective
from taskopt.kinematics.robot.robot import Robot


class Nearest(Objective):
    """The smallest of some distances d_i between shapes [m], made smooth: w = −τ log Σ exp(−d_i/τ).

    The plain minimum has a kink where another pair becomes the nearest one, and a climb would alternate
    between the two pairs. w lies between min d − τ log(number of pairs) and min d. In the gradient, a pair
    that is farther than the nearest one by τ has about a third of its weight.

    Attributes:
        temperature: τ [m]; 0 gives the plain minimum. More makes w smoother, and farther from the minimum.
    """

    unit = "m"
    temperature: float

    @abstractmethod
    def collision(self, robot: Robot) -> Collision:
        """Return the pairs of shapes of a robot.

        Args:
            robot: The robot.

        Returns:
            The pairs.
        """

    def value(self, configuration: Configuration) -> float:
        """Return w(q) [m]; see `Objective.value`."""
        d = _measured(self, configuration).distance
        nearest = float(d.min())
        if self.temperature == 0.0:
            return nearest
        return nearest - self.temperature * float(np.log(np.exp((nearest - d) / self.temperature).sum()))

    def gradient(self, configuration: Configuration) -> Array:
        """Return ∂w/∂q = Σ p_i ∇d_i with p_i = exp(−d_i/τ) / Σ exp(−d_j/τ), (nv,)."""
        of = _measured(self, configuration)
        if self.temperature == 0.0:
            return of.gradient[np.argmin(of.distance)].copy()
        share = np.exp((of.distance.min() - of.distance) / self.temperature)
        return (share / share.sum()) @ of.gradient


@dataclass(frozen=True, init=False)
class ObstacleDistance(Nearest):
    """The smallest distance between moving links and obstacles [m], smooth as in `Nearest`.

    (3.58) measures to a point of the obstacle, such as the centre of a sphere; this objective measures to its
    surface. For one sphere w differs by the radius, and the gradient is the same.

    Args:
        obstacles: One shape or several, placed in the world.
        temperature: τ [m], see `Nearest`.
        links: Names of links. Default: every link that moves.

    Raises:
        InvalidValue: An obstacle is not a shape, or τ is negative.

    Source:
        Equation (3.58).
    """

    obstacles: tuple[Shape, ...] = field()
    temperature: float = field()
    links: tuple[str, ...] | None = field()

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
        """Return the pairs of links and obstacles; see `Nearest.collision`."""
        return Collision.with_obstacles(robot, self.obstacles, self.links)


@dataclass(frozen=True, init=False)
class SelfDistance(Nearest):
    """The smallest distance between the links of some pairs [m], smooth as in `Nearest`.

    Args:
        temperature: τ [m], see `Nearest`.
        pairs: Pairs of names of links. Default: those of `SelfCollisionLimit`.

    Raises:
        InvalidValue: τ is negative; or, when first used, no two links can meet.
    """

    temperature: float
    pairs: tuple[tuple[str, str], ...] | None

    def __init__(self, temperature: float = 0.01, pairs: Sequence[tuple[str, str]] | None = None) -> None:
        object.__setattr__(self, "temperature", checked_temperature(temperature))
        listed = () if pairs is None else pairs
        if not isinstance(listed, Sequence) or not all(isinstance(pair, Sequence) for pair in listed):
            raise InvalidValue(f"pairs must be names of links, two and two, got {pairs!r}")
        object.__setattr__(self, "pairs", None if pairs is None else tuple(map(tuple, listed)))

    def collision(self, robot: Robot) -> Collision:
        """Return the pairs of links; see `Nearest.collision`.

        Raises:
            InvalidValue: The robot has no shapes, no two links can meet, or a pair moves as one body.
            UnknownName: No link with a shape has one of the names in `pairs`.
        """
        pairs = choose_pairs(robot).pairs if self.pairs is None else named_pairs(robot, self.pairs)
        if not pairs:
            raise InvalidValue(f"no two links of {robot.name} can meet; leave the self-distance out")
        return Collision.of_itself(robot, pairs)


def checked_temperature(temperature: float) -> float:
    """Check τ and return it as a float.

    Args:
        temperature: τ [m].

    Returns:
        τ ≥ 0 [m].

    Raises:
        InvalidValue: τ is negative or not finite.
    """
    tau = float(finite("temperature", temperature, ()))
    if tau < 0.0:
        raise InvalidValue(f"temperature must be ≥ 0, got {tau:g}")
    return tau


def _measured(objective: Nearest, configuration: Configuration) -> Distances:
    """Return the distances of an objective at a configuration."""
    out = _distances(objective, configuration.robot)
    out.update(configuration)
    return out


@lru_cache(maxsize=32)
def _distances(objective: Nearest, robot: Robot) -> Distances:
    """Return a record for the distances of an objective on a robot, made once for each robot."""
    return Distances(objective.collision(robot))
