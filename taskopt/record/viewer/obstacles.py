"""The obstacles of a stack in the scene, with the same names as in rows, plots and events."""

from collections.abc import Mapping
from itertools import product

import numpy as np
import rerun as rr

from taskopt.arrays import Array
from taskopt.kinematics.geometry.coal import obstacle_object
from taskopt.kinematics.geometry.shapes import Box, Capsule, HalfSpace, Shape, Sphere
from taskopt.record.viewer.arrangement import Arrangement
from taskopt.record.viewer.palette import OBSTACLE
from taskopt.record.viewer.paths import escaped_part
from taskopt.record.viewer.robot3d import archetype
from taskopt.record.viewer.writer import RecordingWriter

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


def draw_obstacles(
    writer: RecordingWriter, path: str, obstacles: Mapping[str, Shape], arrangement: Arrangement
) -> None:
    """Send the obstacles of one robot.

    Args:
        writer: The recording.
        path: The entity path of their parent.
        obstacles: The obstacles, by name.
        arrangement: The arrangement of the scene, to whose size half-spaces are cut.
    """
    for name, shape in obstacles.items():
        pose = shape.pose
        if isinstance(shape, HalfSpace):
            drawn, pose = _sheet(pose, arrangement)
        else:
            drawn = archetype(obstacle_object(shape), OBSTACLE)
        if drawn is not None:
            placed = rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3])
            writer.log_static(f"{path}/{escaped_part(name)}", drawn, placed)


def _sheet(pose: Array, arrangement: Arrangement) -> tuple[rr.Boxes3D, Array]:
    """Return a thin sheet just below the surface of a half-space in the middle of the scene, and its pose."""
    normal, centre = pose[:3, 2], pose.copy()
    middle = 0.5 * (arrangement.lower + arrangement.upper)
    thin = _THICKNESS * arrangement.size
    centre[:3, 3] = middle - normal * (normal @ (middle - pose[:3, 3]) + thin)
    half = [_EXTENT * arrangement.size, _EXTENT * arrangement.size, thin]
    return rr.Boxes3D(half_sizes=[half], colors=[OBSTACLE], fill_mode="solid"), centre
