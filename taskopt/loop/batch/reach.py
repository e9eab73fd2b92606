"""Which poses a frame of a robot reaches, and in which of its postures it moves best there.

Every pose is tried from several random postures. A batch leads all of them towards their poses within the
limits, and the posture of the largest manipulability is kept for each pose. Further rounds begin at the
postures found at neighbouring poses, so that a good posture spreads over the map.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from taskopt.arrays import Array, ArrayLike, BoolArray, IntArray, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import GOAL_POSITION
from taskopt.kinematics.limit import JointPositionLimit, JointVelocityLimit
from taskopt.kinematics.lockstep.frames import frame_jacobians, frame_poses, take_poses
from taskopt.kinematics.pose import checked_pose
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.task import FrameTask
from taskopt.loop.batch.controller import BatchController
from taskopt.loop.pose.starts import drawn

_DT = 1.0  # [s], so that a velocity is a step
_GAIN = 0.7  # [1/s], share of the error that a step removes
_STEP = 0.3  # [rad, m] largest step of a joint
_STEPS, _ROUNDS = 12, 6  # steps between two looks at all descents, and number of looks
_PROGRESS = 0.9  # a descent that leaves more of its error between two looks is given up


@dataclass(frozen=True, eq=False)
class ReachMap:
    """The poses that a frame reaches, each with the posture of the largest manipulability that was found.

    That a pose is not `reached` says that no start led to it, and proves nothing.

    Attributes:
        robot: The robot.
        frame: The frame.
        poses: The poses that were asked for, (N, 4, 4) in the world, translation in [m].
        q: The postures, (N, nq) [rad, m]; NaN where the pose is not reached.
        manipulability: √det(J Jᵀ) of (3.56) at these postures, or √det(Jᵀ J) for a robot of less than six
            joints, (N,); NaN where the pose is not reached.
    """

    robot: Robot
    frame: str
    poses: Array
    q: Array
    manipulability: Array

    @property
    def reached(self) -> BoolArray:
        """True for each pose that is reached, to 1e-6 m and 1e-6 rad, (N,)."""
        return np.isfinite(self.manipulability)

    def __repr__(self) -> str:
        reached = np.count_nonzero(self.reached)
        return (
            f"<ReachMap of {self.frame} of {self.robot.name}: {reached} of {len(self.poses)} poses reached>"
        )


def reach_map(
    robot: Robot,
    frame: str,
    poses: ArrayLike,
    *,
    starts: int = 8,
    rounds: int = 2,
    seed: int = 0,
    threads: int | None = None,
) -> ReachMap:
    """Find which poses a frame reaches within the joint limits, and the best posture for each.

    Args:
        robot: The robot; its joints are revolute or prismatic, with one coordinate each.
        frame: Name of the frame.
        poses: Poses in the world, (N, 4, 4), translation in [m].
        starts: Number of postures from which each pose is tried, in each round.
        rounds: Number of rounds; the first begins at random postures, and every further one at postures that
            were found for the nearest poses.
        seed: Seed of the random postures.
        threads: Number of threads; None for one for each core. The result does not depend on it.

    Returns:
        The map.

    Raises:
        UnknownName: The robot has no frame of that name.
        InvalidValue: A pose is none, a number is out of its range, or a joint is of another kind.

    Source:
        (3.56) for the manipulability.
    """
    goals = _checked(poses)
    for name, number in (("starts", starts), ("rounds", rounds)):
        if not isinstance(number, int) or number < 1:
            raise InvalidValue(f"{name} must be a whole number from 1 on, got {number!r}")
    descents = _Descents(robot, frame, goals, starts, threads)
    begin = drawn(robot, starts * len(goals), seed).reshape(starts, len(goals), robot.nq)
    best, value = descents.reach(begin)
    nearest = _nearest(goals[:, :3, 3], starts)
    for _ in range(rounds - 1):
        own = np.where(np.isfinite(value)[:, None], best, robot.posture("middle"))
        neighbours = best[nearest.T]
        begin = np.where(np.isfinite(neighbours), neighbours, own)
        again, found = descents.reach(begin)
        better = np.nan_to_num(found, nan=-1.0) > np.nan_to_num(value, nan=-1.0)
        best[better], value[better] = again[better], found[better]
    return ReachMap(robot, frame, goals, best, value)


class _Descents:
    """Descents to all poses of a map, from the same number of postures for each.

    Args:
        robot: The robot.
        frame: The frame.
        goals: The poses, (N, 4, 4).
        starts: Number of descents to each pose.
        threads: As for `BatchController`.
    """

    def __init__(self, robot: Robot, frame: str, goals: Array, starts: int, threads: int | None) -> None:
        limits = [JointPositionLimit(), JointVelocityLimit(velocity=_STEP)]
        stack = Stack([[FrameTask(frame, gain=_GAIN, name="frame")]], limits, damping=None)
        self._batch = BatchController(robot, stack, _DT, threads=threads)
        self._robot, self._frame = robot, frame
        self._goals = np.tile(goals, (starts, 1, 1))

    def reach(self, begin: Array) -> tuple[Array, Array]:
        """Go to the poses from postures (starts, N, nq).

        Returns:
            For each pose the posture of the largest manipulability (N, nq), and that (N,); NaN where no
            descent came to the pose.
        """
        starts, count, nq = begin.shape
        q = begin.reshape(-1, nq).copy()
        error = np.full(len(q), np.inf)
        going = np.arange(len(q))
        for _ in range(_ROUNDS):
            q[going] = self._go(q[going], self._goals[going])
            before, error[going] = error[going], self._error(q[going], self._goals[going])
            now = error[going]
            going = going[(now > GOAL_POSITION) & (now < _PROGRESS * before)]
            if not going.size:
                break
        J = frame_jacobians(self._robot, self._frame, q)
        w = np.prod(np.linalg.svd(J, compute_uv=False), axis=1)
        w, q = np.where(error <= GOAL_POSITION, w, -1.0).reshape(starts, count), q.reshape(begin.shape)
        first, each = w.argmax(axis=0), np.arange(count)
        found = w[first, each] >= 0.0
        return np.where(found[:, None], q[first, each], np.nan), np.where(found, w[first, each], np.nan)

    def _go(self, q: Array, goals: Array) -> Array:
        """Take some steps from postures (k, nq) towards poses (k, 4, 4), and return the postures there."""
        batch = self._batch
        batch.start(q)
        batch.set({"frame.target": goals})
        for _ in range(_STEPS):
            v = batch.step(q).v
            q = batch.integrate(q, np.where(np.isfinite(v), v, 0.0))
        return q

    def _error(self, q: Array, goals: Array) -> Array:
        """Return the larger of the distance [m] and the angle [rad] from each pose, (k,)."""
        poses = frame_poses(self._robot, self._frame, q)
        away = np.linalg.norm(poses[:, :3, 3] - goals[:, :3, 3], axis=1)
        chord = np.linalg.norm(poses[:, :3, :3] - goals[:, :3, :3], axis=(1, 2)) / np.sqrt(8.0)
        return np.maximum(away, 2.0 * np.arcsin(np.minimum(chord, 1.0)))


def _checked(poses: ArrayLike) -> Array:
    """Return poses as an array; raise `InvalidValue` if there is none, or if one is no pose."""
    goals = finite("poses", poses, (None, 4, 4))
    if not len(goals):
        raise InvalidValue("poses must have one pose at least, got none")
    wrong = take_poses(goals, np.empty((len(goals), 12)))
    if wrong >= 0:
        checked_pose(f"pose {wrong}", goals[wrong])
    return goals


def _nearest(points: Array, count: int) -> IntArray:
    """Return the indices (N, count) of the nearest other points; the last ones again if there are too few."""
    _, index = KDTree(points).query(points, k=min(count + 1, len(points)))
    index = index.reshape(len(points), -1)
    return index[:, np.minimum(np.arange(1, count + 1), index.shape[1] - 1)]
