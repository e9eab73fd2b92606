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
from typing import cast

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.hierarchy import tolerances
from taskopt.hierarchy.problem import LevelRows
from taskopt.jit import kernel
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.parameter import Parameter, Setting
from taskopt.kinematics.pose import exp3
from taskopt.kinematics.redirection import TargetParameter
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
    itself stays free. Where d moves, E Rᵀ ḋ is added to the right-hand side. Rows "tilt 1" and "tilt 2"
    [rad/s].

    Args:
        frame: Name of the frame.
        axis: Axis (3,) in the frame; its length does not matter.
        direction: Direction (3,) in the world, whose length does not matter, or a `Target` of directions,
            such as `Function`, `Line` or `Latest`. Rates of a direction are angular velocities (3,) [rad/s]
            in the world. None: the direction of the axis at the start.
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
    direction: Target | ArrayLike | None = field(default=(0.0, 0.0, 1.0), kw_only=True)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        unit("axis", self.axis)
        if self.direction is not None and not isinstance(self.direction, Target):
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
        bound = BoundAlignment(name, self, robot.nv)
        bound.attach(as_target(self.direction))
        return bound


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


class DirectionSpace:
    """Directions, which are unit vectors (3,); rates are angular velocities (3,) [rad/s] in the world.

    Args:
        name: Name of a value in error messages.
    """

    tangent = 3

    def __init__(self, name: str) -> None:
        self._name = name

    def convert(self, value: Value, start: Array) -> Array:  # noqa: ARG002 (protocol)
        """Scale a vector (3,) to length 1; see `Space.convert`."""
        return unit(self._name, cast("ArrayLike", value))

    def take(self, value: Value, start: Array, out: Array) -> None:
        """Write a vector (3,), scaled to length 1; see `Space.take`."""
        out[:] = self.convert(value, start)

    def convert_rate(self, rate: Value) -> Array:
        """Return an angular velocity (3,) [rad/s]; see `Space.convert_rate`."""
        return finite(f"rate of {self._name}", cast("ArrayLike", rate), (3,))

    def take_rate(self, rate: Value, out: Array) -> None:
        """Write an angular velocity (3,) [rad/s]; see `Space.take_rate`."""
        out[:] = self.convert_rate(rate)

    def difference(self, a: Array, b: Array) -> Array:
        """Return the shortest turn (3,) [rad] from one direction to another; see `Space.difference`."""
        turn = np.cross(a, b)
        sine, cosine = float(np.linalg.norm(turn)), float(a @ b)
        if sine < tolerances.PARALLEL:  # at 180° every way is as short
            return turn if cosine > 0.0 else np.pi * across(a)[0]
        return turn * (np.arctan2(sine, cosine) / sine)

    def move(self, a: Array, delta: Array, out: Array) -> None:
        """Write a direction after a turn; see `Space.move`."""
        out[:] = exp3(delta) @ a


class BoundAlignment(_BoundTurn, AimedTask):
    """The two rows of an `AxisAlignmentTask`; the goal is the direction, (3,)."""

    def attach(self, target: Target) -> None:
        """Set the target.

        Args:
            target: Target of directions.
        """
        self.take_target(target, DirectionSpace(f"direction of '{self.name}'"))
        self.goal, self._turning = np.zeros(3), np.zeros(3)

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the target from the present direction of the axis; see `RowPart.start`."""
        self.begin(configuration.pose(self._frame)[:3, :3] @ self._axis, t)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return gain and direction; see `Part.adjustable`."""
        direction = _Direction(self.name, self.goal, self.space, self.redirect)
        return {"gain": super().adjustable()["gain"], "direction": direction}

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows; see `RowPart.fill`."""
        moves = self._course(t, self.goal, self._turning)
        configuration.frame_into(self._frame, self._pose, self._jacobian)
        to_frame = self._pose[:3, :3].T
        self._turn(to_frame @ self.goal, 0.0, rows)
        rows.lower[:] = self.gain * self.error
        if moves:
            rows.lower[:] += self._slope @ (to_frame @ np.cross(self._turning, self.goal))
        rows.upper[:] = rows.lower


class _Direction(TargetParameter):
    """The parameter "direction", whose vectors are scaled to length 1."""

    def checked(self, value: Setting, over: float) -> Target | Array:
        """Return a `Target`, or a direction to hold; see `Parameter.checked`."""
        if over > 0.0 or isinstance(value, Target):
            return super().checked(value, over)
        return self._space.convert(cast("Value", value), self._goal)


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
