"""Distance of a robot's links from one another."""

from collections.abc import Sequence
from dataclasses import dataclass

from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.pairs import named_pairs, self_pairs
from taskopt.kinematics.objective.distance import Nearest, checked_temperature
from taskopt.kinematics.robot.robot import Robot


@dataclass(frozen=True, init=False)
class SelfDistance(Nearest):
    """w = min over pairs of links of the distance between them [m], smooth as `Nearest` is.

    `pairs`: names of links, two and two; by default those of `SelfCollisionLimit`. `temperature` is τ [m].
    """

    temperature: float
    pairs: tuple[tuple[str, str], ...] | None

    def __init__(self, temperature: float = 0.01, pairs: Sequence[tuple[str, str]] | None = None) -> None:
        object.__setattr__(self, "temperature", checked_temperature(temperature))
        chosen = None if pairs is None else tuple((first, second) for first, second in pairs)
        object.__setattr__(self, "pairs", chosen)

    def collision(self, robot: Robot) -> Collision:
        pairs = self_pairs(robot) if self.pairs is None else named_pairs(robot, self.pairs)
        if not pairs:
            raise InvalidValue(f"no two links of {robot.name} can meet; leave the self-distance out")
        return Collision.of_itself(robot, pairs)
