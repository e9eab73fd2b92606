"""Wheels on a floor: rolling without slip, and omniwheels, which may slip along their axle."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, ArrayLike, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.hierarchy.tolerances import PARALLEL
from taskopt.kinematics.configuration import Configuration, frame_jacobian_into
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.target import unit
from taskopt.kinematics.task.base import BoundTask, Task, gains, weights
from taskopt.kinematics.task.relative import relative_motion_into


@dataclass(frozen=True, eq=False)
class RollingTask(Task):
    """Let a wheel roll without slip: the point of the wheel that touches the floor does not move along it.

    With n the z-axis of the floor, h the height of the hub above it, and v_c the velocity of the wheel at the
    contact p − ρ n, relative to the floor and in its axes,

        x: v_c,x = 0,    y: v_c,y = 0,    z: v_c,z = K (ρ − h).

    Rows x, y, z [m/s]. The wheel is a disc that stands upright: its lowest point is straight below the hub.

    Args:
        hub: Name of a frame of the wheel whose origin is the centre of the wheel.
        radius: ρ > 0 [m].
        floor: Name of a frame in whose plane z = 0 the floor is. Default: the world.
        gain: K [1/s]. More brings the wheel to its height faster; it must stay below 2/Δt.
        weight: Factor of ½ (A v − b)² within the level [s²/m²], one number or three. More lets this task win
            over others of the same level.
        name: Name in logs and plots. Default: the name of the hub and "rolling".

    Raises:
        InvalidValue: Hub and floor are the same frame, or a number is out of its range.

    Source:
        Rolling contact: Murray, Li and Sastry (1994), A Mathematical Introduction to Robotic Manipulation,
        ch. 7.
    """

    hub: str
    radius: float
    floor: str | None = None
    gain: float = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        _checked(self.hub, self.radius, self.floor)
        gains(self.gain, 1)
        weights(self.weight, 3)

    def default_name(self) -> str:
        """Return the name of the hub and "rolling"."""
        return f"{self.hub} rolling"

    def bind(self, robot: Robot, name: str) -> "BoundRolling":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no such frame.
        """
        wheel = Wheel.of(robot, self.hub, self.floor, float(self.radius))
        gain = np.array([0.0, 0.0, float(self.gain)])
        return BoundRolling(name, wheel, gain, weights(self.weight, 3))


