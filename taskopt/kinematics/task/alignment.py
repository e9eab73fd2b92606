"""Tasks that point an axis of a frame along a direction or at a point, by two rows across the axis.

Let a be the axis and c the direction that it should have, both in the frame. With φ the angle between them,
p the unit vector across a towards c, and ŝ = a × p, the error is the turn φ ŝ that carries a to c by the
shortest way, in coordinates of two unit vectors across a. As c moves,

    d(φ ŝ) = ŝ (τ·dc) − (φ/sin φ) p (ŝ·dc),   τ = −sin φ a + cos φ p,

which is of rank 2 at every angle. It grows as 1/sin φ towards 180°, where all ways back are equally short;
from `OPPOSITE` on the quotient is held, so that the rows stay of ordinary size. At exactly 180° the first of
the two vectors is the axis of the turn.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike
from taskopt.hierarchy import tolerances
from taskopt.hierarchy.problem import LevelRows
from taskopt.jit import kernel
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.parameter import Numbers, Parameter
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import PoseSpace, Value
from taskopt.kinematics.target import Target, as_target, unit
from taskopt.kinematics.task.aimed import AimedTask
from taskopt.kinematics.task.base import BoundTask, Task, gains, task_rate, weights


@dataclass(frozen=True, eq=False)
class AxisAlignmentTask(Task):
    """Turn an axis of a frame parallel to a direction of the world: E [c]× Rᵀ J_O v = −K e, two rows.

    R is the rotation of the frame and J_O the rotational part of its Jacobian, in the axes of the world.
    c = Rᵀ d is the direction d in the frame. The error e is the shortest turn that carries the axis to c,
    given by its two coordinates across the axis, and E = ∂e/∂c (see the module). The turn about the axis
    itself stays free. Rows "tilt 1" and "tilt 2" [rad/s].

    Args:
        frame: Name of the frame.
        axis: Axis (3,) in the frame; its length does not matter.
        direction: Direction (3,) in the world; its length does not matter.
        gain: K [1/s], one number or two. More lets the error die out faster and asks for larger velocities;
            it must stay below 2/Δt.
        weight: Factor of ½ (A v − b)² within the level [s²/rad²], one number or two. More lets this task win
            over others of the same level.
        name: Name in logs and plots. Default: the name of the frame and "axis".

    Raises:
        InvalidValue: A vector has no direction, or a number is out of its range.

    Source:
        Equations (3.67)–(3.70), with the turn of the axis as error.
    """

    frame: str
    axis: ArrayLike = (0.0, 0.0, 1.0)
    direction: ArrayLike = (0.0, 0.0, 1.0)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        unit("axis", self.axis)
        unit("direction", self.direction)
        gains(self.gain, 2)
        weights(self.weight, 2)

    def default_name(self) -> str:
        """Return the name of the frame and "axis"."""
        return f"{self.frame} axis"

    def bind(self, robot: Robot, name: str) -> "BoundAlignment":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no such frame.
        """
        robot.frame_id(self.frame)
        return BoundAlignment(name, self, robot.nv)


