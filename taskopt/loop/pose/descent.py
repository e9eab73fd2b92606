"""The descent from one start to the goals or to a posture at rest, by Newton's steps in a trust region.

    v = the resolution of the stack at q, with gain 1 and Δt = 1 s, each |v_j| ≤ r
    q ⊕ v is accepted: go on from there, with a larger r where the errors fell to less than half
    else: halve v, and let r be its largest entry

The direction of a step is that of the strict stack; what is accepted is decided from E_k = Σ w e² of the
errors of each level k. On the way to the goals the merit φ = E_1 + ν E_2 + ν² E_3 + … must not grow, so that
a step may pass through an obstacle. Where level k cannot be met, such a descent may end with an error of
order ν in the level before; the last descents to an end that is reported therefore take smaller ν. Once the
goals are met, the levels are compared in their order, see `_InOrder`. Every step keeps the limits, since
with v they also allow every fraction of it.

Source:
    Nocedal and Wright (2006), Numerical Optimization, Sect. 4.1 (trust regions in a box) and 10.3
    (least squares).
"""

from collections.abc import Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.errors import NotSolved
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import (
    GOAL_ORIENTATION,
    GOAL_OTHER,
    GOAL_POSITION,
    MERIT_NOISE,
    POSTURE_AT_REST,
    STEP_STILL,
)
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Plan, Stack
from taskopt.kinematics.task import BoundTask
from taskopt.loop.loop import Loop
from taskopt.loop.pose.clearance import BoundClearance
from taskopt.loop.pose.ranges import PositionRanges
from taskopt.loop.pose.solution import GoalError
from taskopt.loop.pose.stack import LARGEST_STEP, STEP, BoundTrustRegion
from taskopt.resolver.registry import as_resolver

_SHARE = 0.01  # ν, what a level counts in the merit beside the level before
_POLISH = (_SHARE, _SHARE**2, _SHARE**3)  # ν of the descents to an end that is reported
_POLISH_TICKS = 100  # of each of them
_SLACK = 0.01  # [m, rad] error of a level that Newton's next step removes
_BETTER = 0.99  # share of E_k that makes a level better
_ALLOWED = GoalError(GOAL_POSITION, GOAL_ORIENTATION, GOAL_OTHER)


class End(NamedTuple):
    """The end of a descent.

    Attributes:
        q: The posture, (nq,) [rad, m].
        met: True if the goals are met there.
        merit: φ there, or, after `rest`, E_k of the last level.
        iterations: Number of ticks.
        still: True if the last step was shorter than what counts as a step.
    """

    q: Array
    met: bool
    merit: float
    iterations: int
    still: bool


class _Merit:
    """Accept a step if φ does not grow.

    Args:
        share: ν.
    """

    def __init__(self, share: float) -> None:
        self._share = share
        self.value = np.inf  # of φ at the posture accepted last
        self.fell = True  # to less than half, by the step accepted last

    def accepts(self, squares: Sequence[float]) -> bool:
        """Judge E_k of all levels."""
        found, factor = 0.0, 1.0
        for square in squares:
            found += factor * square
            factor *= self._share
        if found > self.value * (1.0 + MERIT_NOISE):
            return False
        self.fell, self.value = found < 0.5 * self.value, found
        return True


class _InOrder:
    """Accept a step that improves a level and keeps the levels before it up to a small error.

    A level counts as kept if its E_k is at most `_SLACK`² above the least so far.
    """

    def __init__(self) -> None:
        self._held: Sequence[float] = ()
        self._least: Sequence[float] = ()
        self.value = np.inf  # E_k of the last level
        self.fell = True

    def accepts(self, squares: Sequence[float]) -> bool:
        """Judge E_k of all levels."""
        if self._held and not self._is_better(squares):
            return False
        self._least = (
            [min(pair) for pair in zip(squares, self._least, strict=True)] if self._held else squares
        )
        self._held, self.value = squares, squares[-1]
        return True

    def _is_better(self, squares: Sequence[float]) -> bool:
        """Return True if the first level that changes has become better."""
        for square, held, least in zip(squares, self._held, self._least, strict=True):
            if square > least + _SLACK**2:
                return False
            if square < _BETTER * held and held > GOAL_POSITION**2:
                return True
        return squares[-1] <= self._held[-1] * (1.0 + MERIT_NOISE)


class _Measured(NamedTuple):
    """A bound task with its rows in metres, in radians, and in other units."""

    task: BoundTask
    rows: tuple[IntArray, IntArray, IntArray]


