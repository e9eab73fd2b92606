"""Keeping a robot's links away from one another."""

from collections.abc import Sequence
from dataclasses import dataclass

from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.pairs import named_pairs, self_pairs, shapes_of
from taskopt.kinematics.limit.distance import BoundDistance, checked_distances
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True)
class SelfCollisionLimit:
    """No two links come nearer than `margin` [m] to each other; the damper is that of `ObstacleLimit`.

    `pairs`: names of links, two and two. Default: the pairs that the robot's SRDF leaves enabled; without
    one, all but neighbours and links that are never farther apart than the margin. One row a pair of shapes.
    """

    margin: float = 0.01
    influence: float = 0.05
    gain: float = 0.1
    pairs: Sequence[tuple[str, str]] | None = None
    name: str = "self_collision"

    def __post_init__(self) -> None:
        checked_distances(self.margin, self.influence, self.gain)

    def bind(self, robot: Robot, dt: float) -> BoundDistance:
        shapes_of(robot, None)
        pairs = self_pairs(robot, self.margin) if self.pairs is None else named_pairs(robot, self.pairs)
        if not pairs:
            raise InvalidValue(f"no two links of {robot.name} can meet; leave the self-collision limit out")
        collision = Collision.of_itself(robot, pairs)
        return BoundDistance(
            collision, dt, self.name, *checked_distances(self.margin, self.influence, self.gain)
        )
