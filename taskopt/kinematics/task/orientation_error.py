"""Orientation tasks with the other errors of the chapter: Euler angles, angle and axis, unit quaternion.

`OrientationTask` takes the rotation vector, whose error dies out as ė = −K e from every orientation; it is
the one to use. These three are for comparison with the text. All agree to first order near the target.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, ArrayLike
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.hierarchy.tolerances import REPRESENTATION_SINGULAR
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.orientation.angle_axis import angle_axis, angle_axis_error, error_rate_matrix
from taskopt.kinematics.orientation.euler import ZYZ, EulerAngles
from taskopt.kinematics.orientation.quaternion import quaternion_error
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS, PoseSpace, Value
from taskopt.kinematics.target import Hold, Target, as_target, check_target
from taskopt.kinematics.task.aimed import AimedTask
from taskopt.kinematics.task.base import Task, gains, weights

STEEP = float(np.cos(np.radians(80.0)))
"""Cosine of the error angle below which `AngleAxisTask` leaves (3.89), which asks for a speed of K tan ϑ."""

_ANGULAR = slice(3, 6)  # rows of a twist


class _Rows(NamedTuple):
    """Rows M J_O v = N (f + K e) of an orientation error.

    Attributes:
        error: e (3,).
        rate: M (3, 3).
        feedforward: f (3,) [1/s].
        demand: N (3, 3).
    """

    error: Array
    rate: Array
    feedforward: Array
    demand: Array


_Error = Callable[[Array, Array, Array], _Rows]  # of R_e, R_d and ω_d


@dataclass(frozen=True, eq=False)
class _OfOrientation(Task):
    """Base of the three orientation tasks."""

    frame: str
    target: Target | Value = field(default_factory=Hold, kw_only=True)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        gains(self.gain, 3)
        weights(self.weight, 3)
        check_target(self.target, PoseSpace(f"target of '{self.name or self.default_name()}'", angular=True))

    def bind(self, robot: Robot, name: str) -> "BoundOrientation":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no such frame.
        """
        robot.frame_id(self.frame)
        return BoundOrientation(name, self, self._error())

    def default_name(self) -> str:
        """Return the name of the frame and "orientation"."""
        return f"{self.frame} orientation"

    def _error(self) -> _Error:
        """Return the function that computes the rows."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class EulerTask(_OfOrientation):
    """Bring a frame to an orientation by the error of its Euler angles: J_φ v = φ̇_d + K e, e = φ_d − φ_e.

    J_φ = T(φ_e)⁻¹ J_O is the lower part of the analytical Jacobian. Of the sets of angles that describe the
    target, the one nearest to φ_e is taken. The angles go straight to their target, the frame does not: near
    a representation singularity it takes long detours, with large angular velocities. At the singularity,
    where J_φ does not exist, the rows are J_O v = T(φ_e) (φ̇_d + K e), which ask for the same velocity where
    both exist; the error vanishes there only where the orientations agree, so that nothing stops short.

    Args:
        frame: Name of the frame.
        angles: The set of angles, ZYZ or RPY or any other.
        target: Target rotation (3, 3) or pose in the world, or a `Target`, whose rate is an angular velocity
            (3,) [rad/s] in the axes of the world. Default: the orientation at the start.
        gain: K [1/s], one number or three; it must stay below 2/Δt.
        weight: Factor of ½ (J_φ v − b)² within the level, one number or three.
        name: Name in logs and plots. Default: the name of the frame and "orientation".

    Raises:
        InvalidValue: `angles` is no set of Euler angles, or a number is out of its range.

    Source:
        Equations (3.80), (3.81) and (3.82).
    """

    angles: EulerAngles = field(default=ZYZ, kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.angles, EulerAngles):
            raise InvalidValue(f"angles must be EulerAngles such as taskopt.ZYZ, got {self.angles!r}")
        super().__post_init__()

    def _error(self) -> _Error:
        return partial(_euler_rows, self.angles)


@dataclass(frozen=True, eq=False)
class AngleAxisTask(_OfOrientation):
    """Bring a frame to an orientation by the error e = r sin ϑ: L J_O v = Lᵀ ω_d + K e.

    ϑ and r are angle and axis of the rotation R_d R_eᵀ from the actual to the target orientation, and L is
    the matrix of (3.87). With these rows e dies out as ė = −K e. This leads to ϑ = 0 for ϑ < 90° only: the
    speed that the rows ask for is K tan ϑ, which grows without bound towards 90°, and beyond 90° the error
    sin ϑ dies out towards ϑ = 180°. From 80° on the rows therefore are J_O v = ω_d + K r, which turn the
    frame back by the shortest way. At 180° both ±r are axes of the rotation, and one of them is taken.

    Args:
        frame: Name of the frame.
        target: Target rotation (3, 3) or pose in the world, or a `Target`, whose rate is an angular velocity
            (3,) [rad/s] in the axes of the world. Default: the orientation at the start.
        gain: K [1/s], one number or three; it must stay below 2/Δt.
        weight: Factor of ½ (L J_O v − b)² within the level, one number or three.
        name: Name in logs and plots. Default: the name of the frame and "orientation".

    Raises:
        InvalidValue: A number is out of its range.

    Source:
        Equations (3.83)–(3.89).
    """

    def _error(self) -> _Error:
        return _angle_axis_rows


@dataclass(frozen=True, eq=False)
class QuaternionTask(_OfOrientation):
    """Bring a frame to an orientation by the quaternion error e = Δε: J_O v = ω_d + K e.

    Δη = cos(ϑ/2) and Δε = r sin(ϑ/2) are the quaternion of R_d R_eᵀ, the rotation from the actual to the
    target orientation by the short way. The rows are not the derivative of the error: it dies out as
    ϑ̇ = −K sin(ϑ/2), at half the rate K near the target. The error has no singularity; at 180°, where Δη = 0,
    the frame turns about one of the two axes.

    Args:
        frame: Name of the frame.
        target: Target rotation (3, 3) or pose in the world, or a `Target`, whose rate is an angular velocity
            (3,) [rad/s] in the axes of the world. Default: the orientation at the start.
        gain: K [1/s], one number or three; it must stay below 2/Δt.
        weight: Factor of ½ (J_O v − b)² within the level, one number or three.
        name: Name in logs and plots. Default: the name of the frame and "orientation".

    Raises:
        InvalidValue: A number is out of its range.

    Source:
        Equations (3.90)–(3.97).
    """

    def _error(self) -> _Error:
        return _quaternion_rows


class BoundOrientation(AimedTask):
    """The three rows of an `EulerTask`, `AngleAxisTask` or `QuaternionTask` for one robot.

    Args:
        name: Name of the task in its plan.
        task: The declared task.
        rows_of: Function that computes the rows from R_e (3, 3), R_d (3, 3) and ω_d (3,) [rad/s].
    """

    def __init__(self, name: str, task: _OfOrientation, rows_of: _Error) -> None:
        super().__init__(name, ROW_NAMES[_ANGULAR], ROW_UNITS[_ANGULAR], task.gain, task.weight)
        self.frame, self._frame = task.frame, task.frame
        self._rows_of = rows_of
        self.take_target(as_target(task.target), PoseSpace(f"target of '{name}'", angular=True))
        self.desired = self.goal = np.eye(4)
        self.actual: Array = np.eye(4)
        self._twist = np.zeros(6)

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the target from the present orientation; see `RowPart.start`."""
        self.begin(configuration.pose(self._frame), t)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows; see `RowPart.fill`."""
        moving = self._course(t, self.goal, self._twist)
        self.actual[...] = configuration.pose(self._frame)
        omega = self._twist[_ANGULAR] if moving else np.zeros(3)
        found = self._rows_of(self.actual[:3, :3], self.goal[:3, :3], omega)
        self.error[:] = found.error
        rows.A[...] = found.rate @ configuration.jacobian(self._frame)[_ANGULAR]
        rows.lower[:] = rows.upper[:] = found.demand @ (found.feedforward + self.gain * found.error)


def _euler_rows(angles: EulerAngles, R_e: Array, R_d: Array, omega_d: Array) -> _Rows:
    """Return the rows of (3.82), or their product with T where T has no inverse."""
    phi = angles.angles(R_e)
    phi_d = angles.angles(R_d, near=phi)
    # Of a target at a representation singularity, what its angles can express of ω_d is fed forward.
    feedforward = np.linalg.pinv(angles.rate_map(phi_d), rcond=REPRESENTATION_SINGULAR) @ omega_d
    T, eye = angles.rate_map(phi), np.eye(3)
    if abs(angles.determinant(phi)) < REPRESENTATION_SINGULAR:
        return _Rows(phi_d - phi, eye, feedforward, T)
    return _Rows(phi_d - phi, np.asarray(np.linalg.inv(T), dtype=np.float64), feedforward, eye)


def _angle_axis_rows(R_e: Array, R_d: Array, omega_d: Array) -> _Rows:
    """Return the rows of (3.89), or those of a turn about the axis where ϑ is beyond 80°."""
    left = R_d @ R_e.T
    if 0.5 * (np.trace(left) - 1.0) < STEEP:
        return _Rows(angle_axis(left)[1], np.eye(3), omega_d, np.eye(3))
    L = error_rate_matrix(R_e, R_d)
    return _Rows(angle_axis_error(R_e, R_d), L, L.T @ omega_d, np.eye(3))


def _quaternion_rows(R_e: Array, R_d: Array, omega_d: Array) -> _Rows:
    """Return the rows of (3.92)."""
    return _Rows(quaternion_error(R_e, R_d), np.eye(3), omega_d, np.eye(3))
