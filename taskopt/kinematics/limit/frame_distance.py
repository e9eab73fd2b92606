"""The limit on the distance between the origins of two frames."""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, BoolArray, number
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import NO_DIRECTION
from taskopt.kinematics.collision.point_motion import PointMotion, point_motion
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.base import Limit
from taskopt.kinematics.limit.point_limit import BoundPointLimit, PointRows, checked_braking
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True)
class FrameDistanceLimit(Limit):
    """Keep the distance d = ‖p_a − p_b‖ of the origins of two frames between two bounds.

        n·(J_a − J_b) v ≥ −κ (d − d_min − reserve)/Δt   for d < d_min + influence,   n = (p_a − p_b)/d

    and the same with the opposite sign for d_max. J_a and J_b are the positional parts of the frames'
    Jacobians. The rows [m/s] are named "nearest" and "farthest"; bounds on the velocities limit the error of
    one step (`BoundPointLimit`). Frames that start outside the bounds may stop or return. For the distance
    between bodies instead of points, use `SelfCollisionLimit(pairs=[(link, link)])`.

    Args:
        frame_a: Name of the first frame.
        frame_b: Name of the second frame, which may be fixed to the world.
        lower: d_min ≥ 0 [m].
        upper: d_max [m]; inf means no bound.
        influence: Distance from a bound at which braking begins [m]. More begins to brake earlier.
        gain: κ in (0, 1], the largest fraction of the remaining distance that one step may take. Less brakes
            earlier and more gently.
        name: Name in explanations, logs and plots.

    Raises:
        InvalidValue: lower > upper, there is no bound at all, or a number is out of its range; or, when
            bound, both frames move as one body.

    Source:
        The velocity damper of Faverjon and Tournassoud (1987).
    """

    frame_a: str
    frame_b: str
    lower: float = 0.0
    upper: float = np.inf
    influence: float = field(default=0.1, kw_only=True)
    gain: float = field(default=0.1, kw_only=True)
    name: str = field(default="frame_distance", kw_only=True)

    def __post_init__(self) -> None:
        lower, upper = number("lower", self.lower, ()), number("upper", self.upper, ())
        if not 0.0 <= lower <= upper or lower == np.inf or upper == 0.0 or (lower == 0.0 and upper == np.inf):
            raise InvalidValue(
                f"a distance needs 0 ≤ lower ≤ upper and a bound that is not 0 or inf, got lower {lower:g} "
                f"and upper {upper:g}"
            )
        influence, _ = checked_braking(self.influence, self.gain)
        if influence >= upper:
            raise InvalidValue(f"influence must be less than upper {upper:g}, got {influence:g}")

    def bind(self, robot: Robot, dt: float) -> "BoundFrameDistance":
        """Return rows and bounds for a robot; see `Limit.bind`.

        Raises:
            UnknownName: The robot lacks one of the two frames.
            InvalidValue: Both frames move as one body, or a joint between them slides without limits.
        """
        between = np.zeros(robot.nv, dtype=bool)
        between[np.setxor1d(robot.support(self.frame_a), robot.support(self.frame_b))] = True
        if not between.any():
            raise InvalidValue(
                f"'{self.frame_a}' and '{self.frame_b}' move as one body, so their distance cannot be kept; "
                f"leave '{self.name}' out"
            )
        travel, bend = np.sum([_motion(robot, f, between, dt) for f in (self.frame_a, self.frame_b)], axis=0)
        names = [*(["nearest"] if self.lower > 0.0 else []), *(["farthest"] if self.upper < np.inf else [])]
        rows = PointRows(
            names,
            [PointMotion(float(travel), float(bend))] * len(names),
            np.tile(between, (len(names), 1)),
            *checked_braking(self.influence, self.gain),
        )
        return BoundFrameDistance(self, robot, dt, rows)


class BoundFrameDistance(BoundPointLimit):
    """The rows of a `FrameDistanceLimit`.

    A step that carries one frame by x relative to the other makes d at most d + n·x + ‖x‖²/(2 d); the last
    term is added to the bend of "farthest".

    Args:
        limit: The declared limit.
        robot: The robot.
        dt: Δt [s].
        rows: Numbers of the rows.

    Attributes:
        distance: d of the last `fill` [m].
    """

    def __init__(self, limit: FrameDistanceLimit, robot: Robot, dt: float, rows: PointRows) -> None:
        super().__init__(limit.name, robot, dt, rows)
        self._limit, self.distance = limit, np.inf
        self._pose_a, self._pose_b = np.eye(4), np.eye(4)
        self._of_a, self._of_b = np.zeros((6, robot.nv)), np.zeros((6, robot.nv))

    def measure(self, configuration: Configuration, gradient: Array) -> Array:
        """Measure the distance from each bound; see `BoundPointLimit.measure`."""
        a, b = self._limit.frame_a, self._limit.frame_b
        configuration.frame_into(a, self._pose_a, self._of_a)
        configuration.frame_into(b, self._pose_b, self._of_b)
        apart = self._pose_a[:3, 3] - self._pose_b[:3, 3]
        self.distance = d = float(np.sqrt(apart @ apart))
        normal = apart / d if d > NO_DIRECTION else np.zeros(3)
        slope = normal @ (self._of_a[:3] - self._of_b[:3])
        left = []
        if self._limit.lower > 0.0:
            gradient[0] = slope
            left.append(d - self._limit.lower)
        if self._limit.upper < np.inf:
            gradient[-1] = -slope
            left.append(self._limit.upper - d)
            self.bend[-1] = self._far_bend[-1] + 0.5 * self._travel[-1] ** 2 / max(d, NO_DIRECTION)
        return np.array(left)


def _motion(robot: Robot, frame: str, between: BoolArray, dt: float) -> PointMotion:
    """Return bounds on the motion of one of two frames in one step of the joints between them."""
    joint = robot.frame_joint(frame)
    if joint == 0:
        return PointMotion(0.0, 0.0)
    offset = Configuration(robot, robot.neutral).frame(frame).placement[:3, 3]
    return point_motion(robot, joint, float(np.linalg.norm(offset)), between, dt)
