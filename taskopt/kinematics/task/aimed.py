"""Tasks with a target, which may be replaced while the stack runs."""

from collections.abc import Mapping
from typing import cast

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.parameter import Parameter
from taskopt.kinematics.redirection import TargetParameter, go_on, recalled, still
from taskopt.kinematics.space import Space
from taskopt.kinematics.target import Course, FullCourse, Hold, Target, with_acceleration
from taskopt.kinematics.task.base import BoundTask


class AimedTask(BoundTask):
    """A task with a target x_d(t).

    Attributes:
        target: The declared target.
        space: Space of its values.
        goal: The desired value of the last tick, a pose (4, 4) or a posture (nq,). Derived classes assign it;
            where it is a view into the memory, they assign it again in `use`.
    """

    target: Target
    space: Space
    goal: Array
    _course: Course
    _second_order = False
    _redirected: bool | None = None  # since the start: True by a target that moves, False by a value

    def take_target(self, target: Target, space: Space) -> None:
        """Set the declared target.

        Args:
            target: The target.
            space: Space of its values, see `taskopt.kinematics.space`.
        """
        self.target, self.space, self.fixed_target = target, space, isinstance(target, Hold)

    def begin(self, start: Array, t: float) -> None:
        """Begin the course of the target.

        Args:
            start: Value of the task at the start, a pose (4, 4) or a posture (nq,).
            t: Time [s].

        Raises:
            InvalidValue: The target does not fit the task.
        """
        self._course = self.target.start(self.space, start, t)
        if self._second_order:
            with_acceleration(self._course, self.name)
        self._redirected = None

    def accelerate(self) -> None:
        """Ask the target for its acceleration, too; see `BoundTask.accelerate`.

        Raises:
            InvalidValue: The task has no rows of second order.
        """
        if self.lift_kernel is None:
            super().accelerate()
        self._second_order = True

    def recall(self) -> Array | None:
        """Return the value to which the target was set while the stack ran, or None; see `Part.recall`.

        Raises:
            InvalidValue: The target was replaced by a moving `Target`, whose start cannot be repeated.
        """
        return recalled(self.name, self.goal, self._redirected)

    def remember(self, kept: object) -> None:
        """Restore the value to which the target was set; see `Part.remember`."""
        if isinstance(kept, np.ndarray):
            self.redirect(kept, 0.0)

    def aimed(self, t: float, rate: Array, acceleration: Array) -> bool:
        """Write the desired value, its rate, and at second order its acceleration.

        Args:
            t: Time [s].
            rate: Receives the rate.
            acceleration: Receives the acceleration in a stack of second order.

        Returns:
            False where the target stands still; neither is then written.
        """
        if self._second_order:
            return cast("FullCourse", self._course)(t, self.goal, rate, acceleration)
        return self._course(t, self.goal, rate)

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
            if self._course is still:
                return
            self._course = still
        else:
            course = go_on(target, self._course, self.space, self.goal, t)
            if self._second_order:
                with_acceleration(course, self.name)
            self._course = course
            self.fixed_target = isinstance(target, Hold)
            self._redirected = not self.fixed_target
        self.aim(t)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return gain and target; see `Part.adjustable`."""
        target = TargetParameter(self.name, self.goal, self.space, self.redirect)
        return {**super().adjustable(), "target": target}
