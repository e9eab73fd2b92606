"""The task that places a frame relative to another frame, which may move itself."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from taskopt.arrays import Array, ArrayLike, IntArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.pose import adjoint, inverse, is_pose, jlog3, jlog6, log3, log6
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS, PoseSpace, Value, chosen_rows
from taskopt.kinematics.target import Hold, Target, as_target
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
    root: str
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
        bound = BoundRelative(name, self, self._rows())
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
    """

    def __init__(self, name: str, task: RelativeFrameTask, rows: IntArray) -> None:
        names, units = [ROW_NAMES[i] for i in rows], [ROW_UNITS[i] for i in rows]
        super().__init__(name, names, units, gains(task.gain, 6)[rows], weights(task.weight, 6, (3, 3))[rows])
        self.frame, self._root, self._rows = task.frame, task.root, rows
        self._frame, self._own = task.frame, task.expressed == "own"
        self.goal, self._twist = np.eye(4), np.zeros(6)
        self.desired, self.actual = np.eye(4), np.eye(4)

    def attach(self, target: Target) -> None:
        """Take a target.

        Args:
            target: Target, in the terms of `taskopt.kinematics.target`.
        """
        self.take_target(target, PoseSpace(f"target of '{self.name}'", angular=bool(self._rows[0] >= 3)))

    def start(self, configuration: Configuration, t: float) -> None:
        """Anchor the target at the present pose of the frame in the root; see `RowPart.start`."""
        relative = inverse(configuration.pose(self._root)) @ configuration.pose(self._frame)
        self.begin(relative, t)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows; see `RowPart.fill`."""
        if not self._course(t, self.goal, self._twist):
            self._twist[:] = 0.0
        root, frame = configuration.pose(self._root), configuration.pose(self._frame)
        self.desired[:], self.actual[:] = root @ self.goal, frame  # type: ignore[index]
        pose, motion = inverse(root) @ frame, self._relative_motion(configuration, root, frame)
        error, M, rate = (_own if self._own else _in_root)(pose, self.goal, self._twist)
        flaw = 0.0 if is_pose(self.goal) else np.nan  # found by the plan, which names the target
        taken = self._rows
        rows.A[:] = M[taken] @ motion
        self.error[:] = error[taken]
        rows.lower[:] = task_rate(rate[taken], self.gain, self.error) + flaw
        rows.upper[:] = rows.lower

    def _relative_motion(self, configuration: Configuration, root: Array, frame: Array) -> Array:
        """Return w (6, nv): velocity of the frame relative to the root for each v_k, in the root's axes."""
        J = configuration.jacobian(self._frame)
        of_root = configuration.jacobian(self._root)
        arm = frame[:3, 3] - root[:3, 3]
        J[:3] -= of_root[:3] + np.cross(of_root[3:], arm, axisa=0, axisc=0)
        J[3:] -= of_root[3:]
        J[:3], J[3:] = root[:3, :3].T @ J[:3], root[:3, :3].T @ J[3:]
        return J


def _own(pose: Array, goal: Array, twist: Array) -> tuple[Array, Array, Array]:
    """Return e (6,), the matrix M (6, 6) with ė = M (w_d − w), and M w_d (6,), in the axes of the frame."""
    away = inverse(goal) @ pose
    jlog, back = jlog6(away), np.zeros((6, 6))
    back[:3, :3] = back[3:, 3:] = pose[:3, :3].T
    turned = np.concatenate([goal[:3, :3].T @ twist[:3], goal[:3, :3].T @ twist[3:]])
    return -log6(away), jlog @ back, jlog @ (adjoint(inverse(away)) @ turned)


def _in_root(pose: Array, goal: Array, twist: Array) -> tuple[Array, Array, Array]:
    """Return e (6,), the matrix M (6, 6) with ė = M (w_d − w), and M w_d (6,), in the axes of the root."""
    turn = goal[:3, :3] @ pose[:3, :3].T
    M = np.eye(6)
    M[3:, 3:] = jlog3(turn)
    rate = np.concatenate([twist[:3], M[3:, 3:] @ (turn.T @ twist[3:])])
    return np.concatenate([goal[:3, 3] - pose[:3, 3], log3(turn)]), M, rate
