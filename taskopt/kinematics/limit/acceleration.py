"""Position, velocity and acceleration limits of joints together, so that there is always a way to keep them.

With h = Δt and d = a h, the tick chooses v⁺ with |v⁺ − v| ≤ d, and q⁺ = q + v⁺ h (3.48). Braking as hard as
allowed after it, v⁺ − d, v⁺ − 2d, … down to 0, the joint still travels, with n the whole part of v⁺/d,

    B(v⁺) = h (n v⁺ − d n (n + 1)/2),

so q_max is kept for ever if and only if F(v⁺) = v⁺ h + B(v⁺) ≤ q_max − q. F grows piecewise linearly,
F(n d) = h d n (n + 1)/2, and its inverse is the exact bound: with r = (q_max − q)/h,

    v⁺ ≤ r/(n + 1) + d n/2,   n the largest integer with d n (n + 1)/2 ≤ r.

F(v − d) = B(v), so what was allowed a tick ago may brake now: the bounds are never empty. After Del Prete
(2018), IEEE Robotics and Automation Letters 3(1), where the acceleration is constant over a step; here the
velocity is. In continuous time the bound is √(2 a (q_max − q)), which no discrete step keeps.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.jit import kernel
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.joint_velocity import each_velocity
from taskopt.kinematics.robot import Robot

_OF_JOINT = 5  # numbers a joint in the memory: v, d = a Δt, v_max, q_min, q_max


@dataclass(frozen=True, eq=False)
class JointAccelerationLimit:
    """|v⁺ − v| ≤ a Δt, |v⁺| ≤ v_max, and q stays in its range for ever, whatever is asked for later.

    Stands in place of `JointPositionLimit` and `JointVelocityLimit`, which know no acceleration.
    `acceleration` a [rad/s², m/s²]: one number, one a velocity (nv,), or a mapping from joint to number
    (inf elsewhere). `velocity` v_max: likewise, by default the robot's. A joint that is faster than it may
    be, or outside its range, brakes as hard as a allows and may then return, but go no farther.
    """

    acceleration: ArrayLike | Mapping[str, float]
    velocity: ArrayLike | Mapping[str, float] | None = None
    name: str = "joint_acceleration"

    def bind(self, robot: Robot, dt: float) -> "BoundJointAcceleration":
        none = np.full(robot.nv, np.inf)
        acceleration = each_velocity("acceleration", self.acceleration, robot, none)
        if (acceleration <= 0.0).any():
            raise InvalidValue(f"acceleration must be > 0, got {acceleration.min():g}")
        velocity = each_velocity("velocity", self.velocity, robot, robot.velocity_limit)
        return BoundJointAcceleration(robot, self.name, dt, acceleration, velocity)


class BoundJointAcceleration:
    """The bounds of every velocity; at rest until told otherwise."""

    kind = "joint acceleration limit"
    constant = False

    def __init__(self, robot: Robot, name: str, dt: float, acceleration: Array, velocity: Array) -> None:
        self.name = name
        self.owners = (name, f"{name} (position)", f"{name} (velocity)")
        columns, place = np.arange(robot.nv), robot.position_index
        self.program = np.column_stack([columns, place]).ravel()
        none = place < 0
        low = np.where(none, -np.inf, robot.position_lower)
        high = np.where(none, np.inf, robot.position_upper)
        of_joint = np.column_stack([np.zeros(robot.nv), acceleration * dt, velocity, low, high])
        self.use(np.concatenate([[dt], of_joint.ravel()]))

    def use(self, memory: Array) -> None:
        self.memory = memory
        self._joints = memory[1:].reshape(-1, _OF_JOINT)

    def moved(self, v: Array) -> None:
        self._joints[:, 0] = v

    def brakes(self) -> Array:
        v, step = self._joints[:, 0], self._joints[:, 1]
        return np.where(np.abs(v) > step, v - np.copysign(step, v), 0.0)

    def narrow(self, at: Configuration, bounds: Array, index: int) -> None:
        narrow_by_acceleration(self.program, at.q, self.memory, bounds, index)


@kernel
def narrow_by_acceleration(program, q, memory, bounds, index):
    """`program` has column of v and place in q (or −1) of each joint; owners follow on from `index`."""
    dt = memory[0]
    for i in range(program.size // 2):
        j, at = program[2 * i], program[2 * i + 1]
        v, step, fastest = memory[5 * i + 1], memory[5 * i + 2], memory[5 * i + 3]
        up = down = np.inf
        if at >= 0:
            up, down = (memory[5 * i + 5] - q[at]) / dt, (q[at] - memory[5 * i + 4]) / dt
        brake = 0.0 if abs(v) <= step else v - np.copysign(step, v)
        high, why_high = _side(v, step, fastest, up, brake)
        low, why_low = _side(-v, step, fastest, down, -brake)
        if not -low <= bounds[0, j]:  # so that NaN is handed on, and found
            bounds[0, j], bounds[2, j] = -low, index + why_low
        if not high >= bounds[1, j]:
            bounds[1, j], bounds[3, j] = high, index + why_high


@kernel
def _side(v, step, fastest, room, brake):
    """The upper bound of v⁺ with `room` = (q_max − q)/Δt, and what sets it: acceleration, position, speed."""
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
