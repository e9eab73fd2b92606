"""Tasks of one frame of the robot: its pose, its position, its orientation."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, IntArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS, PoseSpace, chosen_rows
from taskopt.kinematics.target import Hold, Target, as_target
from taskopt.kinematics.task import frame_kernel as k
from taskopt.kinematics.task.rows import gains, weights

Expressed = Literal["own", "world"]


@dataclass(frozen=True, eq=False)
class _OfFrame:
    """What the three tasks of a frame have in common; `_ROWS` are the letters of their rows."""

    frame: str
    target: Any = field(default_factory=Hold, kw_only=True)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    _ROWS: ClassVar[str]
    axes: ClassVar[str | Sequence[bool]]
    expressed: ClassVar[Expressed]

    def __post_init__(self) -> None:
        self._rows()

    def bind(self, robot: Robot, name: str) -> "BoundFrame":
        mode = k.OWN if self.expressed == "own" else k.WORLD
        if mode == k.OWN and self._ROWS == "xyz":
            mode = k.POSITION
        reference, gain = as_target(self.target), self._six(gains(self.gain, len(self._ROWS)))
        return BoundFrame(robot, name, self.frame, reference, mode, self._rows(), gain, self._weights())

    def _rows(self) -> IntArray:
        """The rows of six that are taken; one with weight 0 asks for nothing."""
        if self.expressed not in ("own", "world"):
            raise InvalidValue(f"expressed must be 'own' or 'world', got {self.expressed!r}")
        gains(self.gain, len(self._ROWS))
        rows = chosen_rows(self.axes, self._ROWS, first="xyzrpy".index(self._ROWS))
        kept = rows[self._weights()[rows] > 0.0]
        if kept.size == 0:
            raise InvalidValue("weight is 0 for all the axes chosen")
        return kept

    def _weights(self) -> Array:
        pair = (3, 3) if len(self._ROWS) == 6 else ()
        return self._six(weights(self.weight, len(self._ROWS), pair))

    def _six(self, values: Array) -> Array:
        return np.tile(values, 6 // len(values))


@dataclass(frozen=True, eq=False)
class FrameTask(_OfFrame):
    """Bring a frame to a pose T_d(t), six rows: A v = b with b = ẋ_d + K e (3.67)–(3.70).

    Own axes: e = log6(T⁻¹ T_d), A = Jlog6(T_d⁻¹ T) J_own; translation [m] and rotation [rad] couple, and
    the frame goes home on a screw. World axes: e = [p_d − p; log(R_d Rᵀ)], the frame goes straight. A is
    the exact derivative in both, so the error dies out as ė = −K e. Solà, Deray and Atchuthan (2018).

    `gain` K [1/s] and `weight` (factor of ½‖·‖², in [s²/m²], [s²/rad²]): one number, or six; a weight may
    also be a pair (position, orientation). `axes`: the rows taken, such as "xyz" or "xy y", or six truth
    values, along the axes that the task is expressed in. `target`: a `Target`, or a pose to hold.
    """

    axes: str | Sequence[bool] = field(default="xyzrpy", kw_only=True)
    expressed: Expressed = field(default="own", kw_only=True)
    _ROWS = "xyzrpy"

    def default_name(self) -> str:
        return self.frame


@dataclass(frozen=True, eq=False)
class PositionTask(_OfFrame):
    """Bring the origin of a frame to p_d(t), three rows [m]: A v = ṗ_d + K (p_d − p).

    Along the world's axes A is the positional Jacobian (3.5); along the frame's own axes e = Rᵀ(p_d − p)
    and A has the turning of the axes in it. The reference may give positions (3,) or poses. `gain` [1/s],
    `weight`, `axes` as in `FrameTask`, with three numbers, "xyz".
    """

    axes: str | Sequence[bool] = field(default="xyz", kw_only=True)
    expressed: Expressed = field(default="world", kw_only=True)
    _ROWS = "xyz"

    def default_name(self) -> str:
        return f"{self.frame} position"


@dataclass(frozen=True, eq=False)
class OrientationTask(_OfFrame):
    """Bring the axes of a frame to R_d(t), three rows [rad].

    Own axes: e = log(Rᵀ R_d); world axes: e = log(R_d Rᵀ), the rotation vector in [0, π] either way, and A
    its exact derivative, so a quaternion's sign cannot send the arm the long way round. The reference may
    give rotations (3, 3) or poses, and rates (3,) angular in world axes. `gain`, `weight`, `axes` as in
    `FrameTask`, with three numbers, "rpy".
    """

    axes: str | Sequence[bool] = field(default="rpy", kw_only=True)
    expressed: Expressed = field(default="own", kw_only=True)
    _ROWS = "rpy"

    def default_name(self) -> str:
        return f"{self.frame} orientation"


class BoundFrame:
    """Any of the three for one robot; all that its kernel needs stands in `program` and `memory`."""

    kind = "frame"
    constant = False

    def __init__(
        self,
        robot: Robot,
        name: str,
        frame: str,
        reference: Target,
        mode: int,
        rows: IntArray,
        gain: Array,
        weight: Array,
    ) -> None:
        self.name, self.frame = name, frame
        self.row_names = tuple(ROW_NAMES[i] for i in rows)
        self.row_units = tuple(ROW_UNITS[i] for i in rows)
        self.weight, self.gain = weight[rows], gain[rows]
        self.column: tuple[int, ...] = (-1,) * len(rows)
        self._reference = reference
        self.holds = isinstance(reference, Hold)
        self._space = PoseSpace(f"target of '{name}'", angular=rows[0] >= 3)
        head = [mode, robot.frame_joint(frame), len(rows)]
        self.program = np.concatenate([head, rows, robot.support(frame)]).astype(np.int64)
        self.use(np.zeros(k.MEMORY_SHAPE))
        self.memory[k.GAIN] = gain

    def use(self, memory: Array) -> None:
        self.memory = memory
        self.desired = memory[k.TARGET : k.TARGET + 4, :4]
        self.actual = memory[k.ACTUAL : k.ACTUAL + 4, :4]
        self.error = memory[k.ERROR, : len(self.weight)]
        self._twist = memory[k.TWIST]

    def prepare(self, rows: LevelRows) -> None:
        pass

    def start(self, at: Configuration, t: float) -> None:
        self.memory[k.PLACEMENT : k.PLACEMENT + 4, :4] = at.frame(self.frame).placement
        self._course = self._reference.start(self._space, at.pose(self.frame), t)

    def aim(self, t: float) -> None:
        self.memory[k.MOVING, 0] = self._course(t, self.desired, self._twist)

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        self.aim(t)
        J, placements = at.joint_jacobians, at.joint_placements
        k.frame_rows(self.program, J, placements, self.memory, rows.A, rows.lower, rows.upper)
