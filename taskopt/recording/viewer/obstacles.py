"""The obstacles of a stack in the scene, with the same names as in rows, plots and events."""

from collections.abc import Collection, Mapping
from itertools import product

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray
from taskopt.kinematics.geometry.coal import obstacle_object
from taskopt.kinematics.geometry.shapes import Box, Capsule, HalfSpace, Shape, Sphere
from taskopt.recording.viewer.arrangement import Arrangement
from taskopt.recording.viewer.motion import Motion
from taskopt.recording.viewer.palette import OBSTACLE
from taskopt.recording.viewer.paths import world_path
from taskopt.recording.viewer.robot3d import archetype
from taskopt.recording.viewer.writer import RecordingWriter

_THICKNESS = 0.002  # of the sheet that stands for a half-space, as a share of the size of the scene
_EXTENT = 0.75  # half of its width, as a share of the size of the scene


def obstacle_corners(shape: Shape) -> Array:
    """Find the smallest box around an obstacle, with sides parallel to the axes of the world.

    Args:
        shape: The obstacle.

    Returns:
        The lower and the upper corner, (2, 3) [m]; (0, 3) for a half-space, which is unbounded.
    """
    match shape:
        case Sphere():
            points, radius = np.array([shape.centre]), shape.radius
        case Capsule():
            points, radius = np.array([shape.start, shape.stop]), shape.radius
        case Box():
            half = 0.5 * np.array(shape.size)
            ends = np.array(list(product((-1.0, 1.0), repeat=3))) * half
            points, radius = ends @ shape.pose[:3, :3].T + shape.pose[:3, 3], 0.0
        case HalfSpace():
            return np.zeros((0, 3))
    return np.array([points.min(axis=0) - radius, points.max(axis=0) + radius])


class Obstacles:
    """Draw the obstacles of each robot, and move those that move.

    Args:
        obstacles: The obstacles, by name.
        moving: Names of those that move.
        arrangement: The arrangement of the scene, to whose size half-spaces are cut.
    """

    def __init__(
        self, obstacles: Mapping[str, Shape], moving: Collection[str], arrangement: Arrangement
    ) -> None:
        self._obstacles, self._moving, self._arrangement = obstacles, moving, arrangement

    def draw(self, writer: RecordingWriter, resolver: str) -> None:
        """Send the shapes, and the poses of those that stand still.

        The pose of an obstacle that moves is not sent here, since a viewer prefers what is sent as static to
        what is sent for a tick.

        Args:
            writer: The recording.
            resolver: The name of the resolver.
        """
        for name, shape in self._obstacles.items():
            sheet = isinstance(shape, HalfSpace)
            drawn = self._sheet() if sheet else archetype(obstacle_object(shape), OBSTACLE)
            if drawn is None:
                continue
            path = world_path(resolver, "obstacle", name)
            writer.log_static(path, drawn)
            if name not in self._moving:
                pose = self._drawn_at(name, shape.pose)
                writer.log_static(path, rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))

    def send(self, writer: RecordingWriter, resolver: str, batch: Motion, ticks: IntArray) -> None:
        """Send the poses of the obstacles that move.

        Args:
            writer: The recording.
            resolver: The name of the resolver.
            batch: Consecutive ticks of its robot.
            ticks: The positions of the ticks in the batch.
        """
        for name, known in batch.moving.items():
            poses = np.array([self._drawn_at(name, pose) for pose in known[ticks]])
            placed = rr.Transform3D.columns(
                translation=poses[:, :3, 3], mat3x3=poses[:, :3, :3].reshape(-1, 9)
            )
            path = world_path(resolver, "obstacle", name)
            writer.send_columns(path, batch.index[ticks], batch.time[ticks], placed)

    def _drawn_at(self, name: str, pose: Array) -> Array:
        """Return the pose (4, 4) [m] at which an obstacle is drawn; that of a half-space is mid-scene."""
        if not isinstance(self._obstacles[name], HalfSpace):
            return pose
        room, normal, out = self._arrangement, pose[:3, 2], pose.copy()
        middle = 0.5 * (room.lower + room.upper)
        out[:3, 3] = middle - normal * (normal @ (middle - pose[:3, 3]) + _THICKNESS * room.size)
        return out

    def _sheet(self) -> rr.Boxes3D:
        """Return the thin sheet that stands for a half-space, just below its surface."""
        size = self._arrangement.size
        half = [_EXTENT * size, _EXTENT * size, _THICKNESS * size]
        return rr.Boxes3D(half_sizes=[half], colors=[OBSTACLE], fill_mode="solid")
