"""Base classes of tasks: declarations that, bound to a robot, become rows of a level.

A declared task does not depend on a robot. `bind` makes a `BoundTask` of it for one robot and one plan, which
fills its rows in place on every tick. User-written tasks derive from `Task` and `BoundTask`;
`taskopt.testing.check_task` checks that they fulfil the contract of these classes.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import cast

import numpy as np

from taskopt.arrays import Array, ArrayLike, BoolArray, finite
from taskopt.errors import InvalidValue
from taskopt.jit import kernel
from taskopt.kinematics.geometry.shapes import Shape
from taskopt.kinematics.parameter import Numbers, Parameter, Setting
from taskopt.kinematics.part import RowPart
from taskopt.kinematics.robot import Robot

Cone = tuple[str, Array, float]


class BoundTask(RowPart):
    """A task of one robot in one plan: rows A v = b, or lower ≤ A v ≤ upper.

    For a task with an error e(q, t) that shall die out, A = −∂e/∂q along the velocities and
    b = ∂e/∂t + K e, so that ė = −K e where A v = b (3.67)–(3.70).

    Args:
        name: Name of the task in its plan.
        row_names: Name of each row.
        row_units: Unit of b for each row.
        gain: K [1/s], one number or one for each row.
        weight: Factor of ½ (A v − b)² within the level, one number or one for each row.
        column: For each row, the index j of the velocity if the row of A is always the unit vector e_j, else
            −1. None means −1 for all rows.

    Attributes:
        gain: K [1/s], (m,).
        weight: Weights, (m,).
        error: e of the last `fill`, unweighted, (m,), in the unit of its row times seconds. `fill` writes it.
        follows_velocity: True if `moved` must be called after each tick.
        frame: Name of the frame that the task moves, where it has desired and actual poses, else None.
        desired: Pose (4, 4) that the frame should have, as of the last `fill`, or None.
        actual: Pose (4, 4) that the frame has, as of the last `fill`, or None.
        dt: Time [s] from one tick to the next, as the plan says, which bounds gains, see `most_gain`.
        rate_gain: K_D of each row [1/s] in a stack of second order, (m,); −1 stands for critical damping,
            2 K.
        box: Sides (2, 3) [m] of a box in the world to be drawn: lower, upper; or None.
        pair: Number of rows of each of two parts, such as position and orientation, for which two weights may
            be given; () for a task without parts.
        cone: Frame, unit axis in it (3,) and half angle [rad] of a cone to be drawn, or None.
    """

    follows_velocity: bool = False
    frame: str | None = None
    desired: Array | None = None
    actual: Array | None = None
    dt: float = 0.0
    rate_gain: ArrayLike = -1.0
    box: Array | None = None
    cone: Cone | None = None
    pair: tuple[int, ...] = ()

    def __init__(
        self,
        name: str,
        row_names: Sequence[str],
        row_units: Sequence[str],
        gain: ArrayLike = 1.0,
        weight: ArrayLike = 1.0,
        column: Sequence[int] | None = None,
    ) -> None:
        super().__init__(name, row_names, row_units, column)
        m = len(self.row_names)
        self.gain, self.weight = gains(gain, m), weights(weight, m)
        self.error: Array = np.zeros(m)

    def moved(self, v: Array) -> None:
        """Tell the task the velocity that the robot has until the next tick.

        Args:
            v: Velocity, (nv,) [rad/s, m/s].
        """

    def each_weight(self, weight: ArrayLike) -> Array | float:
        """Convert a weight that was set at run time to one weight for each row in the plan.

        Args:
            weight: One number, one for each row (m,), or one for each part of `pair`.

        Returns:
            (m,) new array, or one float for all rows.

        Raises:
            InvalidValue: A weight is negative or not finite, or the number of weights is wrong.
        """
        if weight.__class__ is float and 0.0 < cast("float", weight) < np.inf:  # ten times as fast
            return cast("float", weight)
        if _is_quick(weight, len(self.row_names), np.inf):
            return cast("Array", weight).copy()
        return _each(f"weight of '{self.name}'", weight, len(self.row_names), self.pair)

    def each_gain(self, gain: ArrayLike) -> Array | float:
        """Convert a gain that was set at run time to one gain for each row in the plan.

        Args:
            gain: K [1/s], one number, or one for each row (m,).

        Returns:
            (m,) new array, or one float for all rows.

        Raises:
            InvalidValue: A gain is negative, not finite or too large for Δt, or the number of gains is wrong.
        """
        most = self.most_gain()
        if gain.__class__ is float and 0.0 <= cast("float", gain) < most:  # ten times as fast
            return cast("float", gain)
        if _is_quick(gain, len(self.row_names), most):
            return cast("Array", gain).copy()
        each = _each(f"gain of '{self.name}'", gain, len(self.row_names), ())
        if each.max() >= most:
            raise InvalidValue(
                f"gain {each.max():g} 1/s of '{self.name}' is too large for dt = {self.dt:g} s: {self._why()}"
            )
        return each

    def most_gain(self) -> float:
        """Return the number below which a gain must stay [1/s].

        At first order this is 2/Δt. At second order the steps q⁺ = q + v h + ½ q̈ h² follow a stable discrete
        form of (3.103) where K_D h < 2 and K_P h < 2 K_D. There K_D h < 1 is asked for, as 2 K h < 1 for
        critical damping, and K² h < 2 K_D where K_D is given.
        """
        if self.dt <= 0.0:
            return np.inf
        if self.lift_kernel is None:
            return 2.0 / self.dt
        least = float(np.min(self.rate_gain))
        return 0.5 / self.dt if least < 0.0 else float(np.sqrt(2.0 * least / self.dt))

    def _why(self) -> str:
        """Return why a gain is too large, in words."""
        if self.lift_kernel is None:
            return "with gain · dt ≥ 2 each step lands farther from the target; 1/dt reaches it in one"
        if np.min(self.rate_gain) < 0.0:
            return (
                f"it must be < {self.most_gain():g}, so that K_D · dt < 1 at second order, where K_D = 2 gain"
            )
        return f"it must be < {self.most_gain():g}, so that gain² · dt < 2 rate_gain; else the error grows"

    def accelerate(self) -> None:
        """Prepare the task for a stack of second order; the plan calls this once, before `use`.

        A task that can be had at second order sets `lift_kernel`, or defines `lift`.

        Raises:
            InvalidValue: The task has no rows of second order.
        """
        raise InvalidValue(
            f"'{self.name}' ({type(self).__name__}) cannot stand in a stack of order 2 yet: its J̇ v is not "
            "known; take it out, or use order=1"
        )

    def rows_of_axes(self, axes: Setting) -> BoolArray:
        """Convert a choice of axes that was set at run time to one truth value for each row in the plan.

        Args:
            axes: Names of rows, or one truth value for each row.

        Returns:
            (m,) True where a row is chosen.

        Raises:
            InvalidValue: A name is not that of a row, or the number of truth values is wrong.
        """
        names = self.row_names
        chosen = [axes] if isinstance(axes, str) else axes
        if isinstance(chosen, Sequence) and all(name in names for name in chosen):
            return np.array([name in chosen for name in names])
        if isinstance(chosen, Sequence | np.ndarray) and len(chosen) == len(names):
            mask = np.asarray(chosen)
            if mask.dtype == np.bool_:
                return mask.copy()
        raise InvalidValue(
            f"axes of '{self.name}' must be some of {', '.join(names)}, which were compiled, or "
            f"{len(names)} truth values, got {axes!r}"
        )

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return the gain; see `Part.adjustable`. The plan adds "weight", "axes" and "enabled"."""
        return {"gain": Numbers(self.gain, self.each_gain)}


