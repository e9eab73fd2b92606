"""Find a posture at which goals are met: `PoseSolver`, and its short form `solve_pose`."""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import chain, islice

import numpy as np

from taskopt.arrays import Array, ArrayLike
from taskopt.errors import InvalidValue
from taskopt.kinematics.binding import require_robot
from taskopt.kinematics.limit import JointPositionLimit, Limit
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import Value
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Latest
from taskopt.kinematics.task import JointTask
from taskopt.loop.pose.descent import Descent, End
from taskopt.loop.pose.goals import NamedGoals
from taskopt.loop.pose.ranges import position_ranges
from taskopt.loop.pose.solution import PoseSolution, Verdict
from taskopt.loop.pose.stack import PostureStack, posture_stack
from taskopt.loop.pose.starts import Starts, drawn
from taskopt.loop.pose.verdict import Evidence, judge, limits_in_the_way, reason_of_success, same_ends

Goals = Mapping[str, Value] | Stack

POSTURES = 1000  # drawn once for each solver; the nearest of them are the starts
STARTS = 100
_FIRST = 50  # ticks of the descent from a start that was given
_SCAN = 15  # ticks from one that was drawn; most take seven, and another start is better than more
_REST = 100  # ticks for the levels below the goals to come to rest
_POLISHED = 3  # of the nearest ends, where none met the goals
_WAITING = 20  # starts in which links or obstacles overlap, at most, while others are tried
_FREE_STARTS = 20  # starts of the search without limits


