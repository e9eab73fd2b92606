"""Position, velocity and acceleration limits of joints together, so that all can be kept at every later tick.

Let v be the velocity of a joint in the last tick, v⁺ that of the next one, h = Δt, a the largest acceleration
and d = a h. The tick chooses v⁺ with |v⁺ − v| ≤ d, and q⁺ = q + v⁺ h (3.48). If the joint then brakes as hard
as allowed, with v⁺ − d, v⁺ − 2d, … down to 0, it still travels the distance B(v⁺), where n is the whole part
of v⁺/d:

    B(v⁺) = h (n v⁺ − d n (n + 1)/2),

so that q_max is kept for ever if and only if F(v⁺) = v⁺ h + B(v⁺) ≤ q_max − q. F is piecewise linear and
increasing with F(n d) = h d n (n + 1)/2, and its inverse is the exact bound: with r = (q_max − q)/h,

    v⁺ ≤ r/(n + 1) + d n/2,   n the largest integer with d n (n + 1)/2 ≤ r.

Since F(v − d) = B(v), a velocity that was allowed in the last tick can always be braked in this one, so that
the bounds are never empty. In continuous time the bound would be √(2 a (q_max − q)); with discrete steps that
bound does not keep q in its range.

Source:
    After Del Prete (2018), IEEE Robotics and Automation Letters 3(1), where the acceleration is constant over
    a step; here the velocity is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike
from taskopt.errors import InvalidValue
from taskopt.jit import kernel, kernel_apart
from taskopt.kinematics.limit.base import BoundLimit, Limit, RateLimit
from taskopt.kinematics.limit.joint import check_numbers, each_velocity
from taskopt.kinematics.parameter import Numbers, Parameter
from taskopt.kinematics.robot import Robot

_NUMBERS = 5  # numbers of each joint in the memory: v, d = a Δt, v_max, q_min, q_max


@dataclass(frozen=True, eq=False)
class JointAccelerationLimit(Limit):
    """Keep |v⁺ − v| ≤ a Δt, |v⁺| ≤ v_max, and q in its range in all later ticks.

    v is the velocity of the last tick, v⁺ that of the next one. The limit replaces `JointPositionLimit` and
    `JointVelocityLimit`, which do not limit the acceleration. It bounds every velocity [rad/s, m/s] by the
    formula of this module. A joint that is too fast or outside its range brakes with the acceleration a; it
    may then return to its range, but not go farther away.

    Args:
        acceleration: a [rad/s², m/s²]: one number, one for each velocity (nv,), or a mapping from joint to
            number, where joints that it does not name keep the robot's own limit. Default: the robot's own
            limits, which `Robot.with_limits` sets, since no URDF or MJCF file states any. More allows quicker
            changes of velocity, and braking closer to the limits.
        velocity: v_max [rad/s, m/s], given in the same ways. Default: the robot's own. More allows faster
            motion.
        name: Name in explanations, logs and plots. A bound has this name if the acceleration sets it;
            "(position)" or "(velocity)" is appended if the range or v_max does.

    Raises:
        InvalidValue: When the limit is bound to a robot: an acceleration is not positive, a number is out of
            its range, or no acceleration is given and the robot has no limit of its own.

    Source:
        See the module.
    """

    acceleration: ArrayLike | Mapping[str, float] | None = None
    velocity: ArrayLike | Mapping[str, float] | None = field(default=None, kw_only=True)
    name: str = field(default="joint_acceleration", kw_only=True)

    def __post_init__(self) -> None:
        check_numbers("acceleration", self.acceleration)
        check_numbers("velocity", self.velocity)

    def bind(self, robot: Robot, dt: float) -> "BoundJointAcceleration":
        """Return the bounds for a robot; see `Limit.bind`.

        Raises:
            InvalidValue: An acceleration is not positive, a number of `velocity` is negative or NaN, or no
                acceleration is given and the robot has none.
            UnknownName: A mapping names a joint that the robot does not have.
        """
        own = robot.acceleration_limit
        if self.acceleration is None and np.isinf(own).all():
            raise InvalidValue(
                f"{robot.name} has no acceleration limits, since no URDF or MJCF file states any; write "
                f"{type(self).__name__}(acceleration=…), or robot.with_limits(acceleration={{joint: …}})"
            )
        acceleration = each_velocity("acceleration", self.acceleration, robot, own)
        if (acceleration <= 0.0).any():
            raise InvalidValue(f"acceleration must be > 0, got {acceleration.min():g}")
        velocity = each_velocity("velocity", self.velocity, robot, robot.velocity_limit)
        return BoundJointAcceleration(robot, self.name, dt, acceleration, velocity)


class BoundJointAcceleration(BoundLimit, RateLimit):
    """The bounds of a `JointAccelerationLimit`, for which the robot is at rest until `moved` is called.

    Args:
        robot: The robot.
        name: Name of the limit.
        dt: Δt [s].
        acceleration: a of each velocity, (nv,) [rad/s², m/s²].
        velocity: v_max of each velocity, (nv,) [rad/s, m/s].
    """

    def __init__(self, robot: Robot, name: str, dt: float, acceleration: Array, velocity: Array) -> None:
        super().__init__(name, (name, f"{name} (position)", f"{name} (velocity)"))
        columns, place = np.arange(robot.nv), robot.position_index
        self.kernel = narrow_by_acceleration
        self.parameters = np.column_stack([columns, place]).ravel()
        none = place < 0
        lower = np.where(none, -np.inf, robot.position_lower)
        upper = np.where(none, np.inf, robot.position_upper)
        self._robot, self._acceleration, self._velocity = robot, acceleration.copy(), velocity.copy()
        of_joint = np.column_stack([np.zeros(robot.nv), acceleration, velocity, lower, upper])
        self.use(np.concatenate([[dt], of_joint.ravel()]))
        self.retime(dt)

    def use(self, memory: Array) -> None:
        """Re-bind this part to a memory; see `Part.use`."""
        self.memory = memory
        self._joints = memory[1:].reshape(-1, _NUMBERS)

    def retime(self, dt: float) -> None:
        """Change Δt [s]; see `Part.retime`."""
        self.memory[0] = dt
        self._write()

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return acceleration and velocity; see `Part.adjustable`."""
        return {
            "acceleration": Numbers(self._acceleration, self._each_acceleration, self._write),
            "velocity": Numbers(self._velocity, self._each_velocity, self._write),
        }

    def _each_acceleration(self, value: ArrayLike | Mapping[str, float]) -> Array:
        """Return an acceleration > 0 for each velocity."""
        what = f"acceleration of '{self.name}'"
        each = each_velocity(what, value, self._robot, self._acceleration)
        if (each <= 0.0).any():
            raise InvalidValue(f"{what} must be > 0, got {each.min():g}")
        return each

    def _each_velocity(self, value: ArrayLike | Mapping[str, float]) -> Array:
        """Return a velocity ≥ 0 for each velocity."""
        return each_velocity(f"velocity of '{self.name}'", value, self._robot, self._velocity)

    def _write(self) -> None:
        """Write the limits for the kernel."""
        self._joints[:, 1], self._joints[:, 2] = self._acceleration * self.memory[0], self._velocity

    @property
    def stops(self) -> Sequence[int]:
        """The place of the range; see `BoundLimit.stops`."""
        return (1,)

    @property
    def fastest(self) -> Array:
        """v_max of each velocity, (nv,) [rad/s, m/s]."""
        return self._velocity

    @property
    def strongest(self) -> Array:
        """a of each velocity, (nv,) [rad/s², m/s²]."""
        return self._acceleration

    def moved(self, v: Array) -> None:
        """Remember the velocity that the robot has until the next tick; see `RateLimit.moved`."""
        self._joints[:, 0] = v

    def brakes(self) -> Array:
        """Return the velocity after braking as hard as allowed; see `RateLimit.brakes`."""
        v, step = self._joints[:, 0], self._joints[:, 1]
        return np.where(np.abs(v) > step, v - np.copysign(step, v), 0.0)


