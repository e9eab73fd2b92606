"""Distance limits bound to a robot.

Hard rows brake an approach. Bounds on the velocities limit the error of linearising the distance over one
step.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from reprlib import repr as shortened
from typing import cast

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.hierarchy.tolerances import CONTACT, RESERVE_USED
from taskopt.jit import kernel, kernel_apart
from taskopt.kinematics.collision.measure import Distances
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.pairs import Margins, pair_margins
from taskopt.kinematics.collision.step_bounds import nominal_speeds, step_losses, turning
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.base import BoundLimit, RowLimit, narrow_one
from taskopt.kinematics.limit.moving_obstacles import Mover
from taskopt.kinematics.parameter import Numbers, Parameter, one_number


@dataclass(frozen=True)
class Braking:
    """The margin, influence and gain of a distance limit.

    Attributes:
        margin: Least distance [m], ≥ 0.
        influence: Distance at which braking begins [m], > margin.
        gain: Largest fraction of the remaining distance that one step may take, in (0, 1].
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
            gain: Largest fraction of the remaining distance that one step may take.

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


class SpeedBounds(BoundLimit):
    """Bounds |v_k| ≤ w_k on the velocities, with w in the memory, (nv,) [rad/s, m/s].

    Args:
        name: Name of the limit.
        nv: Number of velocities.
    """

    of_speed = True

    def __init__(self, name: str, nv: int) -> None:
        super().__init__(name)
        self.kernel = narrow_to_speeds
        self.use(np.full(nv, np.inf))