@dataclass(frozen=True, eq=False)
class LookAtTask(Task):
    """Point an axis of a frame at a target point p_d.

    The line of sight goes from the origin of the frame to p_d; d is its direction (a unit vector) and ℓ its
    length. With c = Rᵀ d, J_P and J_O the two parts of the frame's Jacobian, and e and E as in
    `AxisAlignmentTask`,

        A = −E ([c]× Rᵀ J_O − Rᵀ J_P/ℓ),   b = E Rᵀ ṗ_d/ℓ + K e.

    Rows "tilt 1" and "tilt 2" [rad/s]. `GazeTask` asks for no more than that the point is in view.

    Args:
        frame: Name of the frame that looks.
        target: Point (3,) [m] in the world, or a `Target` of points or poses, whose motion is fed forward.
        axis: Direction (3,) in which the frame looks, in its own axes.
        gain: K [1/s], one number or two. More lets the error die out faster and asks for larger velocities;
            it must stay below 2/Δt.
        weight: Factor of ½ (A v − b)² within the level [s²/rad²], one number or two. More lets this task win
            over others of the same level.
        name: Name in logs and plots. Default: the name of the frame and "look".

    Raises:
        InvalidValue: The axis has no direction, or a number is out of its range.

    Source:
        Equations (3.67)–(3.70), with the turn of the axis as error.
    """

    frame: str
    target: Target | Value
    axis: ArrayLike = field(default=(0.0, 0.0, 1.0), kw_only=True)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        unit("axis", self.axis)
        gains(self.gain, 2)
        weights(self.weight, 2)

    def default_name(self) -> str:
        """Return the name of the frame and "look"."""
        return f"{self.frame} look"

    def bind(self, robot: Robot, name: str) -> "BoundLook":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no such frame.
        """
        robot.frame_id(self.frame)
        bound = BoundLook(name, self, robot.nv)
        bound.attach(as_target(self.target))
        return bound


class _BoundTurn(BoundTask):
    """Two rows that turn an axis of a frame; subclasses say towards which direction."""

    def __init__(self, name: str, task: AxisAlignmentTask | LookAtTask, nv: int) -> None:
        super().__init__(name, ("tilt 1", "tilt 2"), ("rad/s", "rad/s"), task.gain, task.weight)
        self._frame, self._axis = task.frame, unit("axis", task.axis)
        self._across, self._slope = across(self._axis), np.zeros((2, 3))
        self._pose, self._jacobian = np.eye(4), np.zeros((6, nv))

    def _turn(self, seen: Array, nearness: float, rows: LevelRows) -> None:
        """Write e, E and A for a direction c (3,) to a point that is 1/`nearness` [m] away."""
        turn_into(self._axis, self._across, seen, self.error, self._slope)
        turned_rows_into(self._pose, self._jacobian, seen, self._slope, nearness, rows.A)


class BoundAlignment(_BoundTurn):
    """The two rows of an `AxisAlignmentTask`.

    Args:
        name: Name of the task in its plan.
        task: The declared task.
        nv: Number of velocities of the robot.
    """

    def __init__(self, name: str, task: AxisAlignmentTask, nv: int) -> None:
        super().__init__(name, task, nv)
        self._direction = unit("direction", task.direction)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return gain and direction; see `Part.adjustable`."""
        direction = Numbers(self._direction, self._checked_direction, self._shorten)
        return {**super().adjustable(), "direction": direction}

    def _checked_direction(self, direction: ArrayLike) -> Array:
        """Check a direction, and return it at length 1."""
        equal = np.ndim(direction) == 0  # `Numbers` reads three equal numbers as one
        return unit(f"direction of '{self.name}'", np.full(3, direction) if equal else direction)

    def _shorten(self) -> None:
        """Scale a direction that is blended between two others to length 1."""
        self._direction /= max(float(np.linalg.norm(self._direction)), tolerances.NO_DIRECTION)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the rows; see `RowPart.fill`."""
        configuration.frame_into(self._frame, self._pose, self._jacobian)
        self._turn(self._pose[:3, :3].T @ self._direction, 0.0, rows)
        rows.lower[:] = self.gain * self.error
        rows.upper[:] = rows.lower


class BoundLook(_BoundTurn, AimedTask):
    """The two rows of a `LookAtTask`."""

    def attach(self, target: Target) -> None:
        """Set the target.

        Args:
            target: Target, in the terms of `taskopt.kinematics.target`.
        """
        self.take_target(target, PoseSpace(f"target of '{self.name}'"))
        self.goal, self._twist = np.eye(4), np.zeros(6)

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the target from the present pose of the frame; see `RowPart.start`."""
        self.begin(configuration.pose(self._frame), t)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows; see `RowPart.fill`."""
        if not self._course(t, self.goal, self._twist):
            self._twist[:] = 0.0
        configuration.frame_into(self._frame, self._pose, self._jacobian)
        turn, sight = self._pose[:3, :3], self.goal[:3, 3] - self._pose[:3, 3]
        length = float(np.sqrt(sight @ sight))
        seen = self._axis if length < tolerances.NO_DIRECTION else turn.T @ sight / length
        length = max(length, tolerances.NEAREST_SIGHT)
        self._turn(seen, 1.0 / length, rows)
        rate = self._slope @ (turn.T @ self._twist[:3]) / length
        rows.lower[:] = task_rate(rate, self.gain, self.error)
        rows.upper[:] = rows.lower


def across(axis: Array) -> Array:
    """Return two unit vectors at right angles to an axis and to each other.

    Args:
        axis: Unit vector, (3,).

    Returns:
        Rows (2, 3), which form a right-handed frame with the axis; for the axis z they are x and y.
    """
    first = np.zeros(3)
    first[int(np.argmin(np.abs(axis)))] = 1.0
    first -= axis * (axis @ first)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(axis, first)])


@kernel
def turn_into(axis, tangent, seen, error, slope):
    """Write the shortest turn that carries an axis to a direction, and its derivative.

    Args:
        axis: Unit axis a, (3,).
        tangent: Two unit vectors across it, (2, 3).
        seen: Unit direction c, in the same frame, (3,).
        error: Coordinates of φ ŝ along the two vectors, (2,) [rad], written here.
        slope: Their derivative along c, (2, 3), written here.
    """
    cosine = axis[0] * seen[0] + axis[1] * seen[1] + axis[2] * seen[2]
    x = tangent[0, 0] * seen[0] + tangent[0, 1] * seen[1] + tangent[0, 2] * seen[2]
    y = tangent[1, 0] * seen[0] + tangent[1, 1] * seen[1] + tangent[1, 2] * seen[2]
    sine = np.sqrt(x * x + y * y)
    angle = np.arctan2(sine, cosine)
    least = tolerances.OPPOSITE if cosine < 0.0 else tolerances.PARALLEL
    if sine >= tolerances.PARALLEL:
        px, py, grows = x / sine, y / sine, angle / max(sine, least)
        error[0], error[1] = -angle * py, angle * px
    else:  # any way is as short: ŝ is the first vector
        px, py, grows = 0.0, -1.0, angle / least if cosine < 0.0 else 1.0
        error[0], error[1] = (angle, 0.0) if cosine < 0.0 else (-y, x)
    # In coordinates across the axis p = (px, py) and ŝ = a × p = (−py, px).
    for i in range(3):
        p = px * tangent[0, i] + py * tangent[1, i]
        s = -py * tangent[0, i] + px * tangent[1, i]
        away = cosine * p - sine * axis[i]
        slope[0, i] = -py * away - grows * px * s
        slope[1, i] = px * away - grows * py * s


@kernel
def turned_rows_into(pose, jacobian, seen, slope, nearness, A):
    """Write the rows A = −E ([c]× Rᵀ J_O − Rᵀ J_P/ℓ); `LookAtTask` explains the symbols.

    Args:
        pose: Pose of the frame in the world, (4, 4).
        jacobian: Geometric Jacobian of the frame along the axes of the world, (6, nv).
        seen: Unit direction c in the frame, (3,).
        slope: E, (2, 3).
        nearness: 1/ℓ [1/m]; 0 for a fixed direction in the world, as of a point at infinity.
        A: Rows, (2, nv), written here.
    """
    for k in range(A.shape[1]):
        A[0, k] = A[1, k] = 0.0
        x = y = z = 0.0
        for i in range(3):
            x += pose[i, 0] * jacobian[3 + i, k]
            y += pose[i, 1] * jacobian[3 + i, k]
            z += pose[i, 2] * jacobian[3 + i, k]
        turning = y * seen[2] - z * seen[1], z * seen[0] - x * seen[2], x * seen[1] - y * seen[0]
        for j in range(3):
            moved = 0.0
            for i in range(3):
                moved += pose[i, j] * jacobian[i, k]
            change = turning[j] + nearness * moved
            A[0, k] += slope[0, j] * change
            A[1, k] += slope[1, j] * change
