"""Targets that are replaced while a stack runs: those of tasks, and those of obstacles that move."""

from collections.abc import Callable, Mapping
from typing import cast

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.kinematics.parameter import Numbers, Ramp, Setting
from taskopt.kinematics.space import Space, Value, plain
from taskopt.kinematics.target import Course, Function, Hold, Target, with_acceleration


class Blend:
    """The way to a new value over a time, which begins at the present value with the present rate.

        x_d = x_0 ⊕ a(u) (x_1 ⊖ x_0) ⊕ c(u) T ẋ_0,   u = t/T,   a = u² (3 − 2 u),   c = u (1 − u)²

    It ends at rest. Value and rate are continuous, also where a blend replaces another one on its way.

    Args:
        to: The value x_1 at the end.
        duration: T [s].
    """

    def __init__(self, to: Value, duration: float) -> None:
        self._to, self._duration = to, duration

    def start(self, space: Space, start: Array, t: float) -> Course:
        """Begin at rest; see `Target.start`."""
        return self.go_on(space, start, np.zeros(space.tangent), t)

    def go_on(self, space: Space, start: Array, rate: Array, t: float) -> Course:
        """Begin with a rate.

        Args:
            space: Space of the values.
            start: x_0, which is copied.
            rate: ẋ_0, (tangent,).
            t: Time [s].

        Returns:
            The course.
        """
        first, duration = start.copy(), self._duration
        delta = space.difference(first, space.convert(self._to, first))

        def value(now: float) -> Array:
            u = min(max((now - t) / duration, 0.0), 1.0)
            towards, out = first.copy(), first.copy()
            space.move(first, u * u * (3.0 - 2.0 * u) * delta, towards)
            space.move(towards, u * (1.0 - u) ** 2 * duration * rate, out)
            return out

        moving = with_acceleration(Function(value).start(space, first, t), "a blend")
        end = value(t + duration)

        def course(now: float, out: Array, rate: Array, acceleration: Array | None = None) -> bool:
            if now - t < duration:
                return moving(now, out, rate, acceleration)
            out[...] = end
            return False

        return course


def go_on(target: Target, course: Course, space: Space, goal: Array, t: float) -> Course:
    """Begin a target where another one is.

    Args:
        target: The new target.
        course: The course of the present target.
        space: Space of the values.
        goal: The desired value of the last tick.
        t: Time of the tick [s].

    Returns:
        The course of the new target.

    Raises:
        InvalidValue: The target does not fit the space.
    """
    value, rate = goal.copy(), np.zeros(space.tangent)
    if not course(t, value, rate):
        rate[:] = 0.0
    return target.go_on(space, value, rate, t) if isinstance(target, Blend) else target.start(space, value, t)


class TargetParameter:
    """A parameter that is a target: a new `Target`, or a new value that is reached at once or over a time.

    Args:
        name: Name of the owner of the target, for messages.
        goal: The desired value of the last tick, a pose (4, 4) or a posture (nq,); the owner overwrites it.
        space: Space of the values.
        redirect: Function that replaces the target at a time [s], by a `Target` or by a value to hold.
    """

    def __init__(
        self, name: str, goal: Array, space: Space, redirect: Callable[[Target | Array, float], None]
    ) -> None:
        self._name, self._goal, self._space, self._redirect = name, goal, space, redirect

    def checked(self, value: Setting, over: float) -> Target | Array:
        """Return a `Target`, or a whole value to hold; see `Parameter.checked`.

        Raises:
            InvalidValue: The value does not fit, or a `Target` is to be blended.
        """
        goal = self._goal
        if isinstance(value, np.ndarray) and value.shape == goal.shape and over == 0.0:
            # Ten times as fast as `convert`. The plan names what is no pose or not finite at the next tick.
            return value.copy() if value.dtype == np.float64 else value.astype(np.float64)
        if isinstance(value, Target):
            if over > 0.0:
                raise InvalidValue(
                    f"a target of '{self._name}' that has a time of its own is not blended; leave over= "
                    "out, or give the value at the end"
                )
            return value
        # The tick completes it by the desired value, which is not known before the start.
        self._space.convert(cast("Value", value), np.eye(4) if goal.shape == (4, 4) else goal)
        held = plain(cast("Value", value))
        kept = dict(held) if isinstance(held, Mapping) else np.array(held, dtype=np.float64)
        return Blend(kept, over) if over > 0.0 else Hold(kept)

    def change(self, value: Setting, t: float, over: float) -> Ramp | None:  # noqa: ARG002 (protocol)
        """Replace the target; see `Parameter.change`."""
        self._redirect(cast("Target | Array", value), t)
        return None

    def read(self) -> Array:
        """Return the desired value, as of the last tick."""
        return self._goal.copy()


class VelocityTarget(Numbers):
    """A target that is a velocity, which its task remembers by itself, as those with other targets do."""


def still(t: float, value: Array, rate: Array, acceleration: Array | None = None) -> bool:  # noqa: ARG001
    """Leave the value as it is: a `Course` of a target that stands still.

    Args:
        t: Time [s].
        value: The value.
        rate: Its rate.
        acceleration: The rate of its rate.

    Returns:
        False, since the rate is zero.
    """
    return False


def recalled(name: str, goal: Array, redirected: bool | None) -> Array | None:
    """Return the value to which a target was set while a stack ran, for a copy of the plan.

    Args:
        name: Name of the owner of the target.
        goal: The desired value of the last tick.
        redirected: None if the target is the declared one; else True if it was replaced by one that moves.

    Returns:
        A copy of the value; None for a declared target, which the copy starts by itself.

    Raises:
        InvalidValue: The target was replaced by a moving `Target`, whose start cannot be repeated.
    """
    if redirected:
        raise InvalidValue(
            f"the target of '{name}' was replaced by one that moves, and began where the robot was then; a "
            "loop cannot be copied until its target is set to a value"
        )
    return None if redirected is None else goal.copy()
