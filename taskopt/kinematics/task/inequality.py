"""Inequality tasks: a frame's origin in a box, and a line of sight in a cone; at any level of a stack.

They ask for nothing while they are met. On the way to the edge they are velocity dampers (Faverjon and
Tournassoud 1987): a coordinate c with c ≤ c_max gets ċ ≤ K (c_max − c), so that the edge is approached no
faster than ċ = −K (c − c_max), and left at that rate from beyond it. Keep K Δt ≤ 1, or one step oversteps.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, IntArray, bound, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.jit import kernel
from taskopt.kinematics.configuration import Configuration, frame_jacobian_into, frame_pose_into
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS, PoseSpace
from taskopt.kinematics.target import as_target
from taskopt.kinematics.task.rows import gains, weights

_BESIDE = 1e-9  # sine of an angle below which its axis of rotation is any; [m] distance of no direction
_NEAREST = 0.01  # [m] a target nearer than this turns as if it were here, or its angle would run away


@dataclass(frozen=True, eq=False)
class BoxTask:
    """Keep the origin p of a frame in a box: K (lower − p) ≤ J_P v ≤ K (upper − p), with J_P of (3.5).

    `lower`, `upper` (3,) [m] along the axes of the world, ±inf where a side is open; an axis that is open
    both ways has no row. The error is how far p is outside, towards the box. `gain` [1/s], `weight` as in
    `PositionTask`: one number, or three.
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
        return f"{self.frame} in box"

    def bind(self, robot: Robot, name: str) -> "BoundBox":
        sides = np.array([bound("lower", self.lower, (3,)), bound("upper", self.upper, (3,))])
        weight = weights(self.weight, 3)
        rows = np.flatnonzero(np.isfinite(sides).any(axis=0) & (weight > 0.0))
        robot.frame_id(self.frame)
        gain = gains(self.gain, 3)[rows]
        return BoundBox(robot, name, self.frame, rows, sides[:, rows], gain, weight[rows])


@dataclass(frozen=True, eq=False)
class GazeTask:
    """Look at a point from within a cone: φ̇ ≤ K (half_angle − φ), φ the angle between axis and line of sight.

    The line of sight goes from the origin of `frame` to `target`, a point (3,), or a `Target` of
    points or poses, whose motion is fed forward. `axis` (3,) is where the frame looks, in its own axes.
    With u the axis, d and ℓ direction and length of the line of sight, and n = u × d/sin φ,

        φ̇ = −n·ω + (n × d)·(ṗ_d − ṗ)/ℓ.

    One row [rad/s]; the error is half_angle − φ where that is negative. `half_angle` in (0, π) [rad].
    """

    frame: str
    target: Any
    half_angle: float
    axis: ArrayLike = field(default=(0.0, 0.0, 1.0), kw_only=True)
    gain: float = field(default=1.0, kw_only=True)
    weight: float = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if positive("half_angle", self.half_angle) >= np.pi:
            raise InvalidValue(f"half_angle must be in (0, π) [rad], got {self.half_angle:g}")
        if np.linalg.norm(finite("axis", self.axis, (3,))) < 1e-9:
            raise InvalidValue(f"axis must be a direction, got {self.axis}")
        gains(self.gain, 1)
        weights(self.weight, 1)

    def default_name(self) -> str:
        return f"{self.frame} gaze"

    def bind(self, robot: Robot, name: str) -> "BoundGaze":
        robot.frame_id(self.frame)
        return BoundGaze(robot, name, self)


