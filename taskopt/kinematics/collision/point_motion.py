"""Bounds on the motion of a point of a robot in one step.

A step of Δt at constant velocities |v_k| ≤ s v̄_k moves a point by at most s · travel, and off its tangent by
at most s² · bend. With ρ_k the largest distance of the point from joint k, and Ω = Σ v̄_k over turning joints,

    travel = Δt Σ v̄_k ρ_k,   bend = ½ Δt² Ω (Σ v̄_k ρ_k),

sliding joints with ρ = 1 in the first sum and 2 in the second, for Coriolis terms.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from taskopt.arrays import BoolArray
from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.step_bounds import nominal_speeds
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
    reach, length = np.zeros(robot.nv), offset
    chain = [index for index in robot.model.supports[joint] if index > 0]
    for index in reversed(chain):
        known = robot.model.joints[index]
        own = slice(known.idx_v, known.idx_v + known.nv)
        reach[own] = np.where(turns[own], length, 0.0)
        length += float(np.linalg.norm(robot.model.jointPlacements[index].translation))
        ends = np.maximum(np.abs(robot.position_lower[own]), np.abs(robot.position_upper[own]))
        length += float(ends[~turns[own]].sum())
    on_chain = counted & np.isin(np.arange(robot.nv), _columns(robot, chain))
    spin = float(speeds[on_chain & turns].sum())
    swing = float(speeds[on_chain & turns] @ reach[on_chain & turns])
    slide = float(speeds[on_chain & ~turns].sum())
    if not np.isfinite(swing):
        raise InvalidValue(
            f"a joint before '{robot.joints[joint - 1]}' slides without limits, so that a step has no bound; "
            "give the joint limits"
        )
    return PointMotion(dt * (swing + slide), 0.5 * dt * dt * spin * (swing + 2.0 * slide))


def _columns(robot: Robot, chain: Sequence[int]) -> list[int]:
    """Return the columns of v of some joints."""
    joints = [robot.model.joints[index] for index in chain]
    return [column for joint in joints for column in range(joint.idx_v, joint.idx_v + joint.nv)]
