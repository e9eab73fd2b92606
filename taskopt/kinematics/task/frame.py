"""Tasks of one frame of the robot: its pose, its position, its orientation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from taskopt.arrays import Array, ArrayLike, BoolArray, IntArray
from taskopt.errors import InvalidValue
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.parameter import Numbers, Parameter, Setting
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS, PoseSpace, Value, chosen_rows
from taskopt.kinematics.target import Hold, Target, as_target, check_target
from taskopt.kinematics.task import frame_kernel as k
from taskopt.kinematics.task.aimed import AimedTask
from taskopt.kinematics.task.base import Task, gains, rate_gains, weights
from taskopt.kinematics.task.frame_lift import frame_lift

Expressed = Literal["own", "world"]
_LETTERS = "xyzrpy"


@dataclass(frozen=True, eq=False)
class _OfFrame(Task):
    """Base of the three tasks of a frame; `_ROWS` are the letters of their rows."""

    frame: str
    target: Target | Value = field(default_factory=Hold, kw_only=True)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    rate_gain: ArrayLike | None = field(default=None, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    _ROWS: ClassVar[str]
    axes: ClassVar[str | Sequence[bool]]
    expressed: ClassVar[Expressed]

    def __post_init__(self) -> None:
        self._rows()
        check_target(self.target, PoseSpace(f"target of '{self.name or self.default_name()}'"))

    def bind(self, robot: Robot, name: str) -> "BoundFrame":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no such frame.
        """
        mode = k.OWN if self.expressed == "own" else k.WORLD
        if mode == k.OWN and self._ROWS == "xyz":
            mode = k.POSITION
        rows = self._rows()
        gain = self._six(gains(self.gain, len(self._ROWS)))[rows]
        bound = BoundFrame(name, self.frame, rows, gain, self._weights()[rows])
        bound.rate_gain = self._six(rate_gains(self.rate_gain, len(self._ROWS)))[rows]
        bound.attach(robot, as_target(self.target), mode)
        return bound

    def _rows(self) -> IntArray:
        """Return the rows of six that are taken; one with weight 0 asks for nothing."""
        if self.expressed not in ("own", "world"):
            raise InvalidValue(f"expressed must be 'own' or 'world', got {self.expressed!r}")
        gains(self.gain, len(self._ROWS))
        rate_gains(self.rate_gain, len(self._ROWS))
        rows = chosen_rows(self.axes, self._ROWS, first=_LETTERS.index(self._ROWS))
        kept = rows[self._weights()[rows] > 0.0]
        if kept.size == 0:
            raise InvalidValue("weight is 0 for all the axes chosen")
        return kept

    def _weights(self) -> Array:
        """Return the weight of each row of six."""
        pair = (3, 3) if len(self._ROWS) == 6 else ()
        return self._six(weights(self.weight, len(self._ROWS), pair))

    def _six(self, values: Array) -> Array:
        """Return values of the own rows for six rows."""
        return np.tile(values, 6 // len(values))


@dataclass(frozen=True, eq=False)
class FrameTask(_OfFrame):
    """Bring a frame to a target pose T_d(t), six rows: A v = b with b = ẋ_d + K e.

    With T the pose of the frame, p its origin and R its rotation:

        own axes     e = log6(T⁻¹ T_d),                A = Jlog6(T_d⁻¹ T) J_own
        world axes   e = [p_d − p; log3(R_d Rᵀ)],      A = [J_P; Jlog3(R_d Rᵀ) J_O]

    J_own is the Jacobian of the frame in its own axes; J_P and J_O are the positional and the orientational
    part of its Jacobian in the axes of the world. Rows x, y, z [m/s] and rx, ry, rz [rad/s], along the axes
    of the frame or of the world. In own axes translation and rotation are coupled, and the frame goes to its
    target on a screw; in world axes its origin goes straight. A is the exact derivative of e in both, so that
    the error dies out as ė = −K e.

    Args:
        frame: Name of the frame.
        target: Target pose: a (4, 4) array, a position (3,), or a `Target` such as `Circle` or `Latest`.
            Default: the pose at the start.
        gain: K [1/s], one number or six. More lets the error die out faster and asks for larger velocities;
            it must stay below 2/Δt.
        weight: Factor of ½ (A v − b)² within the level, in [s²/m²] and [s²/rad²]: one number, a pair
            (position, orientation), or six. More lets this task win over others of the same level.
        axes: Rows that are taken, such as "xyz", or "xy y" for the position in a plane and the yaw, or six
            truth values.
        expressed: "own" or "world": the axes in which e is measured.
        rate_gain: K_D [1/s] in a stack of order 2, given like `gain`; K_P is K². Default: 2 K, for critical
            damping.
        name: Name in logs and plots. Default: the name of the frame.

    Raises:
        InvalidValue: A number is out of its range, or no row is left.

    Source:
        Equations (3.67)–(3.70). The derivative in own axes: Solà, Deray and Atchuthan (2018), eq. 79.
    """

    axes: str | Sequence[bool] = field(default="xyzrpy", kw_only=True)
    expressed: Expressed = field(default="own", kw_only=True)
    _ROWS = "xyzrpy"

    def default_name(self) -> str:
        """Return the name of the frame."""
        return self.frame


@dataclass(frozen=True, eq=False)
class PositionTask(_OfFrame):
    """Bring the origin p of a frame to a target point p_d(t), three rows: A v = ṗ_d + K e.

        world axes   e = p_d − p,           A = J_P
        own axes     e = Rᵀ (p_d − p),      A = Rᵀ J_P − [e]× Rᵀ J_O

    R is the rotation of the frame, and J_P and J_O are the positional and the orientational part of its
    Jacobian. Rows x, y, z [m/s] along the axes of the world, or along those of the frame; the second term of
    A then accounts for the turning of the frame.

    Args:
        frame: Name of the frame.
        target: Target point (3,) [m] or pose in the world, or a `Target`. Default: the point at the start.
        gain: K [1/s], one number or three. More lets the error die out faster and asks for larger velocities;
            it must stay below 2/Δt.
        weight: Factor of ½ (A v − b)² within the level [s²/m²], one number or three. More lets this task win
            over others of the same level.
        axes: Rows that are taken, such as "xy", or three truth values.
        expressed: "world" or "own": the axes in which e is measured.
        rate_gain: K_D [1/s] in a stack of order 2, given like `gain`; K_P is K². Default: 2 K, for critical
            damping.
        name: Name in logs and plots. Default: the name of the frame and "position".

    Raises:
        InvalidValue: A number is out of its range, or no row is left.

    Source:
        J_P is the positional part of the geometric Jacobian (3.5); equations (3.67)–(3.70).
    """

    axes: str | Sequence[bool] = field(default="xyz", kw_only=True)
    expressed: Expressed = field(default="world", kw_only=True)
    _ROWS = "xyz"

    def default_name(self) -> str:
        """Return the name of the frame and "position"."""
        return f"{self.frame} position"


@dataclass(frozen=True, eq=False)
class OrientationTask(_OfFrame):
    """Bring the axes R of a frame to a target orientation R_d(t), three rows: A v = ω_d + K e.

        own axes     e = log3(Rᵀ R_d),      world axes   e = log3(R_d Rᵀ),

    Both errors are rotation vectors of length in [0, π], so that the frame always turns the short way. A is
    the exact derivative of −e. Rows rx, ry, rz [rad/s].

    Args:
        frame: Name of the frame.
        target: Target rotation (3, 3) or pose in the world, or a `Target`, whose rate is an angular velocity
            (3,) [rad/s] in the axes of the world. Default: the orientation at the start.
        gain: K [1/s], one number or three. More lets the error die out faster and asks for larger velocities;
            it must stay below 2/Δt.
        weight: Factor of ½ (A v − b)² within the level [s²/rad²], one number or three. More lets this task
            win over others of the same level.
        axes: Rows that are taken, letters of "rpy", or three truth values.
        expressed: "own" or "world": the axes in which e is measured.
        rate_gain: K_D [1/s] in a stack of order 2, given like `gain`; K_P is K². Default: 2 K, for critical
            damping.
        name: Name in logs and plots. Default: the name of the frame and "orientation".

    Raises:
        InvalidValue: A number is out of its range, or no row is left.

    Source:
        Equations (3.67)–(3.70), with the rotation vector in place of the Euler angles.
    """

    axes: str | Sequence[bool] = field(default="rpy", kw_only=True)
    expressed: Expressed = field(default="own", kw_only=True)
    _ROWS = "rpy"

    def default_name(self) -> str:
        """Return the name of the frame and "orientation"."""
        return f"{self.frame} orientation"


class BoundFrame(AimedTask):
    """A `FrameTask`, `PositionTask` or `OrientationTask` for one robot; `frame_kernel` fills its rows.

    Args:
        name: Name of the task in its plan.
        frame: Name of the frame.
        rows: Rows of six that are taken, (m,).
        gain: K of each row [1/s], (m,).
        weight: Weight of each row, (m,).
    """

    def __init__(self, name: str, frame: str, rows: IntArray, gain: Array, weight: Array) -> None:
        names, units = [ROW_NAMES[i] for i in rows], [ROW_UNITS[i] for i in rows]
        super().__init__(name, names, units, gain, weight)
        self.frame = self._frame = frame
        self._rows, self.kernel = rows, k.frame_rows
        self.pair = int((rows < 3).sum()), int((rows >= 3).sum())
        self._masks: dict[str, BoolArray] = {}

    def attach(self, robot: Robot, target: Target, mode: int) -> None:
        """Prepare parameters and memory of the kernel.

        Args:
            robot: Robot that has the frame.
            target: Target, in the terms of `taskopt.kinematics.target`.
            mode: Kind of error, `OWN`, `WORLD` or `POSITION` of `frame_kernel`.
        """
        self.take_target(target, PoseSpace(f"target of '{self.name}'", angular=self._rows[0] >= 3))
        head = [mode, robot.frame_joint(self._frame), len(self._rows)]
        self.parameters = np.concatenate([head, self._rows, robot.support(self._frame)]).astype(np.int64)
        self.use(np.zeros(k.MEMORY_SHAPE).ravel())
        self._table[k.GAIN, self._rows] = self.gain
        self._table[k.RATE_GAIN, self._rows] = self.rate_gain

    def accelerate(self) -> None:
        """Set the kernel of second order; see `BoundTask.accelerate`."""
        self.lift_kernel = frame_lift
        super().accelerate()

    def use(self, memory: Array) -> None:
        """Re-bind this part to a memory; see `Part.use`."""
        self.memory, self._table = memory, memory.reshape(k.MEMORY_SHAPE)
        self.desired = self.goal = self._table[k.TARGET : k.TARGET + 4, :4]
        self.actual = self._table[k.ACTUAL : k.ACTUAL + 4, :4]
        self.error = self._table[k.ERROR, : len(self._rows)]
        first, last = self._rows[0], self._rows[-1]
        if last - first + 1 == len(self._rows):  # a view, so that a new gain needs no copy
            gain, self.gain = self.gain, self._table[k.GAIN, first : last + 1]
            self.gain[:] = gain
        self._twist, self._moving = self._table[k.TWIST], self._table[k.MOVING]  # kept: a view costs 0.2 µs
        self._acceleration = self._table[k.ACCELERATION]

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the target from the present pose of the frame; see `RowPart.start`."""
        placement = configuration.frame(self._frame).placement
        self._table[k.PLACEMENT : k.PLACEMENT + 4, :4] = placement
        self.begin(configuration.pose(self._frame), t)

    def aim(self, t: float) -> None:
        """Write the target pose at t [s], and its rate where it has one."""
        self._moving[0] = self.aimed(t, self._twist, self._acceleration)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return gain and target; see `Part.adjustable`."""
        is_view = np.shares_memory(self.gain, self._table)
        return {
            **super().adjustable(),
            "gain": Numbers(self.gain, self.each_gain, None if is_view else self._write_gain),
        }

    def rows_of_axes(self, axes: Setting) -> BoolArray:
        """Return one truth value for each row (m,) from letters, as in the declaration, or names of rows."""
        if not isinstance(axes, str) or axes in self.row_names[3:]:
            return super().rows_of_axes(axes)
        if axes in self._masks:
            return self._masks[axes]
        wanted = chosen_rows(axes, _LETTERS)
        missing = [ROW_NAMES[i] for i in wanted if i not in self._rows]
        if missing:
            raise InvalidValue(
                f"axes of '{self.name}' can be chosen among {', '.join(self.row_names)}, as compiled, "
                f"got {', '.join(missing)}, too; declare the task with them, and take them out by axes"
            )
        return self._masks.setdefault(axes, np.isin(self._rows, wanted))

    def _write_gain(self) -> None:
        """Write the gains for the kernel."""
        self._table[k.GAIN, self._rows] = self.gain