class BoundBox:
    """Rows of the axes that have a closed side; `value` is p along them, `box` (2, 3) the sides [m]."""

    frame = desired = actual = None
    constant = False

    def __init__(
        self, robot: Robot, name: str, frame: str, rows: IntArray, sides: Array, gain: Array, weight: Array
    ) -> None:
        self.name, self._frame, self._rows, self._sides = name, frame, rows, sides
        self.row_names = tuple(ROW_NAMES[i] for i in rows)
        self.row_units = tuple(ROW_UNITS[i] for i in rows)
        self.column: tuple[int, ...] = (-1,) * len(rows)
        self.gain, self.weight = gain, weight
        self.box = np.array([np.full(3, -np.inf), np.full(3, np.inf)])
        self.box[:, rows] = sides
        self.error, self.value = np.zeros(len(rows)), np.zeros(len(rows))
        self._pose, self._jacobian = np.empty((4, 4)), np.empty((6, robot.nv))

    def prepare(self, rows: LevelRows) -> None:
        pass

    def start(self, at: Configuration, t: float) -> None:
        pass

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002 (it has no time)
        _frame_into(at, self._frame, self._pose, self._jacobian)
        self.value[:] = self._pose[self._rows, 3]
        rows.A[:] = self._jacobian[self._rows]
        rows.lower[:] = self.gain * (self._sides[0] - self.value)
        rows.upper[:] = self.gain * (self._sides[1] - self.value)
        self.error[:] = np.clip(self.value, self._sides[0], self._sides[1]) - self.value


class BoundGaze:
    """The one row of a line of sight; `value` is φ."""

    frame = desired = actual = None
    constant = False
    row_names, row_units, column = ("angle",), ("rad/s",), (-1,)

    def __init__(self, robot: Robot, name: str, task: GazeTask) -> None:
        self.name, self._frame, self._half_angle = name, task.frame, float(task.half_angle)
        axis = finite("axis", task.axis, (3,))
        self._axis = axis / np.linalg.norm(axis)
        self.cone = task.frame, self._axis, self._half_angle  # frame, unit axis in it, half angle [rad]
        self.gain, self.weight = gains(task.gain, 1), weights(task.weight, 1)
        self.error, self.value = np.zeros(1), np.zeros(1)
        self._reference = as_target(task.target)
        self._space = PoseSpace(f"target of '{name}'")
        self._point, self._twist = np.empty((4, 4)), np.zeros(6)
        self._pose, self._jacobian = np.empty((4, 4)), np.empty((6, robot.nv))

    def prepare(self, rows: LevelRows) -> None:
        rows.lower[:] = -np.inf

    def start(self, at: Configuration, t: float) -> None:
        self._course = self._reference.start(self._space, at.pose(self._frame), t)

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        if not self._course(t, self._point, self._twist):
            self._twist[:] = 0.0
        _frame_into(at, self._frame, self._pose, self._jacobian)
        angle, rate = gaze_into(self._pose, self._jacobian, self._axis, self._point, self._twist, rows.A[0])
        self.value[0] = angle
        rows.upper[0] = self.gain[0] * (self._half_angle - angle) - rate
        self.error[0] = min(self._half_angle - angle, 0.0)


def _frame_into(at: Configuration, frame: str, pose: Array, jacobian: Array) -> None:
    view = at.frame(frame)
    frame_pose_into(view.joint_rotation, view.joint_translation, view.placement, pose)
    frame_jacobian_into(at.joint_jacobians, pose, view.columns, jacobian)


@kernel
def gaze_into(pose, jacobian, axis, point, twist, row):
    """Fill the row ∂φ/∂v (nv,) of the angle φ; returns φ and how fast the target's own motion opens it."""
    u, d, n, across = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    length = 0.0
    for i in range(3):
        u[i] = pose[i, 0] * axis[0] + pose[i, 1] * axis[1] + pose[i, 2] * axis[2]
        d[i] = point[i, 3] - pose[i, 3]
        length += d[i] * d[i]
    length = np.sqrt(length)
    if length < _BESIDE:
        d[:] = u
    else:
        d /= length
    _cross(u, d, n)
    sine = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    angle = np.arctan2(sine, u[0] * d[0] + u[1] * d[1] + u[2] * d[2])
    if sine < _BESIDE:  # straight ahead or behind: turn about anything at right angles to u
        least = np.argmin(np.abs(u))
        d[:] = 0.0
        d[least] = 1.0
        _cross(u, d, n)
        sine = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        d[:] = u if angle < 1.0 else -u
    n /= sine
    _cross(n, d, across)
    across /= max(length, _NEAREST)
    rate = across[0] * twist[0] + across[1] * twist[1] + across[2] * twist[2]
    for k in range(row.size):
        row[k] = 0.0
        for i in range(3):
            row[k] -= n[i] * jacobian[3 + i, k] + across[i] * jacobian[i, k]
    return angle, rate


@kernel
def _cross(a, b, out):
    out[0], out[1], out[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
