"""What a plan of second order has besides one of first order: the motion of the robot, and the lifts.

The unknown of a tick is x = q̈, constant until the next one, so that

    v⁺ = v + q̈ h,    q⁺ = q ⊕ (v h + ½ q̈ h²).

*Tasks* are filled at q as at first order, A v = b, and then lifted to A q̈ = ẍ_d + K_D ė + K_P e − J̇ v
(3.102) by a kernel or a method of their own.

*Limits* need no rows of their own. Let s = q ⊕ v h/2 be the posture half a step ahead. Then

    s⁺ = q⁺ ⊕ v⁺ h/2 = q + v h + ½ q̈ h² + v⁺ h/2 = s + v⁺ h,

so that s makes the Euler steps (3.48) of first order, with v⁺ as its velocity. A limit of first order that is
filled at s therefore keeps s for ever as it keeps q at first order, with the same proof, and its bounds on v⁺
are bounds on q̈ = (v⁺ − v)/h. Limits on velocity and acceleration hold of v⁺ and q̈ themselves. As
q⁺ = (s + s⁺)/2, a range that holds s holds q; during a step q(t) is a parabola in the triangle of q, s and
q⁺, so that the range holds at every time, not only at the ticks. On joints with quaternions s⁺ = s ⊕ v⁺ h
holds up to terms of the order of h³.

Source:
    After Del Prete (2018), IEEE Robotics and Automation Letters 3(1), with its constant acceleration over a
    step; the bounds are those of `taskopt.kinematics.limit.acceleration`, derived for s.
"""

from collections.abc import Callable, Sequence

import numpy as np

from taskopt.arrays import Array, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.base import close_crossed
from taskopt.kinematics.part import Part, RowPart, state_of
from taskopt.kinematics.plan import lift_limit, motion_in, motion_size, state_ahead
from taskopt.kinematics.task import BoundTask

Filler = Callable[[Configuration, float, LevelRows], None]
Narrower = Callable[[Configuration, Array, int], None]


