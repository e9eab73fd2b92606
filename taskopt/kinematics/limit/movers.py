"""Obstacles that move while a stack runs, and what their motion does to distances in one step."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.geometry.coal import ball_around, core
from taskopt.kinematics.space import PoseSpace
from taskopt.kinematics.target import Latest, Target


class Mover:
    """One obstacle that follows a target.

    Its velocity over a step is that which leads from its pose at t to its pose at t + Δt. A `Latest`, which
    knows no later pose, gives the velocity that was set with its pose.

    Attributes:
        shape: Place of the obstacle among the solids of a `Collision`.
        pairs: The pairs of the obstacle.
        twist: Velocity of its origin [m/s] and angular velocity [rad/s], along the axes of the world, (6,).
        pose: Its pose, (4, 4) in the world [m].
    """

    def __init__(self, collision: Collision, shape: int, target: Target) -> None:
        """Begin the target at the pose with which the obstacle was declared, at the time 0 s.

        Args:
            collision: The pairs.
            shape: Place of the obstacle among their solids.
            target: Target of its pose.

        Raises:
            InvalidValue: The target does not fit a pose.
        """
        self.shape, self._collision = shape, collision
        self.pairs = np.array([i for i, pair in enumerate(collision.pairs) if pair[1] == shape])
        self._solid = collision.shapes.geometryObjects[shape]
        self._reach = ball_around(self._solid)[1]  # its frame is in its middle
        sizes = [core(collision.shapes.geometryObjects[collision.pairs[i][0]]) for i in self.pairs]
        self._diameter = np.array(sizes).reshape(-1, 2) @ [1.0, 2.0]
        self._core = np.array(sizes).reshape(-1, 2)[:, 0]
        self._space = PoseSpace(f"the pose of {self._solid.name}")
        begin = np.array(self._solid.placement.homogeneous)
        self._courses = [target.start(self._space, begin, 0.0) for _ in range(2)]
        self._foresees = not isinstance(target, Latest)
        self.pose, self._next, self._rate, self.twist = begin, begin.copy(), np.zeros(6), np.zeros(6)

    def move(self, t: float, dt: float) -> None:
        """Place the obstacle at the time t, and find its velocity until t + Δt.

        Args:
            t: Time [s].
            dt: Δt [s].

        Raises:
            InvalidValue: A pose is not finite, or a half-space turns.
        """
        moving = self._courses[0](t, self.pose, self._rate)
        if self._foresees:
            self._courses[1](t + dt, self._next, np.empty(6))
            self.twist[:] = self._space.difference(self.pose, self._next) / dt
        else:
            self.twist[:] = self._rate if moving else 0.0
        if not (np.isfinite(self.pose).all() and np.isfinite(self.twist).all()):
            what = f"the pose of {self._solid.name} at t = {t:.6g} s"
            raise InvalidValue(f"{what} is not finite; look at its target")
        if np.isinf(self._reach) and self.twist[3:].any():
            raise InvalidValue(f"{self._solid.name} is a half-space and must not turn; use a box instead")
        self._solid.placement = pin.SE3(self.pose)

    def loss(self, dt: float, travel: Array, influence: Array, distance: Array) -> Array:
        """Bound what the motion of the obstacle takes from distances in a step, besides the `drift`.

        A plane that separates two solids and goes with the obstacle loses nothing to its translation. By its
        rotation at |ω|, points of a link whose core has the diameter ℓ lose Δt |ω| (ℓ + ½ Δt |ω| R + travel),
        with R their largest distance from the middle of the obstacle. Pairs beyond the influence have no
        drift in their rows, and lose the whole way of the obstacle.

        Args:
            dt: Δt [s].
            travel: Travel of all pairs, see `StepLosses` (P,) [m].
            influence: Influence of all pairs, (P,) [m].
            distance: d of all pairs, (P,) [m].

        Returns:
            The loss of each of `pairs` [m].
        """
        pairs, spin = self.pairs, float(np.linalg.norm(self.twist[3:]))
        speed = float(np.linalg.norm(self.twist[:3])) + (spin * self._reach if spin else 0.0)
        turned = 0.0
        if spin:
            R = self._diameter + influence[pairs] + self._reach
            turned = dt * spin * (self._core + 0.5 * dt * spin * R + travel[pairs])
        return np.where(distance[pairs] < influence[pairs], turned, dt * speed)

    def drift(self) -> Array:
        """Compute n · (v + ω × (p₂ − o)), the rate of each distance by the motion of the obstacle [m/s]."""
        contact = self._collision.contact[self.pairs]
        point = contact[:, 6:9] - self.pose[:3, 3]
        velocity = self.twist[:3] + np.cross(self.twist[3:], point)
        return np.asarray((contact[:, :3] * velocity).sum(axis=1))


def movers_of(collision: Collision, first: int, targets: Mapping[int, Target]) -> tuple[Mover, ...]:
    """Make the obstacles of a `Collision` that move.

    Args:
        collision: Pairs of links and obstacles.
        first: Place of the first obstacle among the solids.
        targets: Targets of poses by the number of the obstacle.

    Returns:
        The movers.

    Raises:
        InvalidValue: A target does not fit a pose.
    """
    return tuple(Mover(collision, first + number, target) for number, target in targets.items())
