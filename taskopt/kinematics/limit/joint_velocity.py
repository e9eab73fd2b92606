"""Joint velocity limits."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, bound, positive
from taskopt.errors import InvalidValue
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True, eq=False)
class JointVelocityLimit:
    """−s v_max ≤ v ≤ s v_max with v_max [rad/s, m/s] from the robot, or from `velocity`.

    `velocity`: one number for all, one a velocity (nv,), or a mapping from joint to number that replaces
    the robot's there; inf is no limit. `scale` is s > 0.
    """

    scale: float = 1.0
    velocity: ArrayLike | Mapping[str, float] | None = None
    name: str = "joint_velocity"

    def __post_init__(self) -> None:
        positive("scale", self.scale)

    def bind(self, robot: Robot, dt: float) -> "BoundJointVelocity":  # noqa: ARG002 (protocol)
        limits = each_velocity("velocity", self.velocity, robot, robot.velocity_limit)
        return BoundJointVelocity(self.name, self.scale * limits)


def each_velocity(
    what: str, value: ArrayLike | Mapping[str, float] | None, robot: Robot, default: Array
) -> Array:
    """(nv,) from one number, one a velocity, or a mapping from joint to number over the default."""
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


class BoundJointVelocity:
    """Bounds that never change."""

    constant = True

    def __init__(self, name: str, limits: Array) -> None:
        self.name, self._limits = name, limits

    def narrow(self, at: Configuration, bounds: Array, index: int) -> None:  # noqa: ARG002 (protocol)
        for row, limit, tighter in ((0, -self._limits, np.greater), (1, self._limits, np.less)):
            binds = tighter(limit, bounds[row])
            bounds[row, binds], bounds[row + 2, binds] = limit[binds], index