def _is_quick(value: object, count: int, most: float) -> bool:
    """Return True for an array of `count` floats in [0, most), which needs no conversion and no message."""
    if not isinstance(value, np.ndarray) or value.dtype != np.float64 or value.shape != (count,):
        return False
    for number in value.tolist():  # noqa: SIM110  few numbers, for which a loop is fastest
        if not 0.0 <= number < most:
            return False
    return True


class Task:
    """Base of all tasks: a declaration that does not depend on a robot yet.

    Attributes:
        name: Name in logs and plots; None: the stack takes `default_name`.
    """

    name: str | None = None

    @property
    def obstacles(self) -> Sequence[Shape]:
        """Shapes that the task depends on, which a viewer draws; none for most tasks."""
        return ()

    def bind(self, robot: Robot, name: str) -> BoundTask:
        """Return the rows of this task for a robot.

        Args:
            robot: The robot.
            name: Name of the task in its plan.

        Returns:
            The bound task.

        Raises:
            UnknownName: The robot lacks a frame or a joint of the task.
        """
        raise NotImplementedError(f"{type(self).__name__} lacks bind()")

    def default_name(self) -> str:
        """Return the name of a task that was given none: its class in words, without "Task"."""
        words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", type(self).__name__.removesuffix("Task"))
        return words.lower()


