"""The distance from mechanical joint limits as an objective."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from taskopt.arrays import Array, ArrayLike, IntArray, bound, names_in
from taskopt.errors import InvalidValue
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective.base import Objective
from taskopt.kinematics.robot.robot import Robot


@dataclass(frozen=True, init=False)
class JointRange(Objective):
    """Distance from the limits of the joints, w = −1/(2n) Σ ((q_i − q̄_i)/(q_i,max − q_i,min))².

    The sum runs over n joints, with q̄_i the middle of the range. w is a plain number, 0 in the middle of all
    ranges and negative elsewhere. Joints that lack a limit on one side do not count, neither in the sum nor
    in n.

    Args:
        joints: Names of joints. Default: all that have a range.
        lower: Lower limits [rad, m] in place of the robot's, one number or one for each chosen joint.
        upper: Upper limits [rad, m] in place of the robot's, one number or one for each chosen joint.

    Raises:
        InvalidValue: When first used: a lower limit is above its upper one, or no joint has a range.

    Source:
        Equation (3.57).
    """

    joints: tuple[str, ...] | None
    lower: tuple[float, ...] | None
    upper: tuple[float, ...] | None

    def __init__(
        self,
        joints: Iterable[str] | None = None,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
    ) -> None:
        object.__setattr__(self, "joints", None if joints is None else tuple(names_in("joints", joints)))
        object.__setattr__(self, "lower", _numbers("lower", lower))
        object.__setattr__(self, "upper", _numbers("upper", upper))

    def value(self, configuration: Configuration) -> float:
        """Return w(q); see `Objective.value`."""
        _, places, middle, width = _ranges(self, configuration.robot)
        return -0.5 * float(np.mean(((configuration.q[places] - middle) / width) ** 2))

    def gradient(self, configuration: Configuration) -> Array:
        """Return ∂w/∂q, whose entries are −(q_i − q̄_i)/(n (q_i,max − q_i,min)²), (nv,)."""
        columns, places, middle, width = _ranges(self, configuration.robot)
        out = np.zeros(configuration.robot.nv)
        out[columns] = (middle - configuration.q[places]) / (len(columns) * width**2)
        return out


@lru_cache(maxsize=32)
def _ranges(objective: JointRange, robot: Robot) -> tuple[IntArray, IntArray, Array, Array]:
    """Return index in v, index in q, middle and width of the range of each joint that counts."""
    chosen = _chosen(objective, robot)
    lower = _limits("lower", objective.lower, robot.position_lower[chosen])
    upper = _limits("upper", objective.upper, robot.position_upper[chosen])
    if (lower > upper).any():
        i = int(np.argmax(lower > upper))
        raise InvalidValue(
            f"JointRange: lower {lower[i]:g} > upper {upper[i]:g} for {_name(robot, chosen[i])}"
        )
    counts = np.isfinite(lower) & np.isfinite(upper) & (upper > lower)
    if not counts.any():
        raise InvalidValue(
            f"JointRange: no joint of {robot.name} has limits on both sides; give lower= and upper="
        )
    columns = chosen[counts]
    return columns, robot.position_index[columns], 0.5 * (lower + upper)[counts], (upper - lower)[counts]


def _chosen(objective: JointRange, robot: Robot) -> IntArray:
    """Return the indices in v of the joints that are named."""
    if objective.joints is None:
        return np.flatnonzero(robot.position_index >= 0)
    slices = [robot.velocity_index(joint) for joint in objective.joints]
    chosen = np.array([column for s in slices for column in range(s.start, s.stop)], dtype=np.int64)
    endless = chosen[robot.position_index[chosen] < 0]
    if len(endless):
        raise InvalidValue(f"JointRange: {_name(robot, endless[0])} is a joint without range; leave it out")
    return chosen


def _limits(name: str, given: tuple[float, ...] | None, own: Array) -> Array:
    """Return the limits that are given, or the robot's own."""
    if given is None:
        return own
    if len(given) not in {1, len(own)}:
        raise InvalidValue(f"JointRange: {name} has {len(given)} numbers for {len(own)} joints")
    return np.broadcast_to(np.array(given), own.shape)


def _numbers(name: str, value: ArrayLike | None) -> tuple[float, ...] | None:
    """Return numbers as a hashable tuple."""
    return None if value is None else tuple(bound(name, np.atleast_1d(value), (None,)).tolist())


def _name(robot: Robot, column: int) -> str:
    """Return the name of a velocity, for messages."""
    return robot.velocity_names[column]
