"""Tasks with a target, which may be replaced while the stack runs."""

from collections.abc import Mapping
from typing import cast

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.kinematics.parameter import Parameter, Ramp, Setting
from taskopt.kinematics.space import Space, Value, plain
from taskopt.kinematics.target import Course, Hold, Line, Target
from taskopt.kinematics.task.base import BoundTask


class AimedTask(BoundTask):
    """A task with a target x_d(t).

    Attributes:
        goal: The desired value of the last tick, a pose (4, 4) or a posture (nq,). Derived classes assign it;
            where it is a view into the memory, they assign it again in `use`.
    """

    goal: Array
    _course: Course
    _redirected: bool | None = None  # since the start: True by a target that moves, False by a value

    def take_target(self, target: Target, space: Space) -> None:
        """Set the declared target.

        Args:
            target: The target.
            space: Space of its values, see `taskopt.kinematics.space`.
        """
        self._target, self._space, self.fixed_target = target, space, isinstance(target, Hold)

    def begin(self, start: Array, t: float) -> None:
        """Begin the course of the target.

        Args:
            start: Value of the task at the start, a pose (4, 4) or a posture (nq,).
            t: Time [s].

        Raises:
            InvalidValue: The target does not fit the task.
        """
        self._course = self._target.start(self._space, start, t)
        self._redirected = None

    def recall(self) -> Array | None:
        """Return the value to which the target was set while the stack ran, or None; see `Part.recall`.

        Raises:
            InvalidValue: The target was replaced by a moving `Target`, whose start cannot be repeated.
        """
        if self._redirected:
            raise InvalidValue(
                f"the target of '{self.name}' was replaced by one that moves, and began where the robot was "
                "then; a loop cannot be copied until its target is set to a value"
            )
        return None if self._redirected is None else self.goal.copy()

    def remember(self, kept: object) -> None:
        """Restore the value to which the target was set; see `Part.remember`."""
        if isinstance(kept, np.ndarray):
            self.redirect(kept, 0.0)

    def redirect(self, target: Target | Array, t: float) -> None:
        """Replace the target at the beginning of a tick.

        Args:
            target: A `Target`, which begins at the present desired value; or a pose (4, 4) or posture (nq,)
                to hold.
            t: Time [s].

        Raises:
            InvalidValue: The target does not fit the task.
        """
        if isinstance(target, np.ndarray):
            self.goal[...] = target
            self._redirected = False
            if self._course is _still:
                return
            self._course = _still
        else:
            self._course = target.start(self._space, self.goal, t)
            self.fixed_target = isinstance(target, Hold)
            self._redirected = not self.fixed_target
        self.aim(t)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return gain and target; see `Part.adjustable`."""
        return {**super().adjustable(), "target": _TargetParameter(self)}


class _TargetParameter:
    """The parameter "target": a new `Target`, or a new value that is reached at once or over a time."""

    def __init__(self, task: AimedTask) -> None:
        self._task = task

    def checked(self, value: Setting, over: float) -> Target | Array:
        """Return a `Target`, or a whole value to hold; see `Parameter.checked`.

        Raises:
            InvalidValue: The value does not fit the task, or a `Target` is to be blended.
        """
        goal, space = self._task.goal, self._task._space
        if isinstance(value, np.ndarray) and value.shape == goal.shape and over == 0.0:
            # Ten times as fast as `convert`. The plan names what is no pose or not finite at the next tick.
            return value.copy() if value.dtype == np.float64 else value.astype(np.float64)
        if isinstance(value, Target):
            if over > 0.0:
                raise InvalidValue(
                    f"a target of '{self._task.name}' that has a time of its own is not blended; leave over= "
                    "out, or give the value at the end"
                )
            return value
        # The tick completes it by the desired value, which is not known before the start.
        space.convert(cast("Value", value), np.eye(4) if goal.shape == (4, 4) else goal)
        held = plain(cast("Value", value))
        kept = dict(held) if isinstance(held, Mapping) else np.array(held, dtype=np.float64)
        return Line(to=kept, duration=over) if over > 0.0 else Hold(kept)

    def change(self, value: Setting, t: float, over: float) -> Ramp | None:  # noqa: ARG002 (protocol)
        """Replace the target; see `Parameter.change`."""
        self._task.redirect(cast("Target | Array", value), t)
        return None

    def read(self) -> Array:
        """Return the desired value, as of the last tick."""
        return self._task.goal.copy()


def _still(t: float, value: Array, rate: Array) -> bool:  # noqa: ARG001 (a `Course`)
    """Leave the value as it is: a `Course` of a target that stands still."""
    return False
