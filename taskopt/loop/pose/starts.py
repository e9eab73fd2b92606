"""Starts of a search: random postures, in the order of the distance of their frames from the goals."""

from collections.abc import Iterator, Sequence

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task import BoundTask
from taskopt.loop.pose.ranges import PositionRanges
from taskopt.loop.pose.stack import framed

_ROTATION_SHARE = 0.3  # what a change of R by 1 counts, in units of the spread of the positions
_NEAR_SHARE = 0.3  # what a change of a joint by 1 rad counts there, where a posture to stay near is given


def drawn(robot: Robot, count: int, seed: int, within: PositionRanges | None = None) -> Array:
    """Draw postures uniformly within the position limits; coupled joints then follow their leaders.

    The coordinate of a joint without limits is drawn from ±π rad if it turns, and from ±1 m if it slides.

    Args:
        robot: The robot.
        count: Number of postures.
        seed: Seed of the random numbers.
        within: Ranges inside those of the robot, such as those of limits with margins.

    Returns:
        Postures, (count, nq) [rad, m].
    """
    rng = np.random.default_rng(seed)
    has = robot.position_index >= 0
    zero = np.where(has, robot.neutral[robot.position_index], 0.0)
    reach = np.array([np.pi if unit == "rad" else 1.0 for unit in robot.coordinate_units])
    lower, upper = robot.position_lower - zero, robot.position_upper - zero
    if within is not None:
        own = within.columns
        lower[own] = np.maximum(lower[own], within.lower - zero[own])
        upper[own] = np.minimum(upper[own], within.upper - zero[own])
    low = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper - 2.0 * reach, -reach))
    high = np.where(np.isfinite(upper), upper, low + 2.0 * reach)
    moves = rng.uniform(low, high, (count, robot.nv))
    return np.array([robot.coupled(robot.integrate(robot.neutral, v, 1.0)) for v in moves])


class Starts:
    """Postures with the poses that the frames of the goals have there.

    Poses are compared as points (p, s R) of 12 numbers for each goal, so that one product of a matrix with a
    vector finds the nearest posture. A goal without rows of orientation leaves R out, and so for p.

    Args:
        robot: The robot.
        tasks: The goals as bound.
        postures: The postures, (count, nq) [rad, m].
    """

    def __init__(self, robot: Robot, tasks: Sequence[BoundTask], postures: Array) -> None:
        self._robot, self._goals = robot, framed(tasks)
        self._postures, count = postures, len(postures)
        configuration, poses = Configuration(robot, robot.neutral), []
        for q in self._postures:
            configuration.update(q)
            poses.append([configuration.pose(str(task.frame))[:3] for task in self._goals])
        rows = np.array(poses).reshape(count, len(self._goals), 3, 4)
        spread = float(np.sqrt(rows[..., 3].var(axis=0).sum(axis=-1).mean())) if self._goals else 1.0
        self._scale = np.array([_scale(task, spread) for task in self._goals]).reshape(-1, 3, 4)
        self._points = (rows * self._scale).reshape(count, -1)
        self._squares = (self._points**2).sum(axis=1)
        self._bend = _NEAR_SHARE * spread

    def nearest(self, count: int, near: Array | None) -> Iterator[Array]:
        """Yield postures in the order in which their frames are near the goals as they are aimed at now.

        Args:
            count: Number of postures.
            near: Posture (nq,) to which they are to be near, too, or None.

        Yields:
            Postures, (nq,) [rad, m]; without goals that have a frame, in the order in which they were drawn.
        """
        score = self._squares.copy()
        if self._goals:
            wanted = np.array([np.asarray(task.desired)[:3] for task in self._goals]) * self._scale
            score -= 2.0 * (self._points @ wanted.ravel())
        if near is not None:
            away = np.array([self._robot.difference(near, q) for q in self._postures])
            score += (self._bend * self._bend) * (away**2).sum(axis=1)
        yield self._postures[int(score.argmin())]
        for index in np.argsort(score, kind="stable")[1:count]:
            yield self._postures[index]


def _scale(task: BoundTask, spread: float) -> Array:
    """Return what each number of a pose (3, 4) counts for a goal."""
    scale = np.zeros((3, 4))
    scale[:, 3] = float(any(unit.startswith("m") for unit in task.row_units))
    scale[:, :3] = _ROTATION_SHARE * spread * any(unit.startswith("rad") for unit in task.row_units)
    return scale
