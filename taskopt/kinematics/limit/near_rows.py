"""A distance limit for many pairs, in which only pairs that can bind within a step have rows."""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.problem import LevelRows
from taskopt.hierarchy.tolerances import CONTACT
from taskopt.jit import kernel, kernel_apart
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.near import NearDistances
from taskopt.kinematics.collision.step_bounds import Between, between
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.bound_distance import BoundDistance, Braking, Pair, braked, largest_share


class BoundNearDistance(BoundDistance):
    """The limit of `BoundDistance` with a fixed number of rows, whose pairs change from tick to tick.

    A pair has a row only if its row can bind at the nominal speeds v̄. All others keep their distance by the
    bounds |v_k| ≤ s v̄_k alone, with s ≥ 1: beyond its threshold

        max(margin + travel + bend, min(influence, margin + reserve + travel/κ))

    a pair cannot lose more than its distance from the margin in one step, nor can its row bind, so that it
    need not be measured. v̄ is finite also for a joint without a velocity limit, and the bounds keep that
    joint below s v̄. If more pairs need a row than there are rows, the rows go to the pairs that would
    otherwise be slowed down most. The other pairs keep their margins by tighter bounds on the velocities, so
    that all margins are kept.

    The label of a row is the number of its pair, so that every bound has the name of its pair. A pair keeps
    its row as long as it needs one.

    Args:
        collision: The pairs of shapes, P of them.
        dt: Δt [s].
        name: Name of the limit.
        braking: Margin, influence and gain.
        margins: Margin of each pair, (P,) [m]; None: that of `braking` for all.
        rows: Number of rows.

    Attributes:
        threshold: Distance of each pair beyond which it is not measured, (P,) [m].
        share_beyond: s of each velocity if all pairs are beyond their thresholds, (nv,), ≥ 1.
        pair_of_row: Index of the pair of each row as of the last `fill`, −1 for none, (rows,).
    """

    distances: NearDistances

    def __init__(
        self,
        collision: Collision,
        dt: float,
        name: str,
        braking: Braking,
        margins: Array | None,
        rows: int,
    ) -> None:
        super().__init__(collision, dt, name, braking, margins)
        self.row_names = tuple(f"row {i + 1}" for i in range(rows))
        self.row_units, self.column = ("m/s",) * rows, (-1,) * rows
        self.choices = collision.names
        self.threshold = _thresholds(self.known, self.gain)
        listed = between(collision)
        self.distances = NearDistances(collision, listed, self.threshold)
        self.share_beyond = _share_beyond(self.known, self.threshold, listed, self.gain, self.speeds.size)
        self.pair_of_row = np.full(rows, -1, dtype=np.int64)
        count = len(collision.pairs)
        self._served = Served(np.zeros(count, np.bool_), np.full(count, -1, np.int64), self.pair_of_row)

    def renew(self) -> None:
        """Compute what follows from margins, gain and Δt, the thresholds among it."""
        super().renew()
        self.threshold[:] = _thresholds(self.known, self.gain)
        listed = self.distances.between
        self.share_beyond[:] = _share_beyond(self.known, self.threshold, listed, self.gain, self.speeds.size)
        self.distances.broad_phase.expect(self.threshold)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Measure the distances of near pairs and write their rows; see `RowPart.fill`."""
        of, listed = self.distances, self.distances.between
        of.update_near(configuration)
        self.share[:] = self.share_beyond
        braking = np.empty((3, of.near.size))
        settings = self.gain, self.dt, self.turns
        brake_pairs(of.near, of.distance, of.gradient, listed, self.known, settings, braking, self.share)
        label = rows.label if rows.label.size else np.empty(len(self.pair_of_row))
        written = RowNumbers(rows.A, rows.lower, label)
        chosen = self._choose(braking)
        assign_rows(of.near, chosen, braking, of.gradient, listed, self._served, written, self.share)
        np.multiply(self.share, self.speeds, out=self._bounds.memory)

    def _choose(self, braking: Array) -> IntArray:
        """Return the indices of the pairs that get rows: those that would be slowed down most without one."""
        needs = np.flatnonzero(~(braking[1] >= 1.0))  # NaN among them, so that it is found
        count = len(self.pair_of_row)
        return needs if needs.size <= count else needs[np.argsort(braking[2, needs], kind="stable")[:count]]


def _thresholds(known: Array, gain: float) -> Array:
    """Return the threshold of each pair, beyond which it can neither bind nor reach its margin, (P,) [m]."""
    safe = known[Pair.MARGIN] + known[Pair.TRAVEL] + known[Pair.BEND]
    binds = known[Pair.MARGIN] + known[Pair.RESERVE] + known[Pair.TRAVEL] / gain
    return np.maximum(safe, np.minimum(binds, known[Pair.INFLUENCE]))


def _share_beyond(known: Array, threshold: Array, listed: Between, gain: float, nv: int) -> Array:
    """Return the s of each velocity (nv,) that keeps the margins of all pairs beyond their thresholds."""
    room, travel, bend = threshold - known[Pair.MARGIN], known[Pair.TRAVEL], known[Pair.BEND]
    with np.errstate(divide="ignore"):
        safe = 2.0 * room / (travel + np.sqrt(travel * travel + 4.0 * bend * room))
        binds = gain * (room - known[Pair.RESERVE]) / travel
    each = np.where(threshold < known[Pair.INFLUENCE], np.minimum(safe, binds), safe)
    out = np.full(nv, np.inf)
    np.minimum.at(out, listed.column, np.repeat(each, np.diff(listed.start)))
    return out


class Served(NamedTuple):
    """Which pairs the rows serve.

    Attributes:
        is_chosen: (P,) memory, all False between two calls.
        row_of_pair: Row of each pair, −1 for none, (P,).
        pair_of_row: Pair of each row, −1 for none, (rows,).
    """

    is_chosen: Mask
    row_of_pair: IntArray
    pair_of_row: IntArray


class RowNumbers(NamedTuple):
    """The numbers of the rows that are written.

    Attributes:
        A: Coefficients of the velocities, (rows, nv).
        lower: Lower bounds, (rows,) [m/s].
        label: Labels, (rows,).
    """

    A: Array
    lower: Array
    label: Array


@kernel_apart
def brake_pairs(near, distance, gradient, between, known, settings, braking, share):
    """Compute the row of each near pair, and the bounds on the velocities that its loss in a step requires.

    Args:
        near: Indices of the near pairs, (N,).
        distance: d of all pairs, (P,) [m].
        gradient: ∇d of all pairs along the velocities, (P, nv).
        between: The velocities that change each distance.
        known: (9, P), see `Pair`.
        settings: Gain; Δt [s]; and (nv,) True where a velocity turns.
        braking: (3, N) receives the lower bound of each row [m/s]; the s at which the row would bind at the
            speeds s v̄; and the s that keeps the margin without a row, by a κ-th of the room a step, or the
            whole of it beyond the influence. They are −inf, inf and inf for a pair that needs no row.
        share: s of each velocity, (nv,), made smaller here.
    """
    for i in range(near.size):
        pair = near[i]
        lower, turning, sliding = braked(distance[pair], known[:, pair], settings[0], settings[1])
        steepest = 0.0
        for entry in range(between.start[pair], between.start[pair + 1]):
            k = between.column[entry]
            share[k] = min(share[k], turning if settings[2][k] else sliding)
            steepest += abs(gradient[pair, k]) * between.speed[entry]
        braking[0, i], braking[1, i], braking[2, i] = lower, np.inf, np.inf
        if lower != -np.inf and steepest != 0.0:  # true of NaN, too, so that it is handed on and found
            braking[1, i] = -lower / steepest
            room = distance[pair] - known[Pair.MARGIN, pair]
            budget = max(settings[0] * room, CONTACT, -0.1 * room)
            if distance[pair] >= known[Pair.INFLUENCE, pair]:
                budget = room
            first = known[Pair.JUMP, pair] + settings[1] * steepest
            braking[2, i] = largest_share(first, known[Pair.BEND, pair], budget)


@kernel_apart
def assign_rows(near, chosen, braking, gradient, between, served, rows, share):
    """Write the rows of the chosen pairs, and keep the other near pairs by bounds on the velocities.

    Args:
        near: Indices of the near pairs, (N,).
        chosen: Indices in `near` of the pairs that get rows.
        braking: (3, N), see `brake_pairs`.
        gradient: ∇d of all pairs along the velocities, (P, nv).
        between: The velocities that change each distance.
        served: Assignment of pairs to rows, changed here.
        rows: The rows, written here.
        share: s of each velocity, (nv,), made smaller here.
    """
    is_chosen, row_of_pair, pair_of_row = served
    for i in chosen:
        is_chosen[near[i]] = True
    _empty_rows(served, rows)
    for i in range(near.size):
        pair = near[i]
        if not is_chosen[pair]:
            for entry in range(between.start[pair], between.start[pair + 1]):
                k = between.column[entry]
                share[k] = min(share[k], max(braking[1, i], braking[2, i]))
    free = 0
    for i in chosen:
        pair = near[i]
        is_chosen[pair] = False
        if row_of_pair[pair] < 0:
            while pair_of_row[free] >= 0:
                free += 1
            row_of_pair[pair], pair_of_row[free] = free, pair
        row = row_of_pair[pair]
        for entry in range(between.start[pair], between.start[pair + 1]):
            k = between.column[entry]
            rows.A[row, k] = gradient[pair, k]
        rows.lower[row], rows.label[row] = braking[0, i], pair + 1.0


@kernel
def _empty_rows(served, rows):
    """Empty the rows whose pairs are not chosen."""
    for row in range(served.pair_of_row.size):
        pair = served.pair_of_row[row]
        if pair >= 0 and served.is_chosen[pair]:
            continue
        if pair >= 0:
            served.row_of_pair[pair] = served.pair_of_row[row] = -1
        rows.A[row, :] = 0.0
        rows.lower[row] = -np.inf
        rows.label[row] = 0.0
