"""The task that places a frame relative to another frame, which may move itself."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from taskopt.arrays import Array, ArrayLike, IntArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.jit import kernel
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.lie import log6_jlog6_into, relative_into, turned_back
from taskopt.kinematics.pose import inverse, is_pose
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS, PoseSpace, Value, chosen_rows
from taskopt.kinematics.target import Hold, Target, as_target, check_target
from taskopt.kinematics.task.aimed import AimedTask
from taskopt.kinematics.task.base import Task, gains, task_rate, weights

Seen = Literal["own", "root"]


@dataclass(frozen=True, eq=False)
class RelativeFrameTask(Task):
    """Bring a frame to a target pose X_d(t) relative to a root frame, six rows: A v = b with b = ẋ_d + K e.

    X = T_r⁻¹ T_f is the pose of the frame in the root, with origin x and rotation R. w (6, nv) is the
    velocity of the frame relative to the root for each joint velocity.

        own axes     e = log6(X⁻¹ X_d),              A = Jlog6(X_d⁻¹ X) (J_f − Ad_X⁻¹ J_r), each J in its own
                                                     frame
        root axes    e = [x_d − x; log3(R_d Rᵀ)],    A = diag(I, Jlog3(R_d Rᵀ)) w, in the axes of the root

    Rows x, y, z [m/s] and rx, ry, rz [rad/s]. Joints that carry both frames do not appear in A, so that two
    hands can hold a part while the body walks. With `expressed="root"` and `axes="xyz"` the task controls
    only the position in the root.

    Args:
        frame: Name of the frame.
        root: Name of the frame relative to which it is placed.
        target: Target pose in the root: a (4, 4) array, a position (3,) [m], or a `Target`, whose rate is in
            the axes of the root. Default: the relative pose at the start.
        gain: K [1/s], one number or six. More lets the error die out faster and asks for larger velocities;
            it must stay below 2/Δt.
        weight: Factor of ½ (A v − b)² within the level, in [s²/m²] and [s²/rad²]: one number, a pair
            (position, orientation), or six. More lets this task win over others of the same level.
        axes: Rows that are taken, such as "xyz", or six truth values.
        expressed: "own" or "root": the axes in which e is measured.
        name: Name in logs and plots. Default: the names of both frames.

    Raises:
        InvalidValue: Both frames are the same, a number is out of its range, or no row is left.

    Source:
        Equations (3.67)–(3.70). The derivative in own axes: Solà, Deray and Atchuthan (2018), eq. 79.
    """

    frame: str
    root: str = field(kw_only=True)
    target: Target | Value = field(default_factory=Hold, kw_only=True)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    axes: str | Sequence[bool] = field(default="xyzrpy", kw_only=True)
    expressed: Seen = field(default="own", kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if self.frame == self.root:
            raise InvalidValue(f"a relative task needs two frames, got '{self.frame}' twice")
        if self.expressed not in ("own", "root"):
            raise InvalidValue(f"expressed must be 'own' or 'root', got {self.expressed!r}")
        gains(self.gain, 6)
        self._rows()
        check_target(self.target, PoseSpace(f"target of '{self.name or self.default_name()}'"))

    def default_name(self) -> str:
        """Return the names of both frames."""
        return f"{self.frame} in {self.root}"

    def bind(self, robot: Robot, name: str) -> "BoundRelative":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot lacks one of the two frames.
        """
        robot.frame_id(self.frame)
        robot.frame_id(self.root)
        bound = BoundRelative(name, self, self._rows(), robot.nv)
        bound.attach(as_target(self.target))
        return bound

    def _rows(self) -> IntArray:
        """Return the rows of six that are taken; one with weight 0 asks for nothing."""
        rows = chosen_rows(self.axes, "xyzrpy")
        kept = rows[weights(self.weight, 6, (3, 3))[rows] > 0.0]
        if kept.size == 0:
            raise InvalidValue("weight is 0 for all the axes chosen")
        return kept


class BoundRelative(AimedTask):
    """The rows of a `RelativeFrameTask`; `desired` and `actual` are poses in the world.

    Args:
        name: Name of the task in its plan.
        task: The declared task.
        rows: Rows of six that are taken, (m,).
        nv: Number of velocities of the robot.
    """

    def __init__(self, name: str, task: RelativeFrameTask, rows: IntArray, nv: int) -> None:
        names, units = [ROW_NAMES[i] for i in rows], [ROW_UNITS[i] for i in rows]
        super().__init__(name, names, units, gains(task.gain, 6)[rows], weights(task.weight, 6, (3, 3))[rows])
        self.frame, self._root, self._rows = task.frame, task.root, rows
        self._frame, self._own = task.frame, task.expressed == "own"
        self.goal, self._twist, self._arrays = np.eye(4), np.zeros(6), RelativeError.empty()
        self._of_root, self._of_frame = np.zeros((6, nv)), np.zeros((6, nv))
        self.desired, self.actual = np.eye(4), np.eye(4)

    def attach(self, target: Target) -> None:
        """Set the target.

        Args:
            target: Target, in the terms of `taskopt.kinematics.target`.
        """
        self.take_target(target, PoseSpace(f"target of '{self.name}'", angular=bool(self._rows[0] >= 3)))

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the target from the present pose of the frame in the root; see `RowPart.start`."""
        relative = inverse(configuration.pose(self._root)) @ configuration.pose(self._frame)
        self.begin(relative, t)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows; see `RowPart.fill`."""
        if not self._course(t, self.goal, self._twist):
            self._twist[:] = 0.0
        arrays = self._arrays
        configuration.frame_into(self._root, arrays.root, self._of_root)
        configuration.frame_into(self._frame, self.actual, self._of_frame)  # type: ignore[arg-type]
        relative_motion_into(arrays.root, self.actual, self._of_root, self._of_frame)
        relative_error_into(self._own, self.actual, self.goal, self._twist, arrays)
        self.desired[:] = arrays.root @ self.goal  # type: ignore[index]
        taken = self._rows
        rows.A[:] = arrays.M[taken] @ self._of_frame
        self.error[:] = arrays.error[taken]
        flaw = 0.0 if is_pose(self.goal) else np.nan  # found by the plan, which names the target
        rows.lower[:] = task_rate(arrays.rate[taken], self.gain, self.error) + flaw
        rows.upper[:] = rows.lower


