"""Obstacles that move while a stack runs, and what their motion does to distances in one step."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.geometry.coal import ball_around, core
from taskopt.kinematics.parameter import Setting
from taskopt.kinematics.pose import is_pose
from taskopt.kinematics.redirection import TargetParameter, go_on, recalled, still
from taskopt.kinematics.space import PoseSpace, Value
from taskopt.kinematics.target import Course, Hold, Latest, Target

_STILL = still, still


class Mover:
    """One obstacle that follows a target.

    Its velocity over a step is that which leads from its pose at t to its pose at t + Δt. A `Latest`, which
    knows no later pose, gives the velocity that was set with its pose.

    Attributes:
        name: Name of the obstacle.
        shape: Place of the obstacle among the solids of a `Collision`.
        pairs: The pairs of the obstacle.
        twist: Velocity of its origin [m/s] and angular velocity [rad/s], along the axes of the world, (6,).
        pose: Its pose, (4, 4) in the world [m].
    """

    _courses: tuple[Course, Course]  # of the present pose, and of the pose at the next tick
    _redirected: bool | None

    def __init__(self, collision: Collision, shape: int, name: str, target: Target) -> None:
        """Place the obstacle where it was declared.

        Args:
            collision: The pairs.
            shape: Place of the obstacle among their solids.
            name: Name of the obstacle.
            target: Target of its pose.

        Raises:
            InvalidValue: The target does not fit a pose.
        """
        self.name, self.shape, self._collision, self._target = name, shape, collision, target
        self.pairs = np.array([i for i, pair in enumerate(collision.pairs) if pair[1] == shape])
        self._solid = collision.shapes.geometryObjects[shape]
        self._reach = ball_around(self._solid)[1]  # its frame is in its middle
        sizes = [core(collision.shapes.geometryObjects[collision.pairs[i][0]]) for i in self.pairs]
        self._diameter = np.array(sizes).reshape(-1, 2) @ [1.0, 2.0]
        self._core = np.array(sizes).reshape(-1, 2)[:, 0]
        self._space = PoseSpace(f"the pose of {self.name}")
        self._begin = np.array(self._solid.placement.homogeneous)
        self.pose, self._next = self._begin.copy(), np.eye(4)
        self._rate, self.twist = np.zeros(6), np.zeros(6)
        self.start(0.0)

    def start(self, t: float) -> None:
        """Begin the declared target at the pose with which the obstacle was declared.

        Args:
            t: Time of the start [s].

        Raises:
            InvalidValue: The target does not fit a pose.
        """
        self.pose[:], self._courses = self._begin, _STILL
        self.redirect(self._target, t)
        self._redirected = None

    def redirect(self, target: Target | Array, t: float) -> None:
        """Replace the target at the beginning of a tick.

        Args:
            target: A `Target`, which begins at the present pose; or a pose (4, 4) to hold, at which the
                obstacle is at once, with the velocity 0.
            t: Time [s].

        Raises:
            InvalidValue: The target does not fit a pose.
        """
        if isinstance(target, np.ndarray):
            self.pose[...] = target
            self._courses, self._foresees, self._redirected = _STILL, False, False
        else:
            now = self._courses[0]
            self._courses = tuple(go_on(target, now, self._space, self.pose, t) for _ in range(2))
            self._foresees, self._redirected = not isinstance(target, Latest), not isinstance(target, Hold)

    def adjustable(self) -> TargetParameter:
        """Return the pose as a parameter."""
        return _Pose(self.name, self.pose, self._space, self.redirect)

    def recall(self) -> Array | None:
        """Return the pose to which the obstacle was set while the stack ran, or None; see `recalled`."""
        return recalled(self.name, self.pose, self._redirected)

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
            what = f"the pose of {self.name} at t = {t:.6g} s"
            raise InvalidValue(f"{what} is not finite; look at its target")
        if np.isinf(self._reach) and self.twist[3:].any():
            raise InvalidValue(f"{self.name} is a half-space and must not turn; use a box instead")
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


class _Pose(TargetParameter):
    """The parameter "pose" of an obstacle, whose values are checked when they are set, and not later."""

    def checked(self, value: Setting, over: float) -> Target | Array:
        """Return a `Target`, or a pose to hold; see `Parameter.checked`."""
        if over > 0.0 or not isinstance(value, np.ndarray):
            return super().checked(value, over)
        if value.dtype == np.float64 and value.shape == (4, 4):
            pose = value.copy()
            if is_pose(pose):  # thirty times as fast as `convert`, which says what is wrong
                return pose
        return self._space.convert(cast("Value", value), self._goal)


def movers_of(collision: Collision, names: Sequence[str], targets: Mapping[int, Target]) -> tuple[Mover, ...]:
    """Make the obstacles of a `Collision` that move.

    Args:
        collision: Pairs of links and obstacles; the obstacles are the last of its solids.
        names: Names of all obstacles.
        targets: Targets of poses by the number of the obstacle.

    Returns:
        The movers.

    Raises:
        InvalidValue: A target does not fit a pose.
    """
    first = len(collision.shapes.geometryObjects) - len(names)
    return tuple(Mover(collision, first + i, names[i], target) for i, target in targets.items())
