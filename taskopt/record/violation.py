"""How near a run comes to its limits, and how far it leaves them, measured after each Euler step."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import BoundLimit, JointPositionLimit
from taskopt.record.batch import Batch, Mask
from taskopt.record.recorder import RunInfo


@dataclass(frozen=True, eq=False)
class LimitGauge:
    """Positions and velocities of a run beside the limits: of the robot, and of the stack's own."""

    info: RunInfo

    @cached_property
    def velocity_box(self) -> Array:
        """(2, nv) lower and upper bounds on velocity that never change, of all limits of the stack."""
        scenario = self.info.scenario
        at = Configuration(scenario.robot, scenario.start)
        bounds = np.repeat([[-np.inf], [np.inf], [0.0], [0.0]], scenario.robot.nv, axis=1)
        for bound in self.info.plan.limits:
            if isinstance(bound, BoundLimit) and bound.constant:
                bound.narrow(at, bounds, 1)
        return bounds[:2]

    @cached_property
    def moving(self) -> Mask:
        """(nv,) whether a coordinate has two position limits that differ."""
        robot = self.info.scenario.robot
        width = robot.position_upper - robot.position_lower
        return (robot.position_index >= 0) & np.isfinite(width) & (width > 0.0)

    @cached_property
    def fast(self) -> Mask:
        """(nv,) whether the stack bounds a velocity on both sides."""
        return np.isfinite(self.velocity_box).all(axis=0) & (self.velocity_box[0] < self.velocity_box[1])

    @cached_property
    def keeps_positions(self) -> bool:
        """Whether the stack declares position limits."""
        return any(isinstance(limit, JointPositionLimit) for limit in self.info.scenario.stack.limits)

    def position_share(self, q: Array) -> Array:
        """q (k, nq) of the `moving` joints as a share of the range: −1 lower limit, +1 upper limit."""
        robot = self.info.scenario.robot
        lower, upper = robot.position_lower[self.moving], robot.position_upper[self.moving]
        return (2.0 * q[:, robot.position_index[self.moving]] - lower - upper) / (upper - lower)

    def velocity_share(self, v: Array) -> Array:
        """v (k, nv) of the `fast` coordinates as a share of their bounds: −1 lower, +1 upper."""
        lower, upper = self.velocity_box[:, self.fast]
        return (2.0 * v[:, self.fast] - lower - upper) / (upper - lower)

    def position_violation(self, batch: Batch) -> Array:
        """Largest distance to the robot's position limits after each step, (k,) ≥ 0 [rad, m]."""
        robot = self.info.scenario.robot
        has = robot.position_index >= 0
        at = batch.q_next[:, robot.position_index[has]]
        over = np.maximum(at - robot.position_upper[has], robot.position_lower[has] - at)
        return over.max(axis=1, initial=0.0)

    def velocity_violation(self, batch: Batch) -> Array:
        """Largest excess over the stack's constant velocity bounds, (k,) ≥ 0 [rad/s, m/s]."""
        lower, upper = self.velocity_box
        return np.maximum(batch.v - upper, lower - batch.v).max(axis=1, initial=0.0)