class BoundDistance(RowLimit, BoundLimit):
    """Rows ∇d·v ≥ −κ (d − d_s)/Δt for the pairs nearer than the influence, and bounds on the velocities.

    Pairs beyond the influence do not brake. Only where a step at the nominal speeds could reach their margin,
    they have a row, which leaves of d − margin what such a step may lose besides, but at most half of it.

    If every |v_k| ≤ s v̄_k, an Euler step changes d by Δt ∇d·v less a loss of at most s · jump + s² · bend
    (`step_losses`). d_s = margin + reserve. The reserve is jump + 2 bend, which exceeds the loss for s = 1,
    but it is at most half of the way from margin to influence. Within the reserve a tenth of d − margin takes
    the place of d − d_s, so that two links that are always near each other, whose distance hardly changes, do
    not block a robot.

    The bounds |v_k| ≤ s v̄_k use the largest s for which no pair loses more than its row leaves above the
    margin. A sliding joint alone loses nothing: where s < 1, it is that of the turning joints with sliding
    ones at their nominal speeds, so that a lift is not slowed down beside a link that touches. The bounds
    ensure that d ≥ margin stays true in every step, whatever other limits there are. They bind
    only at distances within the reserve, or where Δt is long. All rows and bounds allow v = 0.

    Args:
        collision: The pairs of shapes, P of them.
        dt: Δt [s].
        name: Name of the limit.
        braking: Margin, influence and gain.
        margins: Margin of each pair, (P,) [m]; default: that of `braking` for all. Each pair begins to brake
            as far before its own margin as `braking` says.
        movers: Obstacles that move. The rate of the distance by their motion stands in the bound of each
            row, so that v = 0 may be forbidden where an obstacle comes near.

    Attributes:
        pair_names: Name of each pair, such as "panda_link0 – panda_hand", (P).
        distances: Distances and gradients of the pairs, as of the last `fill`.
        margin: Least distance of pairs that have no margin of their own [m].
        margins: Least distance of each pair, (P,) [m].
        influence: Distance at which braking begins at that margin [m].
        dt: Δt [s].
        speeds: v̄ of each velocity, (nv,) [rad/s, m/s].
        jump: Part of the loss of a step of each pair that grows with s, (P,) [m].
        bend: Part of the loss of a step of each pair that grows with s², (P,) [m].
        reserve: Amount that is added to the margin of each pair, (P,) [m].
        turns: (nv,) True where a velocity turns.
        known: (9, P) numbers of the pairs, see `Pair`.
        share: s_k of each velocity, the smallest s of the pairs that it moves, as of the last `fill`, (nv,).
        movers: Obstacles that move.
    """

    def __init__(
        self,
        collision: Collision,
        dt: float,
        name: str,
        braking: Braking,
        margins: Array | None = None,
        movers: Sequence[Mover] = (),
    ) -> None:
        units = ("m/s",) * len(collision.names)
        RowLimit.__init__(self, name, collision.names, units)
        BoundLimit.__init__(self, name)
        self.pair_names = collision.names
        self.distances = Distances(collision)
        self.margin, self.influence, self._gain = braking.margin, braking.influence, np.array([braking.gain])
        self.dt = dt
        self.speeds, self.turns = nominal_speeds(collision.robot), turning(collision.robot)
        self.known = np.zeros((len(Pair), len(collision.pairs)))
        self.margins: Array = self.known[Pair.MARGIN]
        self.margins[:] = self.margin if margins is None else margins
        _, self.jump, self.bend, _, self.reserve, *_ = self.known
        self.movers = tuple(movers)
        self._farthest = self._known_to = 0.0
        self._use_margins(self.margins)
        BoundDistance.renew(self)
        self.share: Array = np.empty(collision.robot.nv)
        self._bounds = SpeedBounds(name, collision.robot.nv)

    def box_part(self) -> BoundLimit:
        """Return the bounds on the velocities; `fill` says how narrow they are. See `BoundLimit.box_part`."""
        return self._bounds

    def retime(self, dt: float) -> None:
        """Change Δt [s]; see `Part.retime`."""
        # Travel and jump of a step are proportional to Δt, and bend with its part of slides to its square.
        longer = dt / self.dt
        self.known[: Pair.BEND] *= longer
        self.known[Pair.BEND : Pair.RESERVE] *= longer * longer
        self.dt = dt
        self.renew()

    @property
    def gain(self) -> float:
        """κ."""
        return float(self._gain[0])

    def renew(self) -> None:
        """Compute what follows from margins, gain and Δt."""
        if self._farthest > self._known_to:  # the losses of a step are known for pairs nearer than this only
            self._known_to = self._farthest
            self.known[: Pair.RESERVE] = step_losses(self.distances.collision, self.dt, self._farthest)
        way = self.influence - self.margin
        self.known[Pair.INFLUENCE] = self.margins + way
        self.reserve[:] = np.minimum(self.jump + 2.0 * self.bend, 0.5 * way)

    def _use_margins(self, margin: ArrayLike | Margins) -> Array | float:
        """Return a checked margin for each pair, (P,), or one for all [m]; the losses must reach as far."""
        if isinstance(margin, Mapping):
            each = pair_margins(self.pair_names, self.margin, margin)
        else:
            each = finite(f"margin of '{self.name}'", margin, (None,) if np.ndim(margin) else ())
        if (each < 0.0).any() or each.size not in (1, len(self.margins)):
            raise InvalidValue(
                f"margin of '{self.name}' must be ≥ 0, one number or one for each of {len(self.margins)} "
                f"pairs, got {shortened(margin)}"
            )
        largest = float(each.max(initial=0.0))
        self._farthest = max(self._farthest, largest + self.influence - self.margin)
        return each

    def _one_gain(self, gain: ArrayLike) -> float:
        """Return a gain that is in its range."""
        return one_number(f"gain of '{self.name}'", gain, 0.0, 1.0)

    def prepare(self, rows: LevelRows) -> None:
        """Open both sides; see `RowPart.prepare`."""
        rows.lower[:], rows.upper[:] = -np.inf, np.inf

    def start(self, configuration: Configuration, t: float) -> None:  # noqa: ARG002
        """Bring the obstacles that move back to their declared poses; see `RowPart.start`."""
        for mover in self.movers:
            mover.start(t)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return gain, margin, and the pose of each obstacle that moves, such as "ball.pose"."""
        poses = {f"{mover.name}.pose": mover.adjustable() for mover in self.movers}
        numbers: dict[str, Parameter] = {
            "gain": Numbers(self._gain, self._one_gain, self.renew),
            "margin": Numbers(self.margins, self._use_margins, self.renew),
        }
        return numbers | poses

    def recall(self) -> tuple[Array | None, ...]:
        """Return the pose to which each obstacle was set, or None for the others; see `Part.recall`."""
        return tuple(mover.recall() for mover in self.movers)

    def remember(self, kept: object) -> None:
        """Restore the poses to which obstacles were set; see `Part.remember`."""
        for mover, pose in zip(self.movers, cast("tuple[Array | None, ...]", kept), strict=True):
            if pose is not None:
                mover.redirect(pose, 0.0)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Measure the distances and write the rows; see `RowPart.fill`."""
        of, settings, known = self.distances, (self.gain, self.dt, self.turns), self.known
        for mover in self.movers:
            mover.move(t, self.dt)
        of.update(configuration)
        for mover in self.movers:
            known[Pair.DRIFT, mover.pairs] = mover.drift()
            taken = mover.loss(self.dt, known[Pair.TRAVEL], known[Pair.INFLUENCE], of.distance)
            known[Pair.LOSS, mover.pairs] = taken
        turn = of.collision.turn
        approach_into(of.distance, of.gradient, turn, known, settings, rows.A, rows.lower, self.share)
        np.multiply(self.share, self.speeds, out=self._bounds.memory)

    def narrow(self, configuration: Configuration, bounds: Array, owner: int) -> None:
        """Narrow the bounds to |v_k| ≤ s_k v̄_k, after `fill`; see `BoundLimit.narrow`."""
        self._bounds.narrow(configuration, bounds, owner)


