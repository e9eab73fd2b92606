"""The broad phase, which finds the pairs of solids that can be near without measuring the others.

Each pair has a threshold, beyond which its distance does not matter. A lower bound of its distance is kept
from the last time that the pair was examined, and is reduced by the motion since then. A pair is measured
only if neither that bound nor the distance of the spheres around its two solids shows that it is beyond its
threshold. Three bounds are tried, the cheapest first: the paths of the two solids in the world, the turns of
the joints between them times their reach, and the spheres.

Source: bounds on motion as in conservative advancement, Mirtich (1996), Impulse-based Dynamic Simulation of
Rigid Body Systems, PhD thesis, University of California at Berkeley, section 2.3.
"""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from enum import IntEnum

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.jit import kernel, kernel_apart
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.step_bounds import Between
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.coal import ball_around


class Known(IntEnum):
    """Rows of the array (5, P) with the bounds and thresholds of all P pairs."""

    THRESHOLD = 0  # [m]
    DUE = 1  # the pair is looked at when the ways of its solids exceed this [m]
    BOUND = 2  # lower bound of the distance when the pair was last looked at [m]
    TRAVEL = 3  # Σ ρ |q̇| over all time until then [m]
    MEASURED = 4  # 1 if the bound is the distance itself, else 0


class Ball(IntEnum):
    """Columns of the array (S, 21) of the balls around the solids."""

    JOINT = 0
    CENTRE = 1  # (3,) in the frame of the joint [m]
    RADIUS = 4  # [m]
    WAY = 5  # bound on the way that any point of the solid has made so far [m]
    PLACE = 6  # (12,) pose of its joint, as in `Configuration.joint_placements`; then its centre in the world


class BroadPhase:
    """Find the pairs that are nearer than their thresholds.

    Attributes:
        collision: The P pairs.
        between: The velocities that change their distances.
    """

    def __init__(self, collision: Collision, between: Between, threshold: Array) -> None:
        """Allocate the memory, in which no pair has a bound yet.

        Args:
            collision: The P pairs.
            between: The velocities that change their distances.
            threshold: (P,) distance of each pair beyond which it need not be measured [m].
        """
        self.collision, self.between = collision, between
        count = len(collision.pairs)
        shapes = collision.shapes.geometryObjects
        self._balls = np.zeros((len(shapes), 21))
        for ball, shape in zip(self._balls, shapes, strict=True):
            centre, radius = ball_around(shape)
            ball[Ball.JOINT], ball[Ball.RADIUS] = shape.parentJoint, radius
            ball[Ball.CENTRE : Ball.CENTRE + 3] = centre
        self._solids = np.array(collision.pairs, dtype=np.int64).reshape(-1, 2)
        self._known = np.zeros((len(Known), count))
        self._known[Known.THRESHOLD] = threshold
        self._known[Known.DUE], self._known[Known.BOUND] = -np.inf, -np.inf
        self._turned = np.zeros(collision.robot.nv)
        self._q = collision.robot.neutral.copy()
        self._sorted = np.empty((2, count), np.int64)

    def expect(self, threshold: Array) -> None:
        """Change the thresholds; the bounds on the distances are kept.

        Args:
            threshold: (P,) distance of each pair beyond which it need not be measured [m].
        """
        self._known[Known.THRESHOLD] = threshold
        self._known[Known.DUE] = -np.inf  # so that every pair is compared with its new threshold

    def update(self, configuration: Configuration) -> tuple[IntArray, IntArray]:
        """Sort the pairs at a configuration.

        Args:
            configuration: The robot at q.

        Returns:
            Indices of the pairs that must be measured, and of those that were nearer than their thresholds at
            the last measurement and have not moved since.
        """
        moved = self.collision.robot.difference(self._q, configuration.q)
        self._q[:] = configuration.q
        doubtful, unmoved = sort_pairs(
            configuration.joint_placements, moved, self._turned, self._balls, self._solids, self.between,
            self._known, self._sorted,
        )  # fmt: skip
        return self._sorted[0, :doubtful], self._sorted[1, :unmoved]

    def learn(self, pairs: IntArray, distance: Array) -> None:
        """Take measured distances for bounds.

        Args:
            pairs: The pairs that were measured.
            distance: (P,) the distances of all pairs [m], of which only those of `pairs` are read.
        """
        learn_into(pairs, distance, self._balls, self._solids, self._known)

    def bound(self) -> Array:
        """Return a lower bound of the distance of each pair as of the last `update`, (P,) [m].

        It is the distance itself for pairs that are nearer than their thresholds.
        """
        start = self.between.start[:-1]
        travel = np.add.reduceat(self.between.reach * self._turned[self.between.column], start)
        standing = self._balls[self._solids, Ball.JOINT] == 0.0
        travel += np.where(standing, self._balls[self._solids, Ball.WAY], 0.0).sum(axis=1)
        return self._known[Known.BOUND] - (travel - self._known[Known.TRAVEL])


