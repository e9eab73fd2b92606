"""Bounds on the velocity of a frame: of the hand, or of a floating base."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from taskopt.arrays import Array, ArrayLike, bound
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.base import Limit, RowLimit
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS

Expressed = Literal["own", "world"]


@dataclass(frozen=True, eq=False)
class FrameVelocityLimit(Limit):
    """Keep the velocity of a frame within −w_max ≤ J v ≤ w_max, along each axis.

    J is the Jacobian of the frame. Rows x, y, z [m/s] hold the velocity of its origin, and rows rx, ry, rz
    [rad/s] its angular velocity, along the axes of the world or of the frame. Only axes with a bound have a
    row.

    Args:
        frame: Name of the frame.
        linear: Largest speed along each axis [m/s], one number or three; inf means no bound.
        angular: Largest angular speed about each axis [rad/s], one number or three; inf means no bound.
        expressed: "world" or "own": the axes of the rows.
        name: Name in explanations, logs and plots.

    Raises:
        InvalidValue: A bound is negative or NaN, or there is no bound.

    Source:
        Equation (3.2) for J.
    """

    frame: str
    linear: ArrayLike = np.inf
    angular: ArrayLike = field(default=np.inf, kw_only=True)
    expressed: Expressed = field(default="world", kw_only=True)
    name: str = field(default="frame_velocity", kw_only=True)

    def __post_init__(self) -> None:
        _speeds(self.linear, self.angular)
        _check_axes(self.expressed)

    def bind(self, robot: Robot, dt: float) -> "BoundFrameVelocity":  # noqa: ARG002
        """Return the rows for a robot; see `Limit.bind`.

        Raises:
            UnknownName: The robot has no such frame.
        """
        robot.frame_id(self.frame)
        return BoundFrameVelocity(self.name, self.frame, _speeds(self.linear, self.angular), self.expressed)


@dataclass(frozen=True, eq=False)
class FloatingBaseVelocityLimit(Limit):
    """Keep the velocity of a floating base within bounds, measured at a frame that is fixed to it.

    Rows are those of `FrameVelocityLimit`. Along the axes of the frame they never change.

    Args:
        linear: Largest speed of the frame's origin along each axis [m/s], one number or three; inf is no
            bound.
        angular: Largest angular speed about each axis [rad/s], one number or three; inf means no bound.
        frame: Name of a frame of the base. Default: the base's own.
        expressed: "own" or "world": the axes of the rows.
        name: Name in explanations, logs and plots.

    Raises:
        InvalidValue: A bound is negative or NaN, or there is none; or, when bound, the robot has no floating
            base, or the frame is not fixed to it.
    """

    linear: ArrayLike = np.inf
    angular: ArrayLike = field(default=np.inf, kw_only=True)
    frame: str | None = field(default=None, kw_only=True)
    expressed: Expressed = field(default="own", kw_only=True)
    name: str = field(default="base_velocity", kw_only=True)

    def __post_init__(self) -> None:
        _speeds(self.linear, self.angular)
        _check_axes(self.expressed)

    def bind(self, robot: Robot, dt: float) -> "BoundFrameVelocity":  # noqa: ARG002
        """Return the rows for a robot; see `Limit.bind`.

        Raises:
            InvalidValue: The robot has no floating base, or the frame is not fixed to it.
            UnknownName: The robot has no such frame.
        """
        base = robot.joints[0]
        columns = robot.velocity_index(base)
        if columns.stop - columns.start < 3:
            raise InvalidValue(
                f"{robot.name} has no floating base: its first joint, '{base}', has "
                f"{columns.stop - columns.start} degree of freedom; FrameVelocityLimit takes any frame"
            )
        frame = base if self.frame is None else self.frame
        if robot.frame_joint(frame) != robot.joint_id(base):
            raise InvalidValue(f"frame '{frame}' of '{self.name}' is not fixed to the base '{base}'")
        limits = _speeds(self.linear, self.angular)
        if self.expressed == "world":
            return BoundFrameVelocity(self.name, frame, limits, "world")
        return BoundBaseVelocity(self.name, robot, frame, limits)


class BoundFrameVelocity(RowLimit):
    """Rows −w_max ≤ J v ≤ w_max for the axes that have a bound.

    Args:
        name: Name of the limit.
        frame: Name of the frame.
        limits: Largest speeds, linear and angular, (6,) [m/s, rad/s]; inf where there is no bound.
        expressed: "world" or "own".
        column: For each row, the index j of the velocity if the row is always the unit vector e_j, else −1.
            None means −1 for all rows.
    """

    def __init__(
        self,
        name: str,
        frame: str,
        limits: Array,
        expressed: Expressed,
        column: list[int] | None = None,
    ) -> None:
        self._rows = rows = np.flatnonzero(np.isfinite(limits))
        super().__init__(name, [ROW_NAMES[i] for i in rows], [ROW_UNITS[i] for i in rows], column)
        self._frame, self._limits = frame, limits[rows]
        self._expressed: Expressed = expressed

    def retime(self, dt: float) -> None:
        """Do nothing, since no row depends on Δt; see `Part.retime`."""

    def prepare(self, rows: LevelRows) -> None:
        """Write the bounds; see `RowPart.prepare`."""
        rows.lower[:], rows.upper[:] = -self._limits, self._limits

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the Jacobian of the frame; see `RowPart.fill`."""
        rows.A[:] = configuration.jacobian(self._frame, self._expressed)[self._rows]


class BoundBaseVelocity(BoundFrameVelocity):
    """Rows of a frame of the base in its own axes, which never change.

    Args:
        name: Name of the limit.
        robot: The robot.
        frame: Name of a frame of the base.
        limits: Largest speeds, linear and angular, (6,) [m/s, rad/s]; inf where there is no bound.
    """

    constant = True

    def __init__(self, name: str, robot: Robot, frame: str, limits: Array) -> None:
        J = Configuration(robot, robot.neutral).jacobian(frame, "own")[np.isfinite(limits)]
        unit = [row.max() == 1.0 and np.count_nonzero(row) == 1 for row in J]
        column = [int(row.argmax()) if alone else -1 for row, alone in zip(J, unit, strict=True)]
        super().__init__(name, frame, limits, "own", column)
        self._constant_rows = J

    def prepare(self, rows: LevelRows) -> None:
        """Write rows and bounds; see `RowPart.prepare`."""
        super().prepare(rows)
        rows.A[:] = self._constant_rows

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write nothing, since nothing changes; see `RowPart.fill`."""


def _speeds(linear: ArrayLike, angular: ArrayLike) -> Array:
    """Return the bounds of the six axes; raise `InvalidValue` if there is none, or a negative one."""
    parts = [("linear", linear), ("angular", angular)]
    limits = np.concatenate(
        [np.full(3, bound(n, x, ())) if np.ndim(x) == 0 else bound(n, x, (3,)) for n, x in parts]
    )
    if (limits < 0.0).any():
        raise InvalidValue(f"linear and angular must be ≥ 0, got {limits.min():g}")
    if not np.isfinite(limits).any():
        raise InvalidValue("a limit on the velocity of a frame needs a bound; linear and angular are all inf")
    return limits


def _check_axes(expressed: str) -> None:
    """Raise `InvalidValue` unless `expressed` is "world" or "own"."""
    if expressed not in ("own", "world"):
        raise InvalidValue(f"expressed must be 'own' or 'world', got {expressed!r}")
