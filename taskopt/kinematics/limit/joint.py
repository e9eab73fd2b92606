"""Limits on the positions and velocities of joints, both as bounds on the velocities."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike, bound, number, positive
from taskopt.errors import InvalidValue
from taskopt.jit import kernel_apart
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.base import BoundLimit, Limit, narrow_one
from taskopt.kinematics.parameter import Numbers, Parameter, one_number
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True, eq=False)
class JointPositionLimit(Limit):
    """Keep joints in their ranges: a step may take at most the fraction κ of the way to a limit.

        κ (q_min − q)/Δt ≤ v ≤ κ (q_max − q)/Δt

    Both sides are clipped so that v = 0 stays allowed: a joint outside its range may stop or return. Bounds
    [rad/s, m/s] on the velocity of each joint that has a limit; continuous joints and free-flyers have none.

    Args:
        gain: κ in (0, 1]. At 1 a joint may reach its limit in one step. Less brakes earlier, and the distance
            to the limit then decreases by the factor 1 − κ per step.
        margin: Distance from q_min and q_max that the joints keep [rad, m]: one number for all, one for each
            velocity (nv,), or a mapping from joint to number. More keeps them farther from the limits.
        name: Name in explanations, logs and plots.

    Raises:
        InvalidValue: `gain` is out of its range; or, when bound, a margin is negative, or leaves a joint no
            range.

    Source:
        The velocity damper of Faverjon and Tournassoud (1987), IEEE International Conference on Robotics and
        Automation, in the discrete form of Kanoun (2012), Robotics: Science and Systems VII.
    """

    gain: float = 1.0
    margin: ArrayLike | Mapping[str, float] = field(default=0.0, kw_only=True)
    name: str = field(default="joint_position", kw_only=True)

    def __post_init__(self) -> None:
        if positive("gain", self.gain) > 1.0:
            raise InvalidValue(f"gain of a position limit must be in (0, 1], got {self.gain:g}")
        check_numbers("margin", self.margin)

    def bind(self, robot: Robot, dt: float) -> "BoundJointPosition":
        """Return the bounds for a robot; see `Limit.bind`."""
        return BoundJointPosition(robot, self.name, self.gain, dt, self.margin)


class BoundJointPosition(BoundLimit):
    """Bounds κ (q_min − q)/Δt and κ (q_max − q)/Δt for the joints that have a limit.

    Args:
        robot: The robot.
        name: Name of the limit.
        gain: κ.
        dt: Δt [s].
        margin: Distance from their limits that the joints keep [rad, m], as in `JointPositionLimit`.
    """

    def __init__(
        self, robot: Robot, name: str, gain: float, dt: float, margin: ArrayLike | Mapping[str, float]
    ) -> None:
        super().__init__(name)
        self._robot, self._dt, self._gain = robot, dt, np.array([float(gain)])
        limited = np.isfinite(robot.position_lower) | np.isfinite(robot.position_upper)
        columns = np.flatnonzero(limited & (robot.position_index >= 0))
        self._columns = columns
        lower, upper = robot.position_lower[columns], robot.position_upper[columns]
        self._least_room = 0.5 * float((upper - lower).min(initial=np.inf))
        self.kernel = narrow_by_position
        self.parameters = np.column_stack([columns, robot.position_index[columns]]).ravel()
        of_joint = np.column_stack([lower, upper, np.zeros(columns.size)])
        self.use(np.concatenate([[0.0], of_joint.ravel()]))
        self._margin[:] = self._each_margin(margin)
        self.retime(dt)

    def use(self, memory: Array) -> None:
        """Re-bind this part to a memory; see `Part.use`."""
        self.memory, self._margin = memory, memory[1:].reshape(-1, 3)[:, 2]

    def retime(self, dt: float) -> None:
        """Change Δt [s]; see `Part.retime`."""
        self._dt = dt
        self._write_gain()

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return gain and margin; see `Part.adjustable`."""
        return {
            "gain": Numbers(self._gain, self._one_gain, self._write_gain),
            "margin": Numbers(self._margin, self._each_margin),
        }

    def _one_gain(self, gain: ArrayLike) -> float:
        """Return a gain that is in its range."""
        return one_number(f"gain of '{self.name}'", gain, 0.0, 1.0)

    def _each_margin(self, margin: ArrayLike | Mapping[str, float]) -> Array | float:
        """Return a checked margin for each joint that has a limit, (k,), or one number for all."""
        robot = self._robot
        if isinstance(margin, float) and 0.0 <= margin <= self._least_room:  # ten times as fast
            return margin
        each = each_velocity(f"margin of '{self.name}'", margin, robot, np.zeros(robot.nv))
        room = 0.5 * (robot.position_upper - robot.position_lower)
        for j in self._columns[~(each <= room)[self._columns]]:
            unit = robot.coordinate_units[j]
            raise InvalidValue(
                f"margin {each[j]:g} {unit} of '{self.name}' leaves {robot.velocity_names[j]} no range; it "
                f"must be ≤ {room[j]:g} {unit}"
            )
        return each[self._columns]

    def _write_gain(self) -> None:
        """Write κ/Δt for the kernel."""
        self.memory[0] = self._gain[0] / self._dt