@kernel_apart
def sort_pairs(placements, moved, turned, balls, solids, between, known, found):
    """Move the balls, and sort the pairs that may be nearer than their thresholds.

    Args:
        placements: (joints + 1, 12) poses of the joints, see `Configuration`.
        moved: (nv,) motion since the last call [rad, m].
        turned: (nv,) sum of |moved| over all calls [rad, m], updated here.
        balls: (S, 21) balls around the solids, see `Ball`; paths and poses are updated here.
        solids: (P, 2) indices of the two solids of each pair.
        between: The velocities that change each distance.
        known: (5, P), see `Known`; bounds change here.
        found: (2, P) receives the indices of the pairs that must be measured, and of those whose last
            measurement is still valid.

    Returns:
        The number of pairs that must be measured, and the number of those that have not moved.
    """
    if not (_add_turns(moved, turned) and _move_balls(placements, balls)):  # NaN: nothing is known any more
        known[Known.DUE, :] = -np.inf
        known[Known.BOUND, :] = -np.inf
        known[Known.MEASURED, :] = 0.0
    doubtful_count = unmoved_count = 0
    for p in range(solids.shape[0]):
        a, b = solids[p, 0], solids[p, 1]
        ways = balls[a, Ball.WAY] + balls[b, Ball.WAY]
        if ways < known[Known.DUE, p]:
            continue
        threshold, travel = (
            known[Known.THRESHOLD, p],
            _travel_of(p, turned, between, balls, a, b),
        )
        lower = known[Known.BOUND, p] - (travel - known[Known.TRAVEL, p])
        if not lower >= threshold:
            if travel == known[Known.TRAVEL, p] and known[Known.MEASURED, p] == 1.0:
                found[1, unmoved_count] = p
                unmoved_count += 1
                continue
            lower = _gap(balls, a, b)
            known[Known.TRAVEL, p] = travel
            known[Known.BOUND, p] = lower
            known[Known.MEASURED, p] = 0.0
            if not lower >= threshold:
                found[0, doubtful_count] = p
                doubtful_count += 1
                continue
        known[Known.DUE, p] = lower - threshold + ways
    return doubtful_count, unmoved_count


@kernel
def _add_turns(moved, turned):
    """Add |moved| (nv,) to `turned` (nv,); return False if one of them is NaN or infinite."""
    good = True
    for k in range(moved.size):
        if abs(moved[k]) < np.inf:
            turned[k] += abs(moved[k])
        else:
            good = False
    return good


@kernel
def _move_balls(placements, balls):
    """Move the balls (S, 21) with their joints, and lengthen their paths; return False if one is NaN."""
    good = True
    for s in range(balls.shape[0]):
        ball, place = balls[s], placements[int(balls[s, Ball.JOINT])]
        turn = shift = 0.0
        for i in range(9):
            turn += (place[i] - ball[Ball.PLACE + i]) ** 2
        for i in range(3):
            centre = place[9 + i]
            for j in range(3):
                centre += place[3 * j + i] * ball[Ball.CENTRE + j]
            shift += (centre - ball[Ball.PLACE + 12 + i]) ** 2
            ball[Ball.PLACE + 12 + i] = centre
        for i in range(12):
            ball[Ball.PLACE + i] = place[i]
        way = np.sqrt(shift)
        if turn > 0.0:
            way += np.sqrt(0.5 * turn) * ball[Ball.RADIUS]  # ‖ΔR‖ = ‖ΔR‖_F/√2 for rotations
        if way < np.inf:
            ball[Ball.WAY] += way
        else:
            good = False
    return good


@kernel
def _travel_of(p, turned, between, balls, a, b):
    """Return Σ ρ |q̇| of pair p over all time, plus the paths of solids that are obstacles [m]."""
    travel = 0.0
    for i in range(between.start[p], between.start[p + 1]):
        travel += between.reach[i] * turned[between.column[i]]
    if balls[a, Ball.JOINT] == 0.0:
        travel += balls[a, Ball.WAY]
    if balls[b, Ball.JOINT] == 0.0:
        travel += balls[b, Ball.WAY]
    return travel


@kernel
def _gap(balls, a, b):
    """Return the distance between the balls around two solids [m]; −inf if one of them is unbounded."""
    square = 0.0
    for i in range(3):
        square += (balls[a, Ball.PLACE + 12 + i] - balls[b, Ball.PLACE + 12 + i]) ** 2
    return np.sqrt(square) - balls[a, Ball.RADIUS] - balls[b, Ball.RADIUS]


@kernel_apart
def learn_into(pairs, distance, balls, solids, known):
    """Take measured distances for bounds.

    Args:
        pairs: The pairs that were measured.
        distance: (P,) distances [m].
        balls: (S, 21), see `Ball`.
        solids: (P, 2) indices of the two solids of each pair.
        known: (5, P), see `Known`; bounds change here.
    """
    for p in pairs:
        ways = balls[solids[p, 0], Ball.WAY] + balls[solids[p, 1], Ball.WAY]
        known[Known.BOUND, p] = distance[p]
        known[Known.MEASURED, p] = 1.0
        known[Known.DUE, p] = distance[p] - known[Known.THRESHOLD, p] + ways
