"""Inequality tasks, which keep the origin of a frame in a box or a line of sight in a cone, at any level.

Such a task leaves the motion free well inside the edge and slows it down near the edge, as a velocity damper:
c ≤ c_max becomes ċ ≤ K (c_max − c). Beyond the edge the right-hand side is negative, so that c returns at
that rate. One Euler step may pass the edge if K Δt > 1.

Source:
    Faverjon and Tournassoud (1987), IEEE International Conference on Robotics and Automation.
"""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike, IntArray, bound, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy import tolerances
from taskopt.hierarchy.problem import LevelRows
from taskopt.jit import kernel
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS, PoseSpace, Value
from taskopt.kinematics.target import Target, as_target
from taskopt.kinematics.task.aimed import AimedTask
from taskopt.kinematics.task.base import BoundTask, Task, gains, weights


@dataclass(frozen=True, eq=False)
class BoxTask(Task):
    """Keep the origin p of a frame in a box: K (lower − p) ≤ J_P v ≤ K (upper − p).

    J_P is the positional part of the frame's Jacobian (3.5). There is one row [m/s] for each axis x, y, z of
    the world that has a closed side. The error is the distance of p from the box along that axis [m], signed
    towards the box, and 0 inside.

    Args:
        frame: Name of the frame.
        lower: Lower sides (3,) [m] in the world; −inf where a side is open.
        upper: Upper sides (3,) [m] in the world; inf where a side is open.
        gain: K [1/s], one number or three. More lets p come closer to a side before the row brakes, and
            brings it back faster from outside.
        weight: Factor of ½ d² within the level [s²/m²], with d the violation of a row: one number or three.
            More lets this task win over others of the same level.
        name: Name in logs and plots. Default: the name of the frame and "in box".

    Raises:
        InvalidValue: A lower side is above its upper one, no side is closed, or a number is out of its range.
    """

    frame: str
    lower: ArrayLike
    upper: ArrayLike
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        lower, upper = bound("lower", self.lower, (3,)), bound("upper", self.upper, (3,))
        if (lower > upper).any() or not (np.isfinite(lower) | np.isfinite(upper)).any():
            raise InvalidValue(f"a box needs lower ≤ upper and a side that is closed, got {lower}, {upper}")
        gains(self.gain, 3)
        weights(self.weight, 3)

    def default_name(self) -> str:
        """Return the name of the frame and "in box"."""
        return f"{self.frame} in box"

    def bind(self, robot: Robot, name: str) -> "BoundBox":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no such frame.
        """
        sides = np.array([bound("lower", self.lower, (3,)), bound("upper", self.upper, (3,))])
        weight = weights(self.weight, 3)
        rows = np.flatnonzero(np.isfinite(sides).any(axis=0) & (weight > 0.0))
        robot.frame_id(self.frame)
        gain = gains(self.gain, 3)[rows]
        return BoundBox(robot, name, self.frame, rows, sides[:, rows], gain, weight[rows])


@dataclass(frozen=True, eq=False)
class GazeTask(Task):
    """Keep the angle φ between an axis of a frame and its line of sight below φ_max: φ̇ ≤ K (φ_max − φ).

    The line of sight goes from the origin p of the frame to the point p_d. With u the axis in the world, d
    and ℓ the direction and length of the line of sight, and n = u × d / sin φ,

        φ̇ = −n·ω + (n × d)·(ṗ_d − ṗ)/ℓ.

    One row [rad/s]. The error is φ_max − φ where that is negative, else 0 [rad].

    Args:
        frame: Name of the frame that looks.
        target: Point (3,) [m] in the world, or a `Target` of points or poses, whose motion is fed forward.
        half_angle: φ_max in (0, π) [rad].
        axis: Direction (3,) in which the frame looks, in its own axes.
        gain: K [1/s]. More lets φ come closer to the edge of the cone before the row brakes, and brings it
            back faster from outside.
        weight: Factor of ½ d² within the level [s²/rad²], with d the violation of the row. More lets this
            task win over others of the same level.
        name: Name in logs and plots. Default: the name of the frame and "gaze".

    Raises:
        InvalidValue: A number is out of its range, or the axis has no direction.
    """

    frame: str
    target: Target | Value
    half_angle: float
    axis: ArrayLike = field(default=(0.0, 0.0, 1.0), kw_only=True)
    gain: float = field(default=1.0, kw_only=True)
    weight: float = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if positive("half_angle", self.half_angle) >= np.pi:
            raise InvalidValue(f"half_angle must be in (0, π) [rad], got {self.half_angle:g}")
        if np.linalg.norm(finite("axis", self.axis, (3,))) < tolerances.NO_DIRECTION:
            raise InvalidValue(f"axis must be a direction, got {self.axis}")
        gains(self.gain, 1)
        weights(self.weight, 1)

    def default_name(self) -> str:
        """Return the name of the frame and "gaze"."""
        return f"{self.frame} gaze"

    def bind(self, robot: Robot, name: str) -> "BoundGaze":
        """Return the row for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no such frame.
        """
        robot.frame_id(self.frame)
        return BoundGaze(robot, name, self)


class BoundBox(BoundTask):
    """The rows of a `BoxTask`: one for each axis that has a closed side.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        frame: Name of the frame.
        rows: Axes of the world that have a row, (m,).
        sides: Lower and upper side of each row [m], (2, m).
        gain: K of each row [1/s], (m,).
        weight: Weight of each row, (m,).

    Attributes:
        value: Coordinates of p in the rows, as of the last `fill`, (m,) [m].
    """

    def __init__(
        self, robot: Robot, name: str, frame: str, rows: IntArray, sides: Array, gain: Array, weight: Array
    ) -> None:
        super().__init__(name, [ROW_NAMES[i] for i in rows], [ROW_UNITS[i] for i in rows], gain, weight)
        self._moved, self._rows, self._sides = frame, rows, sides
        self.box = np.array([np.full(3, -np.inf), np.full(3, np.inf)])
        self.box[:, rows] = sides
        self.value = np.zeros(len(rows))
        self._pose, self._jacobian = np.empty((4, 4)), np.empty((6, robot.nv))

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the rows; see `RowPart.fill`."""
        configuration.frame_into(self._moved, self._pose, self._jacobian)
        self.value[:] = self._pose[self._rows, 3]
        rows.A[:] = self._jacobian[self._rows]
        rows.lower[:] = self.gain * (self._sides[0] - self.value)
        rows.upper[:] = self.gain * (self._sides[1] - self.value)
        self.error[:] = np.clip(self.value, self._sides[0], self._sides[1]) - self.value