class Descent:
    """The descents of one stack of one robot, with all memory allocated.

    Args:
        stack: The stack, with a `TrustRegion` among its limits.
        robot: The robot.
        required: Number of levels, from the first on, whose errors decide if the goals are met.
        ranges: Ranges of the coordinates, outside which the goals do not count as met.

    Attributes:
        plan: The stack, compiled.
    """

    def __init__(self, stack: Stack, robot: Robot, required: int, ranges: PositionRanges) -> None:
        self.plan: Plan = stack.compile(robot, STEP)
        self._loop = Loop(self.plan, as_resolver("active-set"), "raise")
        self._loop.start(robot.posture("middle"), 0.0)
        self._radius = next(part for part in self.plan.limits if isinstance(part, BoundTrustRegion)).memory
        numbers = [block.level for block in self.plan.layout.blocks if block.level]
        pairs = tuple(zip(map(_measured, self.plan.tasks), numbers, strict=True))
        self._levels = [[known for known, k in pairs if k == level] for level in range(1, max(numbers) + 1)]
        self._goals = list(chain(*self._levels[:required]))
        self._clearances = [task for task in self.plan.tasks if isinstance(task, BoundClearance)]
        self._small = sum(_largest_met(known.task.weight) for known in self._goals)
        self._required, self._ranges = required, ranges

    def start(self, q: Array) -> None:
        """Start all targets from a posture.

        Args:
            q: The posture, (nq,) [rad, m].
        """
        self.plan.start(q, 0.0)

    def aim(self, q: Array) -> None:
        """Write the present targets of tasks that do not begin at a posture.

        Args:
            q: Any posture, (nq,) [rad, m].
        """
        self.plan.aim(q, 0.0)

    def is_clear(self, q: Array) -> bool:
        """Return True if the distances that the stack keeps are kept at a posture.

        Args:
            q: The posture, (nq,) [rad, m].
        """
        if not self._clearances:
            return True
        self.plan.configuration.update(q)
        return all(task.is_kept(self.plan.configuration) for task in self._clearances)

    def reach(self, q: Array, iterations: int) -> End:
        """Go from a posture to the goals.

        Args:
            q: The posture, (nq,) [rad, m].
            iterations: Largest number of ticks.

        Returns:
            The end, which is at the goals, at rest, or after that many ticks.
        """
        return self._descend(q, iterations, _Merit(_SHARE), rest=False)

    def polish(self, q: Array) -> End:
        """Go on from a posture that does not meet the goals, to the least error near it.

        Args:
            q: The posture, (nq,) [rad, m].

        Returns:
            The end, with the merit of the last ν.
        """
        end, ticks = End(q, False, np.inf, 0, False), 0
        for share in _POLISH:
            end = self._descend(end.q, _POLISH_TICKS, _Merit(share), rest=False)
            ticks += end.iterations
            if end.met:
                break
        return end._replace(iterations=ticks)

    def rest(self, q: Array, iterations: int) -> End:
        """Go on from a posture that meets the goals until the levels below them are at rest, too.

        Args:
            q: The posture, (nq,) [rad, m].
            iterations: Largest number of ticks.

        Returns:
            The end; it is `still` if a step there is shorter than what counts as motion.
        """
        return self._descend(q, iterations, _InOrder(), rest=True)

    def look(self, q: Array) -> Resolution:
        """Resolve the stack at a posture, with the largest trust region.

        Args:
            q: The posture, (nq,) [rad, m].

        Returns:
            The resolution, with the bounds that are active there.

        Raises:
            NotSolved: There is no answer.
        """
        self._loop.forget()
        self._radius[0] = LARGEST_STEP
        return self._loop.tick(q, 0.0)

    def errors(self) -> dict[str, GoalError]:
        """Return the error of each task at the posture of the last tick, by name."""
        return {known.task.name: _error(known) for known in chain(*self._levels)}

    def _descend(self, q: Array, iterations: int, judge: _Merit | _InOrder, *, rest: bool) -> End:
        """Descend from a posture until the goals are met or, with `rest`, until no step moves the robot."""
        self._loop.forget()
        tick, integrate, radius = self._loop.tick, self.plan.robot.integrate, LARGEST_STEP
        best, met, step = q, False, np.zeros(0)
        for count in range(1, iterations + 1):
            self._radius[0] = radius
            try:
                v = tick(q, 0.0).x
            except NotSolved:
                return End(best, met, judge.value, count, False)
            squares = self._squares()
            if judge.accepts(squares):
                if judge.fell:
                    radius = min(2.0 * radius, LARGEST_STEP)
                best, step = q, v
                met = sum(squares[: self._required]) <= self._small and self._is_met()
                length = _largest(v)
                if met and (not rest or length <= POSTURE_AT_REST):
                    return End(best, met, judge.value, count, True)
                radius = radius if length > STEP_STILL else 0.0
            else:
                step = 0.5 * step
                radius = _largest(step)
            if radius <= STEP_STILL:
                return End(best, met, judge.value, count, True)
            q = integrate(best, step, STEP)
        return End(best, met, judge.value, iterations, False)

    def _squares(self) -> list[float]:
        """Return E_k of each level at the posture of the last tick."""
        found = []
        for level in self._levels:
            square = 0.0
            for known in level:
                error = known.task.error
                square += float((error * known.task.weight).dot(error))
            found.append(square)
        return found

    def _is_met(self) -> bool:
        """Return True if every required goal is met at the posture of the last tick, inside the ranges."""
        return self._ranges.contain(self.plan.configuration.q) and all(
            value <= allowed
            for known in self._goals
            for value, allowed in zip(_error(known), _ALLOWED, strict=True)
        )


def _measured(task: BoundTask) -> _Measured:
    """Return a task with its rows by unit."""
    metres = np.array([unit.startswith("m") for unit in task.row_units])
    radians = np.array([unit.startswith("rad") for unit in task.row_units])
    every = np.arange(metres.size)
    return _Measured(task, (every[metres], every[radians], every[~metres & ~radians]))


def _largest_met(weight: Array) -> float:
    """Return a merit that a task does not exceed while it is met."""
    return float(weight.max()) * sum(allowed * allowed for allowed in _ALLOWED)


def _largest(v: Array) -> float:
    """Return the largest magnitude in v; for a few numbers, a list is ten times as fast as an array."""
    return max(map(abs, v.tolist()))


def _error(known: _Measured) -> GoalError:
    """Return the error of a task, by unit."""
    parts = [known.task.error[rows] for rows in known.rows]
    return GoalError(*(float(np.sqrt(part @ part)) for part in parts))
