"""Limits on positions and on velocities of joints, as bounds on velocity."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, ArrayLike, bound, positive
from taskopt.errors import InvalidValue
from taskopt.jit import kernel_apart
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.base import BoundLimit, Limit, narrow_one
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True)
class JointPositionLimit(Limit):
    """Approach a joint limit no faster than a fraction κ of what is left per step.

        κ (q_min − q)/Δt ≤ v ≤ κ (q_max − q)/Δt

    Both sides are clipped so that v = 0 stays allowed: a joint outside its range may stop or return. Bounds
    [rad/s, m/s] on the velocity of each joint that has a limit; continuous joints and free-flyers have none.

    Args:
        gain: κ in (0, 1]. At 1 a joint may reach its limit in one step; less lets it come closer
            geometrically, and brake earlier.
        name: Name in explanations, logs and plots.

    Raises:
        InvalidValue: `gain` is out of its range.

    Source:
        The velocity damper of Faverjon and Tournassoud (1987), IEEE International Conference on Robotics and
        Automation, in the discrete form of Kanoun (2012), Robotics: Science and Systems VII.
    """

    gain: float = 1.0
    name: str = "joint_position"

    def __post_init__(self) -> None:
        if positive("gain", self.gain) > 1.0:
            raise InvalidValue(f"gain of a position limit must be in (0, 1], got {self.gain:g}")

    def bind(self, robot: Robot, dt: float) -> "BoundJointPosition":
        """Return the bounds for a robot; see `Limit.bind`."""
        return BoundJointPosition(robot, self.name, self.gain / dt)


class BoundJointPosition(BoundLimit):
    """Bounds κ (q_min − q)/Δt and κ (q_max − q)/Δt for the joints that have a limit.

    Args:
        robot: The robot.
        name: Name of the limit.
        rate: κ/Δt [1/s].
    """

    def __init__(self, robot: Robot, name: str, rate: float) -> None:
        super().__init__(name)
        limited = np.isfinite(robot.position_lower) | np.isfinite(robot.position_upper)
        columns = np.flatnonzero(limited & (robot.position_index >= 0))
        limits = np.column_stack([robot.position_lower[columns], robot.position_upper[columns]])
        self.kernel = narrow_by_position
        self.parameters = np.column_stack([columns, robot.position_index[columns]]).ravel()
        self.memory = np.concatenate([[rate], limits.ravel()])


@kernel_apart
def narrow_by_position(parameters, memory, state, bounds, owner):
    """Narrow the bounds of a `JointPositionLimit`.

    Args:
        parameters: For each joint its column of v and its place in q.
        memory: κ/Δt [1/s], then q_min and q_max of each joint [rad, m].
        state: The robot, see `RobotState`.
        bounds: (4, nv), see `BoundLimit.narrow`.
        owner: Number of the limit.
    """
    rate = memory[0]
    for i in range(parameters.size // 2):
        q = state.q[parameters[2 * i + 1]]
        lower = min(rate * (memory[2 * i + 1] - q), 0.0)
        upper = max(rate * (memory[2 * i + 2] - q), 0.0)
        narrow_one(bounds, parameters[2 * i], lower, upper, owner)


@dataclass(frozen=True, eq=False)
class JointVelocityLimit(Limit):
    """Keep every joint velocity within −s v_max ≤ v ≤ s v_max [rad/s, m/s].

    Args:
        scale: s > 0. More allows faster motion.
        velocity: v_max: one number for all, one for each velocity (nv,), or a mapping from joint to number
            that replaces the robot's there; inf is no limit. Default: the robot's own.
        name: Name in explanations, logs and plots.

    Raises:
        InvalidValue: A number is out of its range.
    """

    scale: float = 1.0
    velocity: ArrayLike | Mapping[str, float] | None = None
    name: str = "joint_velocity"

    def __post_init__(self) -> None:
        positive("scale", self.scale)

    def bind(self, robot: Robot, dt: float) -> "BoundJointVelocity":  # noqa: ARG002
        """Return the bounds for a robot; see `Limit.bind`.

        Raises:
            InvalidValue: A number of `velocity` is negative or NaN, or there are too many or too few.
            UnknownName: A mapping names a joint that the robot has not.
        """
        limits = each_velocity("velocity", self.velocity, robot, robot.velocity_limit)
        return BoundJointVelocity(self.name, self.scale * limits)


def each_velocity(
    what: str, value: ArrayLike | Mapping[str, float] | None, robot: Robot, default: Array
) -> Array:
    """Return one number ≥ 0 for each velocity.

    Args:
        what: Name of the value, for messages.
        value: One number for all velocities, one for each (nv,), or a mapping from joint to number; joints
            that the mapping does not name, or all if it is None, have the default.
        robot: The robot.
        default: Numbers for velocities without a given one, (nv,).

    Returns:
        The numbers (nv,); inf stands for no limit.

    Raises:
        InvalidValue: A number is negative or NaN, or there are neither one nor nv numbers.
        UnknownName: The mapping names a joint that the robot does not have.
    """
    if value is None:
        return default
    if isinstance(value, Mapping):
        limits = default.copy()
        for joint, number in value.items():
            limits[robot.velocity_index(joint)] = number
    elif np.ndim(value) == 0:
        limits = np.full(robot.nv, value, dtype=np.float64)
    else:
        limits = np.asarray(value)
    limits = bound(what, limits, (robot.nv,))
    if (limits < 0.0).any():
        raise InvalidValue(f"{what} of a limit must be ≥ 0, got {limits.min():g}")
    return limits


class BoundJointVelocity(BoundLimit):
    """Bounds that never change.

    Args:
        name: Name of the limit.
        limits: Largest speed of each velocity, (nv,) [rad/s, m/s].
    """

    constant = True

    def __init__(self, name: str, limits: Array) -> None:
        super().__init__(name)
        self._limits = limits

    def narrow(self, configuration: Configuration, bounds: Array, owner: int) -> None:  # noqa: ARG002
        """Narrow the bounds in place; see `BoundLimit.narrow`."""
        for row, limit, tighter in ((0, -self._limits, np.greater), (1, self._limits, np.less)):
            binds = tighter(limit, bounds[row])
            bounds[row, binds], bounds[row + 2, binds] = limit[binds], owner