class SecondOrder:
    """The motion of a robot in a plan of second order, in a memory that kernels read.

    Args:
        configuration: The robot of the tasks, which `update` moves.
        dt: Δt [s].
        whole: True if a limit needs the robot at s, and not only s itself.

    Attributes:
        memory: The memory, see `taskopt.kinematics.plan.motion_size`.
        velocity: v of this tick, (nv,) [rad/s, m/s].
        last: q̈ of the last tick, (nv,) [rad/s², m/s²].
        ahead: The robot at s.
    """

    def __init__(self, configuration: Configuration, dt: float, *, whole: bool) -> None:
        robot, self._configuration = configuration.robot, configuration
        self._robot, self._whole, self._sizes = robot, whole, (robot.nv, robot.nq, robot.model.njoints)
        self.ahead, self.last = Configuration(robot, robot.neutral), np.zeros(robot.nv)
        self.use(np.zeros(motion_size(*self._sizes)))
        self.retime(dt)

    def use(self, memory: Array) -> Array:
        """Keep the motion in another memory, which already holds it.

        Args:
            memory: The memory from now on.

        Returns:
            `velocity`, a view into it.
        """
        self.memory = memory
        self._motion = motion_in(memory, self._robot.nv)
        self._ahead = state_ahead(memory, *self._sizes)
        self.velocity = self._motion.velocity
        return self.velocity

    def retime(self, dt: float) -> None:
        """Change Δt [s]."""
        self.memory[0] = self.dt = dt
        self._motion = self._motion._replace(dt=dt)

    def update(self, q: Array) -> None:
        """Move the robot to q with its velocity, and to s.

        Args:
            q: (nq,) [rad, m].
        """
        v, configuration = self.velocity, self._configuration
        configuration.update(q, v)
        self._motion.jacobian_rates[:] = configuration.jacobian_rates
        self._ahead.q[:] = self._robot.integrate(configuration.q, v, 0.5 * self.dt)
        if self._whole:
            self.ahead.update(self._ahead.q)
            self._ahead.jacobians[:] = self.ahead.joint_jacobians
            self._ahead.placements[:] = self.ahead.joint_placements

    def answered(self, acceleration: Array) -> Array:
        """Take the acceleration that the robot has until the next tick.

        Args:
            acceleration: q̈, (nv,) [rad/s², m/s²].

        Returns:
            v⁺, the velocity at the next tick, (nv,) [rad/s, m/s]; a new array.
        """
        self.last = acceleration
        return self.velocity + self.dt * acceleration

    def lifted(self, part: RowPart) -> Filler:
        """Return a function that fills the rows of a part without a kernel, and lifts them.

        Args:
            part: A bound task or limit.

        Returns:
            Function of configuration, time [s] and rows, as `RowPart.fill`.
        """
        return self._lifted_task(part) if isinstance(part, BoundTask) else self._lifted_limit(part)

    def narrowed(self, narrow: Narrower) -> Narrower:
        """Return a function that narrows bounds on accelerations by a limit on velocities in Python.

        Args:
            narrow: Method `BoundLimit.narrow` of the limit.

        Returns:
            Function of the same arguments, whose bounds are those on q̈.
        """

        def narrow_lifted(configuration: Configuration, bounds: Array, owner: int) -> None:  # noqa: ARG001
            before = bounds.copy()
            before[:2] = bounds[:2] * self.dt + self.velocity
            after = before.copy()
            narrow(self.ahead, after, owner)
            close_crossed(after)
            changed = after[:2] != before[:2]
            bounds[:2][changed] = ((after[:2] - self.velocity) / self.dt)[changed]
            bounds[2:] = after[2:]

        return narrow_lifted

    def _lifted_task(self, task: BoundTask) -> Filler:
        """Return the function of a task, whose rows are filled at q."""

        def fill(configuration: Configuration, t: float, rows: LevelRows) -> None:
            task.fill(configuration, t, rows)
            task.lift(state_of(configuration), self._motion, rows)

        return fill

    def _lifted_limit(self, limit: RowPart) -> Filler:
        """Return the function of a limit, whose rows are filled at s; those of a constant limit are kept."""
        kept: list[Array] = []

        def fill(configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG001
            if not limit.constant:
                limit.fill(self.ahead, t, rows)
            elif kept:
                rows.lower[:], rows.upper[:] = kept
            else:
                kept.extend((rows.lower.copy(), rows.upper.copy()))
            lift_limit(rows.A, rows.lower, rows.upper, self.velocity, self.dt)

        return fill


def checked_order(order: int, self_motion: float, norm: object) -> None:
    """Check what a stack says of its order.

    Args:
        order: 1 or 2.
        self_motion: K_v [1/s].
        norm: Norm of the stack, in numbers or in a word.

    Raises:
        InvalidValue: The order is another number, K_v is not positive, or the word is unknown at this order.
    """
    if order not in (1, 2):
        raise InvalidValue(f"order must be 1 (velocities) or 2 (accelerations), got {order!r}")
    positive("self_motion", self_motion)
    if isinstance(norm, str) and (norm != "inertia" or order == 1):
        raise InvalidValue(
            f'norm must be numbers, or "inertia" at order=2, got {norm!r} at order={order}; at order 1 a '
            "KineticEnergyTask on the last level takes the motion of least kinetic energy"
        )


def require_first_order(order: int, what: str) -> None:
    """Refuse a stack of order 2 where only stacks of order 1 are known.

    Args:
        order: Order of the stack.
        what: What does not know order 2, for the message.

    Raises:
        InvalidValue: The order is 2.
    """
    if order == 2:
        raise InvalidValue(f"{what} does not know stacks of order 2 yet; use order=1, or a plain Controller")


def accelerated(
    tasks: Sequence[BoundTask], limits: Sequence[Part], configuration: Configuration, dt: float
) -> SecondOrder:
    """Prepare bound tasks for a plan of second order, or refuse them or their limits by name.

    Args:
        tasks: The tasks.
        limits: The limits.
        configuration: The robot of the tasks.
        dt: Δt [s].

    Returns:
        The motion of the robot.

    Raises:
        InvalidValue: A task or a limit cannot be had at second order, or K_D Δt ≥ 1 in a task.
    """
    for task in tasks:
        task.accelerate()
        most = float(np.max(task.rate_gain)) * dt
        if most >= 1.0:
            raise InvalidValue(
                f"rate_gain {most / dt:g} 1/s of '{task.name}' is too large for dt = {dt:g} s: "
                "rate_gain · dt must be < 1"
            )
    names = {type(limit).__name__: limit.name for limit in limits}
    if {"BoundJointAcceleration", "BoundJointPosition"} <= set(names):
        raise InvalidValue(
            f"'{names['BoundJointPosition']}' lets a joint stop within one tick, which "
            f"'{names['BoundJointAcceleration']}' forbids; the latter keeps the ranges by itself, so leave "
            "JointPositionLimit out"
        )
    whole = bool(configuration.robot.couplings) or any(limit.kernel is None for limit in limits)
    return SecondOrder(configuration, dt, whole=whole)
