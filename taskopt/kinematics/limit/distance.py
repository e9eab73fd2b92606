"""Keeping distances: hard rows that brake an approach, and the speeds at which one step stays predictable."""

import numpy as np

from taskopt.arrays import Array, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.collision.measure import Distances
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.step_bounds import nominal_speeds, step_losses
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.distance_kernel import approach_into, narrow_to_speeds


class BoundDistance:
    """Rows ∇d·v ≥ −κ (d − d_s)/Δt for the pairs nearer than `influence`, and bounds on the speeds.

    d_s = margin + reserve. An Euler step changes d by Δt ∇d·v up to a loss of at most
    s · jump + s² · bend where every |v_k| ≤ s v̄_k, v̄ being `speeds` (`robot.reach`). `reserve` (P,) is
    jump + 2 bend, room for more than s = 1, but at most half of the way from margin to influence.

    The bounds |v_k| ≤ s v̄_k, s being the largest for which no pair can lose more than its row leaves it,
    make sure that d ≥ margin stays so in every step, whatever other limits there are. They bind only
    for distances within the reserve, or where Δt is long. Rows and bounds all allow v = 0.
    """

    constant = False

    def __init__(
        self, collision: Collision, dt: float, name: str, margin: float, influence: float, gain: float
    ) -> None:
        self.name, self.distances = name, Distances(collision)
        self.margin, self.influence, self.gain, self.dt = margin, influence, gain, dt
        self.row_names = collision.names
        self.row_units = ("m/s",) * len(collision.names)
        self.column = (-1,) * len(collision.names)
        self.speeds = nominal_speeds(collision.robot)
        travel, self.jump, self.bend = step_losses(collision, dt, influence)
        self.reserve: Array = np.minimum(self.jump + 2.0 * self.bend, 0.5 * (influence - margin))
        self._known = np.array([travel, self.jump, self.bend, self.reserve])
        self.share: Array = np.empty(collision.robot.nv)  # s of each velocity

    def prepare(self, rows: LevelRows) -> None:
        rows.lower[:], rows.upper[:] = -np.inf, np.inf

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002 (protocol)
        of = self.distances
        of.update(at)
        approach_into(
            of.distance, of.gradient, of.collision.turn, self._known,
            self.margin, self.influence, self.gain, self.dt,
            rows.A, rows.lower, self.share,
        )  # fmt: skip

    def narrow(self, at: Configuration, bounds: Array, index: int) -> None:  # noqa: ARG002 (after fill)
        narrow_to_speeds(self.share, self.speeds, bounds, index)


def checked_distances(margin: float, influence: float, gain: float) -> tuple[float, float, float]:
    """Numbers of a distance limit; raise `InvalidValue` unless 0 ≤ margin < influence, 0 < gain ≤ 1."""
    margin, influence = float(finite("margin", margin, ())), positive("influence", influence)
    if not 0.0 <= margin < influence:
        raise InvalidValue(f"margin must be ≥ 0 and less than influence {influence:g}, got {margin:g}")
    if positive("gain", gain) > 1.0:
        raise InvalidValue(f"gain of a distance limit must be in (0, 1], got {gain:g}")
    return margin, influence, float(gain)