class Pair(IntEnum):
    """Rows of the array (9, P) that holds the numbers of each pair."""

    TRAVEL = 0  # [m]
    JUMP = 1  # [m]
    BEND = 2  # [m]
    SLIDE = 3  # [m]
    RESERVE = 4  # [m]
    MARGIN = 5  # [m]
    INFLUENCE = 6  # [m]
    DRIFT = 7  # rate of the distance by the motion of an obstacle [m/s]
    LOSS = 8  # what that motion can take from the distance in a step besides [m]


@kernel
def approach_into(distance, gradient, turn, known, settings, A, lower, share):
    """Write the rows of a `BoundDistance`, and the share of each velocity.

    Args:
        distance: d of each pair, (P,) [m].
        gradient: ∇d of each pair along the velocities, (P, nv).
        turn: How far a unit velocity moves or turns each pair, (P, nv); read only for being zero or not.
        known: (9, P), see `Pair`.
        settings: Gain; Δt [s]; and (nv,) True where a velocity turns.
        A: Rows, (P, nv), written here.
        lower: Lower bounds, (P,) [m/s], written here.
        share: s of each velocity, (nv,), written here.
    """
    for k in range(share.size):
        share[k] = np.inf
    for i in range(distance.size):
        lower[i], turning, sliding = braked(distance[i], known[:, i], settings[0], settings[1])
        near = lower[i] > -np.inf or np.isnan(lower[i])
        for k in range(A.shape[1]):
            A[i, k] = gradient[i, k] if near else 0.0
            if turn[i, k] != 0.0:
                share[k] = min(share[k], turning if settings[2][k] else sliding)


@kernel
def braked(distance, pair, gain, dt):
    """Compute the largest approach of a pair at a given distance.

    Args:
        distance: d [m].
        pair: (9,), see `Pair`.
        gain: κ.
        dt: Δt [s].

    Returns:
        Lower bound of ∇d·v [m/s], −inf where no step from beyond the influence reaches the margin; and the
        largest s of turning and of sliding joints for which a step at the speeds s v̄ loses no more than the
        row leaves.
    """
    room = distance - pair[Pair.MARGIN] - pair[Pair.LOSS]
    if distance >= pair[Pair.INFLUENCE]:  # not so for NaN, which is handed on, and found
        s = largest_share(pair[Pair.TRAVEL], pair[Pair.BEND], room)
        if s >= 1.0 or room <= 0.0:
            return -np.inf, s, s
        budget = min(pair[Pair.JUMP] + pair[Pair.BEND], 0.5 * room)
        lower = (budget - room) / dt
    else:
        free = room - pair[Pair.RESERVE]
        if not pair[Pair.DRIFT] < 0.0:  # else the obstacle is given way to, until the reserve is back
            free = max(free, RESERVE_USED * room, 0.0)
        lower = -gain * free / dt - pair[Pair.DRIFT]
        budget = max(CONTACT, -0.1 * room) if room < CONTACT else room - gain * free
    s = largest_share(pair[Pair.JUMP], pair[Pair.BEND], budget)
    if s >= 1.0:
        return lower, s, s
    first, second = pair[Pair.JUMP] + pair[Pair.SLIDE], pair[Pair.BEND] - pair[Pair.SLIDE]
    return lower, largest_share(first, second, budget), 1.0


@kernel
def largest_share(first, second, budget):
    """Return the share of the nominal speeds that spends a budget.

    Args:
        first: Loss that grows with s, at s = 1 [m].
        second: Loss that grows with s², at s = 1 [m].
        budget: What may be lost [m].

    Returns:
        The s for which s · first + s² · second = budget.
    """
    return 2.0 * budget / (first + np.sqrt(first * first + 4.0 * second * budget))


@kernel_apart
def narrow_to_speeds(parameters, memory, state, bounds, owner):  # noqa: ARG001
    """Narrow the bounds to |v_k| ≤ w_k.

    Args:
        parameters: Not used.
        memory: w of each velocity, (nv,) [rad/s, m/s].
        state: Not used.
        bounds: (4, nv), see `BoundLimit.narrow`.
        owner: Number of the limit.
    """
    for k in range(memory.size):
        narrow_one(bounds, k, -memory[k], memory[k], owner)
