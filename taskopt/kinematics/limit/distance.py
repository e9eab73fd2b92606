"""Limits on distances: from the robot to obstacles, and between the links of the robot."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from taskopt.arrays import Array, require_mapping
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.collision.choice import PairChoice, choose_pairs, named_choice
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.pairs import Margins, pair_margins, shapes_of
from taskopt.kinematics.geometry.shapes import Shape, checked_obstacles, obstacle_names
from taskopt.kinematics.limit.base import Limit
from taskopt.kinematics.limit.bound_distance import BoundDistance, Braking
from taskopt.kinematics.limit.moving_obstacles import movers_of
from taskopt.kinematics.limit.near_rows import BoundNearDistance
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import Value
from taskopt.kinematics.target import Target, as_target


@dataclass(frozen=True)
class ObstacleLimit(Limit):
    """Keep every moving link at least a margin away from every obstacle.

        ∇d·v ≥ −κ (d − d_s)/Δt   for d < d_i

    d is the distance, d_i the influence, and d_s = margin + reserve. The `reserve` of the bound limit covers
    what one Euler step can lose; where a step could lose more, joint velocities are bounded, too. A link that
    starts inside the margin may stop or move away. There is one row [m/s] for each shape of a link and each
    obstacle, named "link – obstacle", but not more than `rows`. Meshes count as their convex hulls.

    Args:
        obstacles: One shape or several, in the world.
        margin: Least distance [m]. More keeps farther away.
        influence: d_i > margin [m]. More begins to brake earlier.
        gain: κ in (0, 1], the largest fraction of the remaining distance that one step may take. Less
            brakes earlier and more gently.
        links: Names of links. Default: every link that moves.
        name: Name in explanations, logs and plots.
        rows: Largest number of rows. If there are more pairs, rows go from tick to tick to the pairs that can
            bind within a step, and keep their names (`BoundNearDistance`). Where an obstacle moves, every
            pair has a row.
        moving: Targets of the poses of obstacles by name, which begin at the declared poses when the loop
            starts: a `Target` such as `Function` or `Latest`, or a pose; None holds the declared pose. Their
            velocities are part of the bounds, so the robot gives way, and v = 0 may be forbidden. Each pose
            is a parameter, such as "obstacle.ball.pose", which `Controller.set` replaces by a pose or by
            another target. A half-space must not turn.
        margins: Other margins [m], by the name of a link or an obstacle, or by two of them for one pair; of
            several that fit a pair, the last counts. Braking begins as far before each.

    Raises:
        InvalidValue: A number is out of its range, or an obstacle is not a shape.

    Source:
        The velocity damper of Faverjon and Tournassoud (1987), IEEE International Conference on Robotics and
        Automation, with ξ = κ (d_i − d_s)/Δt.
    """

    obstacles: Sequence[Shape] | Shape = field()
    margin: float = 0.02
    influence: float = field(default=0.1, kw_only=True)
    gain: float = field(default=0.1, kw_only=True)
    links: Sequence[str] | None = field(default=None, kw_only=True)
    name: str = field(default="obstacle", kw_only=True)
    rows: int = field(default=64, kw_only=True)
    moving: Mapping[str | int, Target | Value | None] = field(default_factory=dict, kw_only=True, hash=False)
    margins: Margins = field(default_factory=dict, kw_only=True, hash=False)

    def __post_init__(self) -> None:
        obstacles = checked_obstacles(self.obstacles)
        object.__setattr__(self, "obstacles", obstacles)
        object.__setattr__(self, "moving", _numbered_targets(self.moving, obstacles))
        Braking.checked(self.margin, self.influence, self.gain)
        _check_rows(self.rows)

    def bind(self, robot: Robot, dt: float) -> "BoundDistance":
        """Return rows and bounds for a robot; see `Limit.bind`.

        Raises:
            InvalidValue: The robot has no shapes.
            UnknownName: No link with a shape has one of the names in `links`.
        """
        obstacles = checked_obstacles(self.obstacles)
        collision = Collision.with_obstacles(robot, obstacles, self.links)
        braking = Braking.checked(self.margin, self.influence, self.gain)
        margins = pair_margins(collision.names, self.margin, self.margins)
        if not self.moving:
            return _bound(collision, dt, self.name, braking, margins, self.rows)
        targets = {int(number): as_target(target) for number, target in self.moving.items()}
        movers = movers_of(collision, obstacle_names(obstacles), targets)
        return BoundDistance(collision, dt, self.name, braking, margins, movers)


@dataclass(frozen=True)
class SelfCollisionLimit(Limit):
    """Keep links at least a margin away from each other, with rows and bounds as in `ObstacleLimit`.

    One row [m/s] for each pair of shapes, or `rows` of them for the pairs that can bind within a step.

    Args:
        margin: Least distance [m]. More keeps farther apart.
        influence: d_i > margin [m]. More begins to brake earlier.
        gain: κ in (0, 1], the largest fraction of the remaining distance that one step may take. Less
            brakes earlier and more gently.
        pairs: Pairs of names of links. Default: all that the robot's SRDF leaves enabled, without neighbours
            and pairs that are within the margin in every posture; `choice` says how many are left.
        name: Name in explanations, logs and plots.
        rows: Largest number of rows, see `ObstacleLimit`.
        margins: Other margins [m], by the name of a link, or by two of them, see `ObstacleLimit`.
        sampled: Number of random postures. Pairs that are within the margin in all of them are left out, too,
            although this does not prove that they always are. 0 tries no random postures.
        seed: Seed of the random postures.

    Raises:
        InvalidValue: A number is out of its range; or, when bound, no two links can meet.

    Source:
        As `ObstacleLimit`.
    """

    margin: float = 0.01
    influence: float = field(default=0.05, kw_only=True)
    gain: float = field(default=0.1, kw_only=True)
    pairs: Sequence[tuple[str, str]] | None = field(default=None, kw_only=True)
    name: str = field(default="self_collision", kw_only=True)
    rows: int = field(default=64, kw_only=True)
    margins: Margins = field(default_factory=dict, kw_only=True, hash=False)
    sampled: int = field(default=0, kw_only=True)
    seed: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        Braking.checked(self.margin, self.influence, self.gain)
        if not isinstance(self.sampled, int) or self.sampled < 0:
            raise InvalidValue(f"sampled must be a number of postures ≥ 0, got {self.sampled!r}")
        _check_rows(self.rows)

    def choice(self, robot: Robot) -> PairChoice:
        """Choose the pairs of links of a robot that are kept apart; print the choice to read the reasons.

        Args:
            robot: The robot.

        Returns:
            The pairs, and those that were left out.

        Raises:
            InvalidValue: The robot has no shapes, or a pair of `pairs` moves as one body.
            UnknownName: No link with a shape has one of the names in `pairs`.
        """
        shapes_of(robot, None)
        if self.pairs is None:
            return choose_pairs(robot, self.margin, self.sampled, self.seed)
        return named_choice(robot, self.pairs)

    def bind(self, robot: Robot, dt: float) -> "BoundDistance":
        """Return rows and bounds for a robot; see `Limit.bind`.

        Raises:
            InvalidValue: The robot has no shapes, no two links can meet, or a pair moves as one body.
            UnknownName: No link with a shape has one of the names in `pairs`.
        """
        pairs = self.choice(robot).pairs
        if not pairs:
            raise InvalidValue(f"no two links of {robot.name} can meet; leave the self-collision limit out")
        braking = Braking.checked(self.margin, self.influence, self.gain)
        collision = Collision.of_itself(robot, pairs)
        margins = pair_margins(collision.names, self.margin, self.margins)
        return _bound(collision, dt, self.name, braking, margins, self.rows)


def _bound(
    collision: Collision, dt: float, name: str, braking: Braking, margins: Array, rows: int
) -> BoundDistance:
    """Return the limit with a row for each pair, or with rows for near pairs where there are more pairs."""
    if len(collision.pairs) <= rows:
        return BoundDistance(collision, dt, name, braking, margins)
    return BoundNearDistance(collision, dt, name, braking, margins, rows)


def _numbered_targets(
    moving: Mapping[str | int, Target | Value | None], obstacles: Sequence[Shape]
) -> dict[str | int, Target | Value | None]:
    """Replace the names of obstacles by their numbers, since a stack may rename obstacles."""
    require_mapping("moving", moving, '{"ball": Latest((0.5, 0.0, 0.3))}')
    names, out = obstacle_names(obstacles), {}
    for key, target in moving.items():
        if key not in (names if isinstance(key, str) else range(len(names))):
            raise UnknownName("obstacle", str(key), names)
        out[names.index(key) if isinstance(key, str) else key] = target
    return out


def _check_rows(rows: int) -> None:
    """Raise `InvalidValue` unless `rows` is a number of rows."""
    if not isinstance(rows, int) or rows < 1:
        raise InvalidValue(f"rows must be a whole number ≥ 1, got {rows!r}")
