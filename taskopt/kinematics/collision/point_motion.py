"""Bounds on the motion of a point of a robot in one step.

A step of Δt at constant velocities |v_k| ≤ s v̄_k moves a point by at most s · travel, and off its tangent by
at most s² · bend. With ρ_k the largest distance of the point from joint k, and Ω = Σ v̄_k over turning joints,

    travel = Δt Σ v̄_k ρ_k,   bend = ½ Δt² Ω (Σ v̄_k ρ_k),

sliding joints with ρ = 1 in the first sum and 2 in the second, for Coriolis terms.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

from typing import NamedTuple

import numpy as np

from taskopt.arrays import BoolArray
from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.lengths import link_length
from taskopt.kinematics.collision.step_bounds import nominal_speeds
from taskopt.kinematics.robot.joints import velocity_slice
from taskopt.kinematics.robot.robot import Robot


class PointMotion(NamedTuple):
    """Bounds on the motion of a point in a step at the nominal speeds v̄.

    Attributes:
        travel: Upper bound of the length of its path [m].
        bend: Upper bound of its distance from the point to which its initial velocity leads [m].
    """

    travel: float
    bend: float


def point_motion(robot: Robot, joint: int, offset: float, counted: BoolArray, dt: float) -> PointMotion:
    """Compute bounds on the motion of a point of a body in one step at the nominal speeds.

    Args:
        robot: The robot.
        joint: Pinocchio's index of the joint that carries the body.
        offset: Distance of the point from the origin of the joint [m].
        counted: True for each velocity that counts, (nv,).
        dt: Δt [s].

    Returns:
        The two bounds.

    Raises:
        InvalidValue: A joint that turns carries one that slides without limits.
    """
    speeds, turns = nominal_speeds(robot), np.array([unit == "rad" for unit in robot.coordinate_units])
    reach, on_chain, length = np.zeros(robot.nv), np.zeros(robot.nv, dtype=bool), offset
    for index in reversed(list(robot.model.supports[joint])):
        own = velocity_slice(robot.model.joints[index])
        on_chain[own] = True
        reach[own] = np.where(turns[own], length, 0.0)
        length += link_length(robot, index)
    on_chain &= counted
    spin = float(speeds[on_chain & turns].sum())
    swing = float(speeds[on_chain & turns] @ reach[on_chain & turns])
    slide = float(speeds[on_chain & ~turns].sum())
    if not np.isfinite(swing):
        raise InvalidValue(
            f"a joint before '{robot.joints[joint - 1]}' slides without limits, so that a step has no bound; "
            "give the joint limits"
        )
    return PointMotion(dt * (swing + slide), 0.5 * dt * dt * spin * (swing + 2.0 * slide))
