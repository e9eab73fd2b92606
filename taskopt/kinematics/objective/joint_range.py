"""Distance from mechanical joint limits."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, IntArray, bound
from taskopt.errors import InvalidValue
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective.base import Objective
from taskopt.kinematics.robot.robot import Robot


@dataclass(frozen=True, init=False)
class JointRange(Objective):
    """w = −1/(2n) Σ ((qᵢ − q̄ᵢ) / (qᵢ_max − qᵢ_min))² over n joints (3.57), q̄ᵢ the middle of the range.

    Joints without a limit on either side do not count, in n neither. `joints` chooses by name
    (default: all); `lower` and `upper` replace the robot's limits [rad], [m] where they are given, one
    number for all chosen joints or one for each.
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
        object.__setattr__(self, "joints", None if joints is None else tuple(joints))
        object.__setattr__(self, "lower", _numbers("lower", lower))
        object.__setattr__(self, "upper", _numbers("upper", upper))

    def value(self, at: Configuration) -> float:
        _, places, middle, width = _ranges(self, at.robot)
        return -0.5 * float(np.mean(((at.q[places] - middle) / width) ** 2))

    def gradient(self, at: Configuration) -> Array:
        """−(qᵢ − q̄ᵢ) / (n (qᵢ_max − qᵢ_min)²)."""
        columns, places, middle, width = _ranges(self, at.robot)
        out = np.zeros(at.robot.nv)
        out[columns] = (middle - at.q[places]) / (len(columns) * width**2)
        return out


@lru_cache(maxsize=32)
def _ranges(objective: JointRange, robot: Robot) -> tuple[IntArray, IntArray, Array, Array]:
    """Columns of v, places in q, middle and width of the joints that count."""
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
    if objective.joints is None:
        return np.flatnonzero(robot.position_index >= 0)
    slices = [robot.velocity_index(joint) for joint in objective.joints]
    chosen = np.array([column for s in slices for column in range(s.start, s.stop)], dtype=np.int64)
    endless = chosen[robot.position_index[chosen] < 0]
    if len(endless):
        raise InvalidValue(f"JointRange: {_name(robot, endless[0])} is a joint without range; leave it out")
    return chosen


def _limits(name: str, given: tuple[float, ...] | None, own: Array) -> Array:
    if given is None:
        return own
    if len(given) not in {1, len(own)}:
        raise InvalidValue(f"JointRange: {name} has {len(given)} numbers for {len(own)} joints")
    return np.broadcast_to(np.array(given), own.shape)


def _numbers(name: str, value: ArrayLike | None) -> tuple[float, ...] | None:
    return None if value is None else tuple(bound(name, np.atleast_1d(value), (None,)).tolist())


def _name(robot: Robot, column: int) -> str:
    return robot.velocity_names[column]