@dataclass(frozen=True, eq=False)
class OmniwheelTask(Task):
    """Let an omniwheel roll, whose contact may slip along the axle but not in the rolling direction.

    With u the direction in the plane of the floor at right angles to the axle, and all other symbols as in
    `RollingTask`,

        roll: u·v_c = 0,    z: v_c,z = K (ρ − h).

    Rows "roll" and z [m/s]. A wheel whose axle is at right angles to the floor has no rolling direction; its
    first row is zero.

    Args:
        hub: Name of a frame of the wheel whose origin is the centre of the wheel.
        radius: ρ > 0 [m].
        floor: Name of a frame in whose plane z = 0 the floor is. Default: the world.
        axle: Direction (3,) of the axle in the frame of the hub.
        gain: K [1/s]. More brings the wheel to its height faster; it must stay below 2/Δt.
        weight: Factor of ½ (A v − b)² within the level [s²/m²], one number or two. More lets this task win
            over others of the same level.
        name: Name in logs and plots. Default: the name of the hub and "rolling".

    Raises:
        InvalidValue: Hub and floor are the same frame, the axle has no direction, or a number is out of its
            range.
    """

    hub: str
    radius: float
    floor: str | None = None
    axle: ArrayLike = field(default=(0.0, 1.0, 0.0), kw_only=True)
    gain: float = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        _checked(self.hub, self.radius, self.floor)
        unit("axle", self.axle)
        gains(self.gain, 1)
        weights(self.weight, 2)

    def default_name(self) -> str:
        """Return the name of the hub and "rolling"."""
        return f"{self.hub} rolling"

    def bind(self, robot: Robot, name: str) -> "BoundOmniwheel":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no such frame.
        """
        wheel = Wheel.of(robot, self.hub, self.floor, float(self.radius))
        bound = BoundOmniwheel(name, wheel, np.array([0.0, float(self.gain)]), weights(self.weight, 2))
        bound.attach(unit("axle", self.axle))
        return bound


class Wheel(NamedTuple):
    """A wheel and its floor.

    Attributes:
        hub: Name of the frame in the centre of the wheel.
        floor: Name of the frame of the floor, or None for the world.
        radius: ρ [m].
    """

    hub: str
    floor: str | None
    radius: float

    @staticmethod
    def of(robot: Robot, hub: str, floor: str | None, radius: float) -> "Wheel":
        """Return the wheel of a robot.

        Args:
            robot: The robot.
            hub: Name of the frame in the centre of the wheel.
            floor: Name of the frame of the floor, or None for the world.
            radius: ρ [m].

        Returns:
            The wheel.

        Raises:
            UnknownName: The robot has no such frame.
        """
        for frame in (hub, *([floor] if floor else [])):
            robot.frame_id(frame)
        return Wheel(hub, floor, radius)

    def contact(self, configuration: Configuration) -> tuple[Array, Array, float]:
        """Compute the motion of the wheel at its contact with the floor.

        Args:
            configuration: The robot at q.

        Returns:
            Rotation of the floor (3, 3) in the world; Jacobian (3, nv) of v_c, the velocity of the wheel at
            the contact relative to the floor, in the axes of the floor; and the height h of the hub above the
            floor [m].
        """
        floor, of_floor = np.eye(4), np.zeros((6, configuration.robot.nv))
        if self.floor is not None:
            configuration.frame_into(self.floor, floor, of_floor)
        contact, moves = configuration.pose(self.hub), np.zeros_like(of_floor)
        height = float(floor[:3, 2] @ (contact[:3, 3] - floor[:3, 3]))
        contact[:3, 3] -= self.radius * floor[:3, 2]
        columns = configuration.frame(self.hub).columns
        frame_jacobian_into(configuration.joint_jacobians, contact, columns, moves)
        relative_motion_into(floor, contact, of_floor, moves)
        return floor[:3, :3], moves[:3], height


class BoundRolling(BoundTask):
    """The three rows of a `RollingTask`.

    Args:
        name: Name of the task in its plan.
        wheel: The wheel.
        gain: K of each row [1/s], (3,); 0 for rows that ask for a velocity.
        weight: Weight of each row, (3,).
    """

    def __init__(self, name: str, wheel: Wheel, gain: Array, weight: Array) -> None:
        super().__init__(name, ("x", "y", "z"), ("m/s",) * 3, gain, weight)
        self._wheel = wheel

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the rows; see `RowPart.fill`."""
        _, rows.A[:], height = self._wheel.contact(configuration)
        self.error[2] = self._wheel.radius - height
        rows.lower[:] = self.gain * self.error
        rows.upper[:] = rows.lower


class BoundOmniwheel(BoundTask):
    """The two rows of an `OmniwheelTask`.

    Args:
        name: Name of the task in its plan.
        wheel: The wheel.
        gain: K of each row [1/s], (2,); 0 for rows that ask for a velocity.
        weight: Weight of each row, (2,).
    """

    def __init__(self, name: str, wheel: Wheel, gain: Array, weight: Array) -> None:
        super().__init__(name, ("roll", "z"), ("m/s",) * 2, gain, weight)
        self._wheel = wheel

    def attach(self, axle: Array) -> None:
        """Set the direction of the axle.

        Args:
            axle: Unit vector in the frame of the hub, (3,).
        """
        self._axle = axle

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the rows; see `RowPart.fill`."""
        floor, moves, height = self._wheel.contact(configuration)
        axle = floor.T @ configuration.pose(self._wheel.hub)[:3, :3] @ self._axle
        length = float(np.hypot(axle[0], axle[1]))
        rows.A[0] = (axle[1] * moves[0] - axle[0] * moves[1]) / length if length > PARALLEL else 0.0
        rows.A[1] = moves[2]
        self.error[1] = self._wheel.radius - height
        rows.lower[:] = self.gain * self.error
        rows.upper[:] = rows.lower


def _checked(hub: str, radius: float, floor: str | None) -> None:
    """Raise `InvalidValue` unless the radius is positive, and hub and floor are different frames."""
    positive("radius", radius)
    if hub == floor:
        raise InvalidValue(f"a wheel needs a floor that is another frame than its hub, got '{hub}' twice")
