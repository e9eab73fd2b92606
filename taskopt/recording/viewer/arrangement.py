"""The arrangement of the scene: positions of the robots, side by side, and of the camera."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array

_FLAT = 0.05  # a robot whose height is a smaller share of its largest extent is drawn from above

_BENT = 0.2  # a path whose second extent is a smaller share of the first is a line, and has no plane
_LEVEL = 0.8  # a plane whose normal is more upright than this is looked at from the front
_UP = np.array([0.0, 0.0, 1.0])
_FRONT = np.array([1.0, -0.5, 0.0])  # the side from which robots are looked at
_FROM_ABOVE, _SIDEWAYS = 0.3, 0.35  # of the direction of the camera, beside the normal of the path
_SLOPE = 0.5  # of the upper edge of the picture: Rerun's eye opens by 55°
_ROOM = 1.12  # around what is seen, since a robot is thicker than its joints


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
        crowded: True if there are obstacles; the camera is then higher, so that they hide less.
        normal: Normal of the plane of a path, (3,), along which the camera looks; None for none.
    """

    lower: Array
    upper: Array
    flat: bool
    columns: int
    crowded: bool = False
    normal: Array | None = None

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
        depth, along = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
        if self.normal is not None:  # the camera looks along it, and no robot hides another
            level = self.normal * np.array([1.0, 1.0, 0.0])
            depth = level / np.linalg.norm(level) * (np.sign(self.normal @ _FRONT) or 1.0)
            along = np.cross(_UP, depth)
        back, step = 1.2 * np.abs(depth) @ span + 0.3, 1.1 * np.abs(along) @ span + 0.35
        return aside * step * along - row * back * depth

    def camera(self, count: int) -> Camera:
        """Choose a camera that sees all robots, and no more than it must.

        Args:
            count: The number of robots.

        Returns:
            The camera. It is above flat robots. Before all others it looks along the normal of the path, a
            little from above, so that a circle is seen as one; else from the front, somewhat to the side of a
            single robot.
        """
        offsets = np.array([self.offset(i) for i in range(count)])
        corners = np.concatenate([np.array([self.lower, self.upper]) + offset for offset in offsets])
        ends = np.array([corners.min(axis=0), corners.max(axis=0)])
        points = np.array(list(product(*ends.T)))
        if self.flat:
            return _fitted(points, np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]))
        sideways = -0.55 if count == 1 else -0.25 if count == self.columns else 0.0
        toward = np.array([1.0, sideways, 0.9 if self.crowded else 0.4])
        if self.normal is not None:
            toward = self.normal * (np.sign(self.normal @ _FRONT) or 1.0) + _FROM_ABOVE * _UP
            toward = toward + (_SIDEWAYS * np.cross(_UP, self.normal) if count == 1 else 0.0)
        return _fitted(points, toward, _UP)


def _fitted(points: Array, toward: Array, up: Array) -> Camera:
    """Place a camera in a direction from some points (k, 3), as near as it sees all of them."""
    look = toward / np.linalg.norm(toward)
    right = np.cross(up, look) / np.linalg.norm(np.cross(up, look))
    axes = np.array([right, np.cross(look, right), look])
    seen = points @ axes.T
    middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    aside = np.abs(seen - middle)[:, :2].max(axis=1)
    distance = float((seen[:, 2] - middle[2] + aside / _SLOPE).max())
    centre = middle @ axes
    return Camera(centre + _ROOM * distance * look, centre, up)


def normal_of(paths: Sequence[Array]) -> Array | None:
    """Find the normal of the first path that lies in a plane that is not level.

    Args:
        paths: Points of each path, (k, 3) [m].

    Returns:
        The unit normal, (3,); None if there is no such path.
    """
    for points in paths:
        _, extent, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
        in_a_plane = len(points) > 3 and extent[1] > _BENT * extent[0] and extent[2] < _FLAT * extent[0]
        if in_a_plane and abs(axes[2, 2]) < _LEVEL:
            return axes[2]
    return None


def arrange(
    robot: Sequence[Array], count: int, obstacles: Sequence[Array] = (), paths: Sequence[Array] = ()
) -> Arrangement:
    """Arrange the robots of a run.

    A flat robot counts as flat even among solid obstacles, because those are seen from above, too.

    Args:
        robot: Sets of points, each (k, 3) [m], that one robot reaches.
        count: The number of robots.
        obstacles: Sets of points, each (k, 3) [m], around the obstacles.
        paths: Desired paths, each (k, 3) [m]; those of the first task first.

    Returns:
        An arrangement in one row of at most three robots, else in two rows.
    """
    points = np.concatenate([*robot, *paths])
    span = points.max(axis=0) - points.min(axis=0)
    flat = bool(span[2] < _FLAT * span.max())
    everything = np.concatenate([points, *obstacles])
    lower, upper = everything.min(axis=0), everything.max(axis=0)
    if flat:
        lower[2], upper[2] = points[:, 2].min(), points[:, 2].max()
    columns = count if count <= 3 else -(-count // 2)
    return Arrangement(lower, upper, flat, columns, bool(obstacles), normal_of(paths))
