"""Joint position limits as bounds on velocity."""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, positive
from taskopt.errors import InvalidValue
from taskopt.jit import kernel
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True)
class JointPositionLimit:
    """Approach a joint limit no faster than a fraction κ of what is left per step.

    κ (q_min − q)/Δt ≤ v ≤ κ (q_max − q)/Δt, the velocity damper of Faverjon and Tournassoud (1987), ICRA,
    in the discrete form of Kanoun (2012), RSS VII. Both sides are clipped so that v = 0 stays allowed: a
    joint outside its range may stop or return. `gain` is κ in (0, 1]: at 1 a joint may reach its limit in
    one step, below 1 it comes closer geometrically. Continuous joints and free-flyers have no limit.
    """

    gain: float = 1.0
    name: str = "joint_position"

    def __post_init__(self) -> None:
        if positive("gain", self.gain) > 1.0:
            raise InvalidValue(f"gain of a position limit must be in (0, 1], got {self.gain:g}")

    def bind(self, robot: Robot, dt: float) -> "BoundJointPosition":
        return BoundJointPosition(robot, self.name, self.gain / dt)


class BoundJointPosition:
    """Bounds κ (q_min − q)/Δt and κ (q_max − q)/Δt for the joints that have a limit."""

    kind = "joint position limit"
    constant = False

    def __init__(self, robot: Robot, name: str, rate: float) -> None:
        self.name = name
        limited = np.isfinite(robot.position_lower) | np.isfinite(robot.position_upper)
        columns = np.flatnonzero(limited & (robot.position_index >= 0))
        limits = np.column_stack([robot.position_lower[columns], robot.position_upper[columns]])
        self.program = np.column_stack([columns, robot.position_index[columns]]).ravel()
        self.memory: Array = np.concatenate([[rate], limits.ravel()])

    def use(self, memory: Array) -> None:
        self.memory = memory

    def narrow(self, at: Configuration, bounds: Array, index: int) -> None:
        narrow_by_position(self.program, at.q, self.memory, bounds, index)


@kernel
def narrow_by_position(program, q, memory, bounds, index):
    """`program` has column of v and place in q of each joint; `memory` the rate κ/Δt, then q_min, q_max."""
    rate = memory[0]
    for i in range(program.size // 2):
        j, at = program[2 * i], q[program[2 * i + 1]]
        lower = min(rate * (memory[2 * i + 1] - at), 0.0)
        upper = max(rate * (memory[2 * i + 2] - at), 0.0)
        if not lower <= bounds[0, j]:  # so that NaN is handed on, and found
            bounds[0, j], bounds[2, j] = lower, index
        if not upper >= bounds[1, j]:
            bounds[1, j], bounds[3, j] = upper, index
