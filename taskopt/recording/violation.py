"""Positions and velocities of a run in relation to the limits of the robot and of the stack."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from taskopt.arrays import Array, Mask
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import BoundLimit, JointAccelerationLimit, JointPositionLimit
from taskopt.kinematics.limit.acceleration import BoundJointAcceleration
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo


@dataclass(frozen=True, eq=False)
class LimitGauge:
    """Measure positions and velocities of a run relative to its limits.

    Attributes:
        info: The facts about the run: the robot has the position limits, the stack the velocity limits.
    """

    info: RunInfo

    @cached_property
    def velocity_box(self) -> Array:
        """The lower and upper bounds on velocities that never change, (2, nv) [rad/s, m/s].

        A velocity without a constant bound has −inf and inf.
        """
        scenario = self.info.scenario
        configuration = Configuration(scenario.robot, scenario.start)
        bounds = np.repeat([[-np.inf], [np.inf], [0.0], [0.0]], scenario.robot.nv, axis=1)
        for bound in self.info.plan.limits:
            if isinstance(bound, BoundLimit) and bound.constant:
                bound.narrow(configuration, bounds, 1)
            elif isinstance(bound, BoundJointAcceleration):  # it also holds the speed, which never changes
                np.maximum(bounds[0], -bound.fastest, out=bounds[0])
                np.minimum(bounds[1], bound.fastest, out=bounds[1])
        return bounds[:2]

    @cached_property
    def ranged(self) -> Mask:
        """True for a coordinate with two finite position limits that differ, (nv,)."""
        robot = self.info.scenario.robot
        width = robot.position_upper - robot.position_lower
        return (robot.position_index >= 0) & np.isfinite(width) & (width > 0.0)

    @cached_property
    def bounded(self) -> Mask:
        """True for a velocity that the stack bounds on both sides, (nv,)."""
        return np.isfinite(self.velocity_box).all(axis=0) & (self.velocity_box[0] < self.velocity_box[1])

    @cached_property
    def acceleration_limit(self) -> Array:
        """The largest accelerations that the stack allows, (nv,) [rad/s², m/s²]; inf where there is none."""
        least = np.full(self.info.scenario.robot.nv, np.inf)
        for bound in self.info.plan.limits:
            if isinstance(bound, BoundJointAcceleration):
                np.minimum(least, bound.strongest, out=least)
        return least

    @cached_property
    def accelerations_bounded(self) -> Mask:
        """True for a velocity whose acceleration the stack bounds, (nv,)."""
        return np.isfinite(self.acceleration_limit)

    @cached_property
    def keeps_positions(self) -> bool:
        """True if the stack declares limits that hold the positions."""
        holding = JointPositionLimit | JointAccelerationLimit
        return any(isinstance(limit, holding) for limit in self.info.scenario.stack.limits)

    def position_share(self, q: Array) -> Array:
        """Scale positions to their ranges: (2 q − lower − upper)/(upper − lower).

        Args:
            q: Configurations, (k, nq) [rad, m].

        Returns:
            The positions of the `ranged` coordinates, (k, r): −1 at the lower limit, +1 at the upper one.
        """
        robot = self.info.scenario.robot
        lower, upper = robot.position_lower[self.ranged], robot.position_upper[self.ranged]
        return (2.0 * q[:, robot.position_index[self.ranged]] - lower - upper) / (upper - lower)

    def velocity_share(self, v: Array) -> Array:
        """Scale velocities to their bounds: (2 v − lower − upper)/(upper − lower).

        Args:
            v: Velocities, (k, nv) [rad/s, m/s].

        Returns:
            The `bounded` velocities, (k, b): −1 at the lower bound, +1 at the upper one.
        """
        lower, upper = self.velocity_box[:, self.bounded]
        return (2.0 * v[:, self.bounded] - lower - upper) / (upper - lower)

    def acceleration_share(self, a: Array) -> Array:
        """Divide accelerations by their limits.

        Args:
            a: Accelerations, (k, nv) [rad/s², m/s²].

        Returns:
            Those that are bounded, (k, b): −1 at the lower bound, +1 at the upper one.
        """
        return a[:, self.accelerations_bounded] / self.acceleration_limit[self.accelerations_bounded]

    def position_violation(self, batch: Batch) -> Array:
        """Measure the excess of positions over the robot's limits after each step.

        Args:
            batch: k steps of one resolver.

        Returns:
            The largest excess over all coordinates, (k,) ≥ 0 [rad, m].
        """
        robot = self.info.scenario.robot
        has = robot.position_index >= 0
        q = batch.q_next[:, robot.position_index[has]]
        excess = np.maximum(q - robot.position_upper[has], robot.position_lower[has] - q)
        return excess.max(axis=1, initial=0.0)

    def velocity_violation(self, batch: Batch) -> Array:
        """Measure the excess of velocities over the constant bounds of the stack.

        Args:
            batch: k steps of one resolver.

        Returns:
            The largest excess over all velocities, (k,) ≥ 0 [rad/s, m/s].
        """
        lower, upper = self.velocity_box
        return np.maximum(batch.v - upper, lower - batch.v).max(axis=1, initial=0.0)
