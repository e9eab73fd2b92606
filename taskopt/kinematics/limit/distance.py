"""Limits on distances: from the robot to obstacles, and between the links of the robot.

Hard rows brake an approach. Bounds on the velocities limit the error of linearising the distance over one
step.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.hierarchy.tolerances import CONTACT
from taskopt.jit import kernel
from taskopt.kinematics.collision.choice import PairChoice, choose_pairs, named_choice
from taskopt.kinematics.collision.measure import Distances
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.pairs import shapes_of
from taskopt.kinematics.collision.step_bounds import nominal_speeds, step_losses
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Shape, checked_obstacles
from taskopt.kinematics.limit.base import BoundLimit, Limit, RowLimit, narrow_one
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True)
class ObstacleLimit(Limit):
    """Keep every moving link at least a margin away from every obstacle.

        ∇d·v ≥ −κ (d − d_s)/Δt   for d < d_i

    d is the distance, d_i the influence, and d_s = margin + reserve. The `reserve` of the bound limit covers
    what one Euler step can lose; where a step could lose more, joint velocities are bounded, too. A link that
    starts inside the margin may stop or move away. There is one row [m/s] for each shape of a link and each
    obstacle, named "link – obstacle". Meshes count as their convex hulls.

    Args:
        obstacles: One shape or several, in the world.
        margin: Least distance [m]. More keeps farther away.
        influence: d_i > margin [m]. More begins to brake earlier.
        gain: κ in (0, 1], the largest fraction of what is left that one step may take. Less brakes earlier
            and more gently.
        links: Names of links. Default: every link that moves.
        name: Name in explanations, logs and plots.

    Raises:
        InvalidValue: A number is out of its range, or an obstacle is no shape.

    Source:
        The velocity damper of Faverjon and Tournassoud (1987), IEEE International Conference on Robotics and
        Automation, with ξ = κ (d_i − d_s)/Δt.
    """

    obstacles: Sequence[Shape] | Shape = field()
    margin: float = 0.02
    influence: float = 0.1
    gain: float = 0.1
    links: Sequence[str] | None = None
    name: str = "obstacle"

    def __post_init__(self) -> None:
        object.__setattr__(self, "obstacles", checked_obstacles(self.obstacles))
        Braking.checked(self.margin, self.influence, self.gain)

    def bind(self, robot: Robot, dt: float) -> "BoundDistance":
        """Return rows and bounds for a robot; see `Limit.bind`.

        Raises:
            InvalidValue: The robot has no shapes.
            UnknownName: No link with a shape has one of the names in `links`.
        """
        collision = Collision.with_obstacles(robot, checked_obstacles(self.obstacles), self.links)
        return BoundDistance(
            collision, dt, self.name, Braking.checked(self.margin, self.influence, self.gain)
        )


@dataclass(frozen=True)
class SelfCollisionLimit(Limit):
    """Keep links at least a margin away from each other, with rows and bounds as in `ObstacleLimit`.

    One row [m/s] for each pair of shapes.

    Args:
        margin: Least distance [m]. More keeps farther apart.
        influence: d_i > margin [m]. More begins to brake earlier.
        gain: κ in (0, 1], the largest fraction of what is left that one step may take. Less brakes earlier
            and more gently.
        pairs: Pairs of names of links. Default: all that the robot's SRDF leaves enabled, without neighbours
            and pairs that are within the margin in every posture; `choice` says how many are left.
        sampled: Number of random postures. Pairs that are within the margin in all of them are left out, too,
            although this does not prove that they always are. 0 tries no random postures.
        seed: Seed of the random postures.
        name: Name in explanations, logs and plots.

    Raises:
        InvalidValue: A number is out of its range; or, when bound, no two links can meet.

    Source:
        As `ObstacleLimit`.
    """

    margin: float = 0.01
    influence: float = 0.05
    gain: float = 0.1
    pairs: Sequence[tuple[str, str]] | None = None
    name: str = "self_collision"
    sampled: int = field(default=0, kw_only=True)
    seed: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        Braking.checked(self.margin, self.influence, self.gain)
        if not isinstance(self.sampled, int) or self.sampled < 0:
            raise InvalidValue(f"sampled must be a number of postures ≥ 0, got {self.sampled!r}")

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
        collision = Collision.of_itself(robot, pairs)
        return BoundDistance(
            collision, dt, self.name, Braking.checked(self.margin, self.influence, self.gain)
        )


@dataclass(frozen=True)
class Braking:
    """The margin, influence and gain of a distance limit.

    Attributes:
        margin: Least distance [m], ≥ 0.
        influence: Distance at which braking begins [m], > margin.
        gain: Largest fraction of what is left that one step may take, in (0, 1].
    """

    margin: float
    influence: float
    gain: float

    @staticmethod
    def checked(margin: float, influence: float, gain: float) -> "Braking":
        """Check the three numbers, and return them as a record.

        Args:
            margin: Least distance [m].
            influence: Distance at which braking begins [m].
            gain: Largest fraction of what is left that one step may take.

        Returns:
            The record.

        Raises:
            InvalidValue: Unless 0 ≤ margin < influence and 0 < gain ≤ 1.
        """
        least, begin = float(finite("margin", margin, ())), positive("influence", influence)
        if not 0.0 <= least < begin:
            raise InvalidValue(f"margin must be ≥ 0 and less than influence {begin:g}, got {least:g}")
        if positive("gain", gain) > 1.0:
            raise InvalidValue(f"gain of a distance limit must be in (0, 1], got {gain:g}")
        return Braking(least, begin, float(gain))


class BoundDistance(RowLimit, BoundLimit):
    """Rows ∇d·v ≥ −κ (d − d_s)/Δt for the pairs nearer than the influence, and bounds on the velocities.

    If every |v_k| ≤ s v̄_k, an Euler step changes d by Δt ∇d·v less a loss of at most s · jump + s² · bend
    (`step_losses`). d_s = margin + reserve. The reserve is jump + 2 bend, which exceeds the loss for s = 1,
    but it is at most half of the way from margin to influence.

    The bounds |v_k| ≤ s v̄_k use the largest s for which no pair loses more than its row leaves above the
    margin. They ensure that d ≥ margin stays true in every step, whatever other limits there are. They bind
    only at distances within the reserve, or where Δt is long. All rows and bounds allow v = 0.

    Args:
        collision: The pairs of shapes, P of them.
        dt: Δt [s].
        name: Name of the limit.
        braking: Margin, influence and gain.

    Attributes:
        distances: Distances and gradients of the pairs, as of the last `fill`.
        margin: Least distance [m].
        influence: Distance at which braking begins [m].
        gain: κ.
        dt: Δt [s].
        speeds: v̄ of each velocity, (nv,) [rad/s, m/s].
        jump: Part of the loss of a step of each pair that grows with s, (P,) [m].
        bend: Part of the loss of a step of each pair that grows with s², (P,) [m].
        reserve: Amount that is added to the margin of each pair, (P,) [m].
        share: s_k of each velocity, the smallest s of the pairs that it moves, as of the last `fill`, (nv,).
    """

    def __init__(self, collision: Collision, dt: float, name: str, braking: Braking) -> None:
        units = ("m/s",) * len(collision.names)
        RowLimit.__init__(self, name, collision.names, units)
        BoundLimit.__init__(self, name)
        self.distances = Distances(collision)
        self.margin, self.influence, self.gain = braking.margin, braking.influence, braking.gain
        self.dt = dt
        self.speeds = nominal_speeds(collision.robot)
        losses = step_losses(collision, dt, self.influence)
        self._known = np.array([*losses, np.zeros(len(losses[0]))])
        _, self.jump, self.bend, self.reserve = self._known
        self.reserve[:] = np.minimum(self.jump + 2.0 * self.bend, 0.5 * (self.influence - self.margin))
        self._settings = np.array([self.margin, self.influence, self.gain, dt])
        self.share: Array = np.empty(collision.robot.nv)

    def retime(self, dt: float) -> None:
        """Change Δt [s]; see `Part.retime`."""
        # Travel and jump of a step are proportional to Δt, and bend to its square.
        longer = dt / self.dt
        self._known[:3] *= np.array([[longer], [longer], [longer * longer]])
        self.dt = self._settings[3] = dt
        self.reserve[:] = np.minimum(self.jump + 2.0 * self.bend, 0.5 * (self.influence - self.margin))

    def prepare(self, rows: LevelRows) -> None:
        """Open both sides; see `RowPart.prepare`."""
        rows.lower[:], rows.upper[:] = -np.inf, np.inf

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Measure the distances and write the rows; see `RowPart.fill`."""
        of = self.distances
        of.update(configuration)
        turn = of.collision.turn
        approach_into(
            of.distance, of.gradient, turn, self._known, self._settings, rows.A, rows.lower, self.share
        )

    def narrow(self, configuration: Configuration, bounds: Array, owner: int) -> None:  # noqa: ARG002
        """Narrow the bounds to |v_k| ≤ s_k v̄_k, after `fill`; see `BoundLimit.narrow`."""
        narrow_to_speeds(self.share, self.speeds, bounds, owner)