class PoseSolver:
    """Find postures for goals of one kind; the stack is compiled and random starts are drawn only once.

    The search begins at the posture that is given, and then at postures drawn uniformly within the position
    limits, those first whose frames are nearest to the goals. From each it descends by Newton's steps of
    the stack in a trust region. Equal calls of equal solvers give equal answers. A solver has memory of its
    own and is for one thread; a copy of it is another solver.

    Args:
        robot: The robot.
        goals: Mapping from frame to goal in the world: a pose (4, 4) [m], a position (3,) [m], which leaves
            the orientation free, or a rotation (3, 3), which leaves the position free. Or a stack, whose
            first level has the goals, while the levels below are met as well as the goals allow.
        limits: Limits on the posture if the goals are a mapping; a stack has its own limits. Default: the
            joint limits of the robot.
        postures: Number of postures that are drawn.
        seed: Seed of the random postures.

    Raises:
        UnknownName: The robot has no such frame, joint or link.
        InvalidValue: There is no goal, limits are given beside a stack, or a task or limit does not fit.
    """

    def __init__(
        self,
        robot: Robot,
        goals: Goals,
        *,
        limits: Sequence[Limit] | None = None,
        postures: int = POSTURES,
        seed: int = 0,
    ) -> None:
        require_robot(robot)
        self._declared = goals, limits, postures, seed
        self.robot = robot
        self._named: NamedGoals | None = None
        if not isinstance(goals, Stack):
            self._named = NamedGoals(goals)
            stack = self._named.stack([JointPositionLimit()] if limits is None else limits)
        elif limits is not None:
            raise InvalidValue("a stack has limits of its own; leave `limits` out, or put them there")
        else:
            stack = goals
        if postures < 1:
            raise InvalidValue(f"postures must be at least 1, got {postures}")
        self._count, self._seed = postures, seed
        self._near = Latest(robot.posture("middle"))
        self._asked: PostureStack = posture_stack(stack, robot)
        self._required = 1 + bool(self._asked.clearances)
        self._ranges = position_ranges(self._asked.limits, robot)
        self._goals  # noqa: B018 (what is wrong with the declaration is said now)

    def __reduce__(self) -> tuple[object, ...]:
        goals, limits, postures, seed = self._declared
        return _remade, (self.robot, goals, limits, postures, seed)

    def solve(
        self,
        goals: Mapping[str, Value] | None = None,
        *,
        start: ArrayLike | None = None,
        near: ArrayLike | None = None,
        starts: int = STARTS,
    ) -> PoseSolution:
        """Find a posture.

        Args:
            goals: New values for all frames of the solver's goals, each of the same kind as before. None: the
                goals with which the solver was made; for a stack, the present targets, of which a moving one
                is taken at its time 0 s.
            start: Posture to begin at, (nq,) [rad, m]; targets that hold "the value at the start" take it
                from here. Default: `near`, else the middle of the joint ranges, where no search begins.
            near: Posture to stay near, (nq,) [rad, m]: a last level moves all joints towards it as far as the
                levels before allow. It is also the first start, unless `start` is given.
            starts: Largest number of starts.

        Returns:
            The posture with its verdict.

        Raises:
            InvalidValue: A goal, `start` or `near` does not fit, or `starts` is less than 1.
            UnknownName: A goal is of a frame that the solver was not made for.
            Infeasible: Hard limits of the stack contradict each other at a posture.
        """
        if starts < 1:
            raise InvalidValue(f"starts must be at least 1, got {starts}")
        if goals is not None:
            if self._named is None:
                raise InvalidValue("the goals of a stack are set in its tasks; leave `goals` out")
            self._named.set(goals)
        wanted = None if near is None else self._inside(near)
        first = wanted if start is None else self._inside(start)
        anchor = self.robot.posture("middle") if first is None else first
        if self._named is not None:  # their targets do not begin anywhere
            self._goals.aim(anchor)
        else:
            self._goals.start(anchor)
        ends = []
        for q, ticks in self._begin(first, anchor, wanted, starts):
            ends.append(self._goals.reach(q, ticks))
            if ends[-1].met:
                break
        below = self._below(wanted, anchor)
        return self._solved(ends, len(ends), below) if ends[-1].met else self._unsolved(ends, below, anchor)

    @cached_property
    def _goals(self) -> Descent:
        """The descents to the goals alone."""
        return Descent(self._asked.compiled(below=False), self.robot, self._required, self._ranges)

    @cached_property
    def _free(self) -> Descent:
        """The descents to the goals without limits."""
        without = position_ranges((), self.robot)
        return Descent(self._asked.compiled(below=False, with_limits=False), self.robot, 1, without)

    @cached_property
    def _declared_levels(self) -> Descent:
        """The descents of all levels that were declared."""
        return Descent(self._asked.compiled(), self.robot, self._required, self._ranges)

    @cached_property
    def _levels_and_near(self) -> Descent:
        """The same with a level below them that draws to the posture to stay near."""
        last = JointTask(self._near, name="near")
        return Descent(self._asked.compiled(last=last), self.robot, self._required, self._ranges)

    @cached_property
    def _starts(self) -> Starts:
        """The postures drawn, with the poses of the goals' frames."""
        postures = drawn(self.robot, self._count, self._seed, self._ranges)
        return Starts(self.robot, self._goals.plan.tasks, postures)

    def _below(self, near: Array | None, anchor: Array) -> Descent | None:
        """Return the descents of the levels below the goals, with their targets set; None without any."""
        if near is not None:
            self._near.set(near)
            below = self._levels_and_near
        elif len(self._asked.levels) > 1:
            below = self._declared_levels
        else:
            return None
        below.start(anchor)
        return below

    def _begin(
        self, first: Array | None, anchor: Array, near: Array | None, starts: int
    ) -> Iterator[tuple[Array, int]]:
        """Yield the starts with their ticks: the first one, if it is given, then those that were drawn."""
        if first is not None:
            yield first, _FIRST
            starts -= 1
        for q in islice(self._clear_first(anchor, near), starts):
            yield q, _SCAN

    def _clear_first(self, anchor: Array, near: Array | None) -> Iterator[Array]:
        """Yield the postures drawn, those nearest to the goals first, but let those that overlap wait.

        Where links or obstacles overlap, the first steps only move them apart, and fewer descents from there
        meet the goals. The first tick of a descent finds the distances of its start measured.
        """
        waiting: deque[Array] = deque()
        for posture in self._starts.nearest(self._count, near):
            q = self._with_still_joints(posture, anchor)
            if self._goals.is_clear(q):
                yield q
                continue
            waiting.append(q)
            if len(waiting) > _WAITING:  # there may be no other, since some links overlap in every posture
                yield waiting.popleft()
        yield from waiting

    def _with_still_joints(self, q: Array, anchor: Array) -> Array:
        """Return a posture in which joints that do not move the goals are as in another posture, `anchor`."""
        if self._asked.moved.all():
            return q
        still = np.where(self._asked.moved, 0.0, self.robot.difference(q, anchor))
        return self.robot.integrate(q, still, 1.0)

    def _solved(self, ends: Sequence[End], starts: int, below: Descent | None) -> PoseSolution:
        """Return the solution from the last end, once the levels below the goals are at rest there."""
        ticks, end, at_rest = sum(end.iterations for end in ends), ends[-1], True
        errors = self._goals.errors()
        if below is not None:
            later = below.rest(end.q, _REST)
            back = self._goals.reach(later.q, _SCAN)  # from where the lower levels alone were still moving
            ticks += later.iterations + back.iterations
            end, at_rest = (back, later.still and back.iterations == 1) if back.met else (end, False)
            below.look(end.q)
            errors = below.errors()
        reason = reason_of_success(starts)
        return PoseSolution(end.q, Verdict.SOLVED, reason, errors, (), starts, ticks, at_rest)

    def _unsolved(self, ends: Sequence[End], below: Descent | None, anchor: Array) -> PoseSolution:
        """Return the nearest end with the verdict on it; a solution if a longer descent meets the goals."""
        ranked = sorted(ends, key=lambda end: end.merit)
        polished = [self._goals.polish(end.q) for end in ranked[:_POLISHED]]
        best = min(polished, key=lambda end: (not end.met, end.merit))
        if best.met:
            self._goals.look(best.q)
            return self._solved([*ends, best], len(ends), below)
        ticks = sum(end.iterations for end in [*ends, *polished])
        resolution = self._goals.look(best.q)
        errors = self._goals.errors()
        limits = limits_in_the_way(resolution, self._required)
        free = bool(limits) and self._is_free(best.q, anchor)
        same = same_ends([end.merit for end in ranked])
        verdict, reason = judge(Evidence(len(ends), same, errors, limits, free))
        if below is not None:
            below.look(best.q)
            errors = below.errors()
        named = limits if verdict is Verdict.LIMIT else ()
        return PoseSolution(best.q, verdict, reason, errors, named, len(ends), ticks, best.still)

    def _is_free(self, q: Array, anchor: Array) -> bool:
        """Return True if the goals are met without limits, from a posture or from one of a few starts."""
        self._free.start(anchor)
        begins = chain([q], self._starts.nearest(_FREE_STARTS, None))
        return any(self._free.reach(begin, _SCAN).met for begin in begins)

    def _inside(self, q: ArrayLike) -> Array:
        """Return a posture from outside as an array, moved into the position limits that are in force."""
        return self.robot.coupled(self._ranges.moved_inside(self.robot.checked_q(q)))