class BoundGaze(AimedTask):
    """The one row of a `GazeTask`.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        task: The declared task.

    Attributes:
        value: φ of the last `fill`, (1,) [rad].
    """

    def __init__(self, robot: Robot, name: str, task: GazeTask) -> None:
        super().__init__(name, ("angle",), ("rad/s",), task.gain, task.weight)
        self._moved, self._half_angle = task.frame, float(task.half_angle)
        axis = finite("axis", task.axis, (3,))
        self._axis = axis / np.linalg.norm(axis)
        self.cone = task.frame, self._axis, self._half_angle
        self.value = np.zeros(1)
        self.take_target(as_target(task.target), PoseSpace(f"target of '{name}'"))
        self.goal, self._twist = np.empty((4, 4)), np.zeros(6)
        self._pose, self._jacobian = np.empty((4, 4)), np.empty((6, robot.nv))

    def prepare(self, rows: LevelRows) -> None:
        """Open the lower side; see `RowPart.prepare`."""
        rows.lower[:] = -np.inf

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the target from the present pose of the frame; see `RowPart.start`."""
        self.begin(configuration.pose(self._moved), t)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the row; see `RowPart.fill`."""
        if not self._course(t, self.goal, self._twist):
            self._twist[:] = 0.0
        configuration.frame_into(self._moved, self._pose, self._jacobian)
        angle, rate = gaze_into(self._pose, self._jacobian, self._axis, self.goal, self._twist, rows.A[0])
        self.value[0] = angle
        rows.upper[0] = self.gain[0] * (self._half_angle - angle) - rate
        self.error[0] = min(self._half_angle - angle, 0.0)


@kernel
def gaze_into(pose, jacobian, axis, point, twist, row):
    """Fill the row ∂φ/∂v of the angle φ between an axis of a frame and the line of sight to a point.

    Args:
        pose: Pose of the frame in the world, (4, 4).
        jacobian: Geometric Jacobian of the frame in the axes of the world, (6, nv).
        axis: Unit axis in the frame, (3,).
        point: Pose (4, 4) whose translation is the point in the world [m].
        twist: Velocity of the point in the world [m/s], then three numbers that are not read, (6,).
        row: ∂φ/∂v, (nv,), written here.

    Returns:
        φ in [0, π] [rad], and the rate of φ that the motion of the point alone causes [rad/s].
    """
    u, d, n, across = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    length = 0.0
    for i in range(3):
        u[i] = pose[i, 0] * axis[0] + pose[i, 1] * axis[1] + pose[i, 2] * axis[2]
        d[i] = point[i, 3] - pose[i, 3]
        length += d[i] * d[i]
    length = np.sqrt(length)
    if length < tolerances.NO_DIRECTION:
        d[:] = u
    else:
        d /= length
    _cross(u, d, n)
    sine = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    angle = np.arctan2(sine, u[0] * d[0] + u[1] * d[1] + u[2] * d[2])
    if sine < tolerances.PARALLEL:  # straight ahead or behind: turn about anything at right angles to u
        least = np.argmin(np.abs(u))
        d[:] = 0.0
        d[least] = 1.0
        _cross(u, d, n)
        sine = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        d[:] = u if angle < 1.0 else -u
    n /= sine
    _cross(n, d, across)
    across /= max(length, tolerances.NEAREST_SIGHT)
    rate = across[0] * twist[0] + across[1] * twist[1] + across[2] * twist[2]
    for k in range(row.size):
        row[k] = 0.0
        for i in range(3):
            row[k] -= n[i] * jacobian[3 + i, k] + across[i] * jacobian[i, k]
    return angle, rate


@kernel
def _cross(a, b, out):
    """Write the cross product a × b."""
    out[0], out[1], out[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