class RelativeError(NamedTuple):
    """Working arrays of a `RelativeFrameTask`, whose docstring explains the symbols.

    Attributes:
        root: Pose of the root in the world, (4, 4).
        pose: Pose X of the frame in the root, (4, 4).
        away: In own axes X_d⁻¹ X, in root axes the rotation from X to X_d, (4, 4).
        error: e of all six rows, (6,).
        M: Matrix with ė = M (w_d − w), (6, 6).
        jlog: Jlog6 of `away`, (6, 6).
        rate: M w_d, (6,).
    """

    root: Array
    pose: Array
    away: Array
    error: Array
    M: Array
    jlog: Array
    rate: Array

    @staticmethod
    def empty() -> "RelativeError":
        """Allocate the arrays; their numbers are not valid yet."""
        return RelativeError(
            np.eye(4), np.eye(4), np.eye(4), np.zeros(6), np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(6)
        )


@kernel
def relative_motion_into(root, frame, of_root, of_frame):
    """Compute the Jacobian of the motion w of a frame relative to the root, in the root's axes.

    Args:
        root: Pose of the root in the world, (4, 4).
        frame: Pose of the frame in the world, (4, 4).
        of_root: Jacobian of the root along the axes of the world, (6, nv).
        of_frame: Jacobian of the frame along the axes of the world, (6, nv); overwritten by that of w.
    """
    x, y, z = frame[0, 3] - root[0, 3], frame[1, 3] - root[1, 3], frame[2, 3] - root[2, 3]
    for k in range(of_frame.shape[1]):
        wx, wy, wz = of_root[3, k], of_root[4, k], of_root[5, k]
        v = (
            of_frame[0, k] - of_root[0, k] - (wy * z - wz * y),
            of_frame[1, k] - of_root[1, k] - (wz * x - wx * z),
            of_frame[2, k] - of_root[2, k] - (wx * y - wy * x),
        )
        w = of_frame[3, k] - wx, of_frame[4, k] - wy, of_frame[5, k] - wz
        for i in range(3):
            of_frame[i, k] = root[0, i] * v[0] + root[1, i] * v[1] + root[2, i] * v[2]
            of_frame[3 + i, k] = root[0, i] * w[0] + root[1, i] * w[1] + root[2, i] * w[2]


@kernel
def relative_error_into(own, frame, goal, twist, arrays):
    """Compute e, the matrix M with ė = M (w_d − w), and M w_d.

    In own axes the linear part of w_d is taken at x instead of x_d. In root axes the inverse of the rotation
    from X to X_d is applied to its angular part.

    Args:
        own: True to measure e in the axes of the frame, False in those of the root.
        frame: Pose of the frame in the world, (4, 4).
        goal: X_d, (4, 4).
        twist: Rate of X_d in the axes of the root, (6,).
        arrays: A `RelativeError` in which `root` is set; all other arrays are written here.
    """
    pose, away, M, jlog = arrays.pose, arrays.away, arrays.M, arrays.jlog
    relative_into(arrays.root, frame, pose)
    if own:
        relative_into(goal, pose, away)
    else:
        for i in range(3):
            for j in range(3):
                away[i, j] = goal[i, 0] * pose[j, 0] + goal[i, 1] * pose[j, 1] + goal[i, 2] * pose[j, 2]
            away[i, 3] = 0.0  # without a translation, Jlog6 is diag(Jlog3, Jlog3)
    log6_jlog6_into(away, arrays.error, jlog)
    px, py, pz = goal[0, 3] - pose[0, 3], goal[1, 3] - pose[1, 3], goal[2, 3] - pose[2, 3]
    v, w = (twist[0], twist[1], twist[2]), (twist[3], twist[4], twist[5])
    if own:
        v = v[0] + py * w[2] - pz * w[1], v[1] + pz * w[0] - px * w[2], v[2] + px * w[1] - py * w[0]
        for i in range(6):
            arrays.error[i] = -arrays.error[i]
            for j in range(3):
                M[i, j] = jlog[i, 0] * pose[j, 0] + jlog[i, 1] * pose[j, 1] + jlog[i, 2] * pose[j, 2]
                M[i, 3 + j] = jlog[i, 3] * pose[j, 0] + jlog[i, 4] * pose[j, 1] + jlog[i, 5] * pose[j, 2]
    else:
        w = turned_back(away, w)
        M[:] = jlog
        for i in range(3):
            M[i, :] = 0.0
            M[i, i] = 1.0
        arrays.error[0], arrays.error[1], arrays.error[2] = px, py, pz
    for i in range(6):
        arrays.rate[i] = M[i, 0] * v[0] + M[i, 1] * v[1] + M[i, 2] * v[2]
        arrays.rate[i] += M[i, 3] * w[0] + M[i, 4] * w[1] + M[i, 5] * w[2]
