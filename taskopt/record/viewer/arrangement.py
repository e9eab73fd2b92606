"""The arrangement of the scene: positions of the robots, side by side, and of the camera."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array

_FLAT = 0.05  # a robot whose height is a smaller share of its largest extent is drawn from above


class Camera(NamedTuple):
    """A view of the scene, in the world frame.

    Attributes:
        position: The position of the eye, (3,) [m].
        look_target: The point in the middle of the picture, (3,) [m].
        up: The direction that points up in the picture, (3,).
    """

    position: Array
    look_target: Array
    up: Array


@dataclass(frozen=True, eq=False)
class Arrangement:
    """The arrangement of the robots of several resolvers side by side, so that none hides another.

    Attributes:
        lower: The lower corner of the box around one robot, its desired paths and its obstacles, (3,) [m].
        upper: The upper corner, (3,) [m].
        flat: True for a robot that moves in the x-y plane, which is seen from above.
        columns: The number of robots in a row of the arrangement.
        crowded: True if there are obstacles; the camera is then higher and nearer, so that they hide less.
    """

    lower: Array
    upper: Array
    flat: bool
    columns: int
    crowded: bool = False

    @property
    def size(self) -> float:
        """The largest extent of one robot with its surroundings [m]."""
        return float((self.upper - self.lower).max())

    def offset(self, index: int) -> Array:
        """Return the position of a robot in the scene.

        Args:
            index: The position of its resolver in the list of the run.

        Returns:
            The origin of the robot's own world, (3,) [m].
        """
        row, column = divmod(index, self.columns)
        span = self.upper - self.lower
        if self.flat:
            return np.array([column * 1.15 * span[0], -row * 1.15 * span[1], 0.0])
        aside = column + 0.5 * row  # the second row stands in the gaps of the first
        return np.array([-row * (1.2 * span[0] + 0.3), aside * (1.1 * span[1] + 0.35), 0.0])

    def camera(self, count: int) -> Camera:
        """Choose a camera that sees all robots.

        Args:
            count: The number of robots.

        Returns:
            The camera. It is above flat robots and in front of all others, somewhat to the side of a single
            robot.
        """
        offsets = np.array([self.offset(i) for i in range(count)])
        lower, upper = (self.lower + offsets).min(axis=0), (self.upper + offsets).max(axis=0)
        centre, span = 0.5 * (lower + upper), float(np.linalg.norm(upper - lower))
        if self.flat:
            return Camera(centre + np.array([0.0, 0.0, span]), centre, np.array([0.0, 1.0, 0.0]))
        sideways = -0.55 if count == 1 else -0.25 if count == self.columns else 0.0
        toward = np.array([1.0, sideways, 0.9 if self.crowded else 0.4])
        distance = 0.85 if self.crowded else 1.35 if count == 1 else 0.95
        position = centre + distance * span * toward / np.linalg.norm(toward)
        return Camera(position, centre, np.array([0.0, 0.0, 1.0]))


def arrange(robot: Sequence[Array], count: int, obstacles: Sequence[Array] = ()) -> Arrangement:
    """Arrange the robots of a run.

    A flat robot counts as flat even among solid obstacles, because those are seen from above, too.

    Args:
        robot: Sets of points, each (k, 3) [m], that one robot and its desired paths reach.
        count: The number of robots.
        obstacles: Sets of points, each (k, 3) [m], around the obstacles.

    Returns:
        An arrangement in one row of at most three robots, else in two rows.
    """
    points = np.concatenate(robot)
    span = points.max(axis=0) - points.min(axis=0)
    flat = bool(span[2] < _FLAT * span.max())
    everything = np.concatenate([points, *obstacles])
    lower, upper = everything.min(axis=0), everything.max(axis=0)
    if flat:
        lower[2], upper[2] = points[:, 2].min(), points[:, 2].max()
    columns = count if count <= 3 else -(-count // 2)
    return Arrangement(lower, upper, flat, columns, bool(obstacles))