def solve_pose(
    robot: Robot,
    goals: Goals,
    *,
    limits: Sequence[Limit] | None = None,
    start: ArrayLike | None = None,
    near: ArrayLike | None = None,
    starts: int = STARTS,
    seed: int = 0,
) -> PoseSolution:
    """Find a posture at which goals are met: static inverse kinematics with limits, obstacles and levels.

    It compiles the stack for this one call, which takes a few milliseconds; for many poses of one robot make
    a `PoseSolver` once.

    Args:
        robot: The robot.
        goals: Goals by frame, or a stack; see `PoseSolver`.
        limits: Limits on the posture beside the goals of a mapping. Default: the joint limits of the robot.
        start: Posture to begin at, (nq,) [rad, m]; see `PoseSolver.solve`.
        near: Posture to stay near, (nq,) [rad, m].
        starts: Largest number of starts.
        seed: Seed of the postures that are drawn.

    Returns:
        The posture with its verdict.

    Raises:
        UnknownName: The robot has no such frame, joint or link.
        InvalidValue: A goal, a posture, a task or a limit does not fit, or `starts` is less than 1.
    """
    solver = PoseSolver(robot, goals, limits=limits, seed=seed)
    return solver.solve(start=start, near=near, starts=starts)


def _remade(
    robot: Robot, goals: Goals, limits: Sequence[Limit] | None, postures: int, seed: int
) -> PoseSolver:
    """Make a solver again from what it was made of, for copies and pickles."""
    return PoseSolver(robot, goals, limits=limits, postures=postures, seed=seed)
