"""Distances of the pairs that are near at a configuration, and lower bounds for all other pairs."""

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.jit import kernel_apart
from taskopt.kinematics.collision.broad_phase import BroadPhase
from taskopt.kinematics.collision.measure import Distances, Measured, has_no_normal, line_of, slope_of
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.step_bounds import Between
from taskopt.kinematics.configuration import Configuration


class NearDistances(Distances):
    """Signed distances and gradients of the pairs that are nearer than their thresholds.

    `update_near` measures only the pairs that the broad phase cannot exclude. `update` measures all pairs, as
    in `Distances`.

    Attributes:
        near: Indices of the pairs that were measured, and of those that were near and have not moved, as of
            the last `update_near`.
    """

    def __init__(self, collision: Collision, between: Between, threshold: Array) -> None:
        """Allocate the memory.

        Args:
            collision: The P pairs.
            between: The velocities that change their distances.
            threshold: (P,) distance of each pair beyond which it need not be measured [m].
        """
        super().__init__(collision)
        self.broad_phase, self.between = BroadPhase(collision, between, threshold), between
        self.near: IntArray = np.empty(0, np.int64)
        self._configuration: Configuration | None = None

    def update_near(self, configuration: Configuration) -> None:
        """Measure the pairs that may be nearer than their thresholds, in place.

        Args:
            configuration: The robot at q.
        """
        doubtful, unmoved = self.broad_phase.update(configuration)
        self._measure(configuration, doubtful)
        self.near = np.concatenate([doubtful, unmoved])
        self._configuration = configuration

    def measured(self) -> Measured:
        """Copy distances and nearest points, after `update_near`.

        They are exact for the pairs that are nearer than their thresholds, and for the nearest of all. For
        any other pair, the distance is a lower bound, and the nearest points are those of an earlier tick.
        """
        configuration = self._configuration
        if configuration is None:
            return super().measured()
        self._measure(configuration, self.near)
        self.distance[:] = self.broad_phase.bound()
        exact = np.zeros(self.distance.size, dtype=bool)
        exact[self.near] = True
        while not exact[nearest := int(self.distance.argmin())]:
            self._measure(configuration, np.array([nearest]))
            exact[nearest] = True
        return super().measured()

    def _measure(self, configuration: Configuration, pairs: IntArray) -> None:
        """Measure some pairs, in place."""
        if not pairs.size:
            return
        collision, J = self.collision, configuration.joint_jacobians
        collision.update_some(configuration.data, pairs)
        known = pairs, collision.contact, collision.crossed, self.between, J, self.distance, self.gradient
        if some_distances_into(*known):
            collision.remeasure(pairs)
            some_distances_into(*known)
        self.broad_phase.learn(pairs, self.distance)


@kernel_apart
def some_distances_into(pairs, contact, crossed, between, J, distance, gradient):
    """Compute d and ∂d/∂q of some pairs, as `distances_into` does for all pairs.

    Args:
        pairs: Indices of the pairs.
        contact: (P, 9) unit normal n, nearest points p₁ and p₂ [m], in the world.
        crossed: (P,) distance of pairs without a normal [m].
        between: The velocities that change each distance.
        J: (6, nv) joint Jacobians at the origin of the world; column k is (v_k, ω_k).
        distance: (P,) receives d of these pairs [m].
        gradient: (P, nv) receives ∂d/∂q of these pairs; entries that are always zero are not written.

    Returns:
        True if nearest points of a pair coincide or are NaN, so that it must be measured again.
    """
    doubtful = False
    for i in pairs:
        line, apart = line_of(contact[i])
        doubtful |= not apart > 0.0
        distance[i] = crossed[i] if has_no_normal(line) else line[6]
        for entry in range(between.start[i], between.start[i + 1]):
            k = between.column[entry]
            gradient[i, k] = between.sign[entry] * slope_of(line, J, k)
    return doubtful