@kernel_apart
def narrow_by_acceleration(parameters, memory, state, bounds, owner):
    """Narrow the bounds of a `JointAccelerationLimit`.

    Args:
        parameters: Flat array of integers: for each joint its column in v and its place in q, or −1 if it has
            no range.
        memory: Flat array: Δt [s], then for each joint v, a Δt, v_max [rad/s, m/s], q_min, q_max [rad, m].
        state: The robot, see `RobotState`.
        bounds: (4, nv), see `BoundLimit.narrow`.
        owner: Number of the first owner; acceleration, position and velocity have consecutive numbers.
    """
    dt = memory[0]
    for i in range(parameters.size // 2):
        j, at = parameters[2 * i], parameters[2 * i + 1]
        v, step, fastest = memory[5 * i + 1], memory[5 * i + 2], memory[5 * i + 3]
        up = down = np.inf
        if at >= 0:
            up, down = (memory[5 * i + 5] - state.q[at]) / dt, (state.q[at] - memory[5 * i + 4]) / dt
        brake = 0.0 if abs(v) <= step else v - np.copysign(step, v)
        upper, why_upper = _side(v, step, fastest, up, brake)
        lower, why_lower = _side(-v, step, fastest, down, -brake)
        if not -lower <= bounds[0, j]:  # so that NaN is handed on, and found
            bounds[0, j], bounds[2, j] = -lower, owner + why_lower
        if not upper >= bounds[1, j]:
            bounds[1, j], bounds[3, j] = upper, owner + why_upper


@kernel
def _side(v, step, fastest, room, brake):
    """Return the upper bound of v⁺, where `room` is (q_max − q)/Δt, and the number of the limit that sets it.

    The number is 0 for acceleration, 1 for position, 2 for velocity. NaN is passed on.
    """
    bound, why = fastest, 2
    stopping = room
    if room < np.inf:
        if room <= 0.0:
            stopping = 0.0 * room  # stop or return; NaN stays NaN
        else:
            n = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * room / step) - 1.0))
            if n >= 1.0:
                stopping = room / (n + 1.0) + 0.5 * step * n
    if not stopping >= bound:
        bound, why = stopping, 1
    if bound < brake:
        bound = brake  # nothing brakes harder
    if bound > v + step:
        return v + step, 0
    return bound, why