@kernel
def approach_into(distance, gradient, turn, known, settings, A, lower, share):
    """Write the rows of a `BoundDistance`, and the share of each velocity.

    Args:
        distance: d of each pair, (P,) [m].
        gradient: ∇d of each pair along the velocities, (P, nv).
        turn: How far a unit velocity moves or turns each pair, (P, nv); read only for being zero or not.
        known: Travel, jump, bend and reserve of each pair, (4, P) [m].
        settings: Margin [m], influence [m], gain, Δt [s].
        A: Rows, (P, nv), written here.
        lower: Lower bounds, (P,) [m/s], written here.
        share: s of each velocity, (nv,), written here.
    """
    margin, influence, gain, dt = settings[0], settings[1], settings[2], settings[3]
    for k in range(share.size):
        share[k] = np.inf
    for i in range(distance.size):
        travel, jump, bend, reserve = known[0, i], known[1, i], known[2, i], known[3, i]
        room = distance[i] - margin
        near = not distance[i] >= influence  # so that NaN is handed on, and found
        for k in range(A.shape[1]):
            A[i, k] = gradient[i, k] if near else 0.0
        if near:
            free = max(room - reserve, 0.0)
            lower[i] = -gain * free / dt
            budget, first = room - gain * free, jump
            if room < CONTACT:
                budget = max(CONTACT, -0.1 * room)
        else:
            lower[i] = -np.inf
            budget, first = room, travel
        s = 2.0 * budget / (first + np.sqrt(first * first + 4.0 * bend * budget))
        for k in range(share.size):
            if turn[i, k] != 0.0:
                share[k] = min(share[k], s)


@kernel
def narrow_to_speeds(share, speeds, bounds, owner):
    """Narrow the bounds to |v_k| ≤ s_k v̄_k.

    Args:
        share: s of each velocity, (nv,).
        speeds: v̄ of each velocity, (nv,) [rad/s, m/s].
        bounds: (4, nv), see `BoundLimit.narrow`.
        owner: Number of the limit.
    """
    for k in range(share.size):
        limit = share[k] * speeds[k]
        narrow_one(bounds, k, -limit, limit, owner)