@kernel_apart
def narrow_by_position(parameters, memory, state, bounds, owner):
    """Narrow the bounds of a `JointPositionLimit`.

    Args:
        parameters: Flat array of integers: for each joint its column in v and its place in q.
        memory: Flat array: κ/Δt [1/s], then for each joint q_min, q_max and the margin [rad, m].
        state: The robot, see `RobotState`.
        bounds: (4, nv), see `BoundLimit.narrow`.
        owner: Number of the limit.
    """
    rate = memory[0]
    for i in range(parameters.size // 2):
        q = state.q[parameters[2 * i + 1]]
        margin = memory[3 * i + 3]
        lower = min(rate * (memory[3 * i + 1] + margin - q), 0.0)
        upper = max(rate * (memory[3 * i + 2] - margin - q), 0.0)
        narrow_one(bounds, parameters[2 * i], lower, upper, owner)


@dataclass(frozen=True, eq=False)
class JointVelocityLimit(Limit):
    """Keep every joint velocity v within −s v_max ≤ v ≤ s v_max [rad/s, m/s].

    Args:
        scale: s > 0. More allows faster motion.
        velocity: v_max [rad/s, m/s]: one number for all, one for each velocity (nv,), or a mapping from joint
            to number, where joints that it does not name keep the robot's own limit. inf means no limit.
            Default: the robot's own limits.
        name: Name in explanations, logs and plots.

    Raises:
        InvalidValue: A number is out of its range.
    """

    scale: float = 1.0
    velocity: ArrayLike | Mapping[str, float] | None = field(default=None, kw_only=True)
    name: str = field(default="joint_velocity", kw_only=True)

    def __post_init__(self) -> None:
        positive("scale", self.scale)
        check_numbers("velocity", self.velocity)

    def bind(self, robot: Robot, dt: float) -> "BoundJointVelocity":  # noqa: ARG002
        """Return the bounds for a robot; see `Limit.bind`.

        Raises:
            InvalidValue: A number of `velocity` is negative or NaN, or there are too many or too few.
            UnknownName: A mapping names a joint that the robot does not have.
        """
        limits = each_velocity("velocity", self.velocity, robot, robot.velocity_limit)
        return BoundJointVelocity(self.name, self.scale, limits)


def check_numbers(what: str, value: ArrayLike | Mapping[str, float] | None) -> None:
    """Check numbers for joints, as far as that needs no robot.

    Args:
        what: Name of the value, for messages.
        value: One number for all joints, several, or a mapping from joint to number; None for none.

    Raises:
        InvalidValue: A value is no number.
    """
    if isinstance(value, Mapping):
        for joint, one in value.items():
            number(f"{what} of {joint}", one, ())
    elif value is not None:
        number(what, value, (None,) if isinstance(value, Sequence | np.ndarray) and np.shape(value) else ())


def each_velocity(
    what: str, value: ArrayLike | Mapping[str, float] | None, robot: Robot, default: Array
) -> Array:
    """Convert one number, several, or a mapping to one number ≥ 0 for each velocity.

    Args:
        what: Name of the value, for messages.
        value: One number for all velocities, one for each (nv,), or a mapping from joint to number; joints
            that the mapping does not name, or all if it is None, have the default.
        robot: The robot.
        default: Numbers for velocities without a given one, (nv,).

    Returns:
        The numbers (nv,); inf stands for no limit.

    Raises:
        InvalidValue: A number is negative or NaN, or there are neither one nor nv numbers.
        UnknownName: The mapping names a joint that the robot does not have.
    """
    check_numbers(what, value)
    if value is None:
        return default
    if isinstance(value, Mapping):
        limits = default.copy()
        for joint, number in value.items():
            limits[robot.velocity_index(joint)] = number
    elif np.ndim(value) == 0:
        limits = np.full(robot.nv, value, dtype=np.float64)
    else:
        limits = np.asarray(value)
    limits = bound(what, limits, (robot.nv,))
    if (limits < 0.0).any():
        raise InvalidValue(f"{what} of a limit must be ≥ 0, got {limits.min():g}")
    return limits


class BoundJointVelocity(BoundLimit):
    """The bounds of a `JointVelocityLimit`, which do not depend on the posture.

    Args:
        name: Name of the limit.
        scale: s.
        limits: v_max of each velocity, (nv,) [rad/s, m/s].
    """

    constant = True

    def __init__(self, name: str, scale: float, limits: Array) -> None:
        super().__init__(name)
        self._scale, self._limits = np.array([float(scale)]), limits

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return the scale; see `Part.adjustable`."""
        return {"scale": Numbers(self._scale, self._one_scale)}

    def _one_scale(self, scale: ArrayLike) -> float:
        """Return a scale that is in its range."""
        return one_number(f"scale of '{self.name}'", scale, 0.0)

    def narrow(self, configuration: Configuration, bounds: Array, owner: int) -> None:  # noqa: ARG002
        """Narrow the bounds in place; see `BoundLimit.narrow`."""
        limits = self._scale[0] * self._limits
        for row, limit, tighter in ((0, -limits, np.greater), (1, limits, np.less)):
            binds = tighter(limit, bounds[row])
            bounds[row, binds], bounds[row + 2, binds] = limit[binds], owner