@kernel
def task_rate(feedforward, gain, error):
    """Return the right-hand side of a row, b = feedforward + K e.

    Where A v = b, the error dies out as ė = −K e.

    Args:
        feedforward: ∂e/∂t, the rate of the target, in the unit of the error per second.
        gain: K [1/s].
        error: e, target minus actual value.

    Returns:
        b, in the unit of the error per second.

    Source:
        Equations (3.67)–(3.70).
    """
    return feedforward + gain * error


@kernel
def task_acceleration(feedforward, gain, rate_gain, error, error_rate):
    """Return the right-hand side of a row of second order, b = feedforward + K_D ė + K_P e, K_P = K².

    Where A q̈ = b, the error dies out as ë + K_D ė + K_P e = 0. With K_D = 2 K it is critically damped, and
    both of its poles are −K.

    Args:
        feedforward: ẍ_d − J̇ v, in the unit of the error per second squared.
        gain: K [1/s].
        rate_gain: K_D [1/s]; a negative number stands for 2 K.
        error: e, target minus actual value.
        error_rate: ė.

    Returns:
        b, in the unit of the error per second squared.

    Source:
        Equations (3.102) and (3.103).
    """
    damping = 2.0 * gain if rate_gain < 0.0 else rate_gain
    return feedforward + damping * error_rate + gain * gain * error


def rate_gains(rate_gain: ArrayLike | None, count: int) -> Array:
    """Return K_D for each row.

    Args:
        rate_gain: K_D [1/s], one number, or `count` numbers; None for critical damping.
        count: Number of rows.

    Returns:
        K_D of each row, (count,); −1 stands for critical damping.

    Raises:
        InvalidValue: A number is negative or not finite, or the number of gains is wrong.
    """
    return np.full(count, -1.0) if rate_gain is None else _each("rate_gain", rate_gain, count, ())


def gains(gain: ArrayLike, count: int) -> Array:
    """Return a gain for each row.

    Args:
        gain: K [1/s], one number, or `count` numbers.
        count: Number of rows.

    Returns:
        K of each row, (count,).

    Raises:
        InvalidValue: A gain is negative or not finite, or the number of gains is wrong.
    """
    return _each("gain", gain, count, ())


def weights(weight: ArrayLike, count: int, pair: tuple[int, ...] = ()) -> Array:
    """Return a weight for each row; 0 switches a row off.

    Args:
        weight: One number, `count` numbers, or one for each part of `pair`.
        count: Number of rows.
        pair: Number of rows of each of two parts, such as position and orientation; () for no parts.

    Returns:
        Weight of each row, (count,).

    Raises:
        InvalidValue: A weight is negative or not finite, all are 0, or the number of weights is wrong.
    """
    out = _each("weight", weight, count, pair)
    if not out.any():
        raise InvalidValue("weight must be > 0 for at least one row, got 0 for all")
    return out


def _each(name: str, value: ArrayLike, count: int, pair: tuple[int, ...]) -> Array:
    """Return one number ≥ 0 for each row."""
    size = np.size(value)
    if np.ndim(value) == 0:
        out = np.full(count, finite(name, value, ()))
    elif pair and size == len(pair) != count:
        out = np.repeat(finite(name, value, (len(pair),)), pair)
    else:
        out = finite(name, value, (count,))
    if (out < 0.0).any():
        raise InvalidValue(f"{name} must be ≥ 0, got {out.min():g}")
    return out


def acceleration_units(units: Iterable[str]) -> tuple[str, ...]:
    """Convert units of velocities to units of accelerations.

    Args:
        units: Units such as "rad/s"; others, such as "" of a plain number, stay.

    Returns:
        Their units per second, such as "rad/s²".
    """
    return tuple(f"{unit}²" if unit.endswith("/s") else unit for unit in units)


def rate_units(units: Iterable[str]) -> tuple[str, ...]:
    """Convert units of values to units of their rates of change.

    Args:
        units: Units of values, such as "rad", or "" for a plain number.

    Returns:
        Their units per second, such as "rad/s", or "1/s".
    """
    return tuple(f"{unit or '1'}/s" for unit in units)
