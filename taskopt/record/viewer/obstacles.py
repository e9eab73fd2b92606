"""The obstacles of a stack in the scene: those that limits keep away from, and those that objectives do."""

from collections.abc import Iterator
from itertools import chain, product
from typing import Any

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.collision.coal import obstacle_object
from taskopt.kinematics.collision.shapes import Box, Capsule, HalfSpace, Shape, Sphere
from taskopt.record.recorder import RunInfo
from taskopt.record.viewer.arrangement import Place
from taskopt.record.viewer.palette import OBSTACLE, part
from taskopt.record.viewer.plots import objective_terms
from taskopt.record.viewer.robot3d import archetype
from taskopt.record.viewer.writer import Stage

_THICKNESS = 0.002  # of a half-space, as a share of the scene


def declared_obstacles(info: RunInfo) -> tuple[Shape, ...]:
    """The obstacles of the stack's limits and objectives, each once."""
    limits = (getattr(limit, "obstacles", ()) for limit in info.scenario.stack.limits)
    objectives = (getattr(term.objective, "obstacles", ()) for term in objective_terms(info))
    return tuple(dict.fromkeys(chain(*limits, *objectives)))


def corners(shape: Shape) -> Array:
    """(2, 3) of a box around an obstacle [m]; (0, 3) for a half-space, which has no end."""
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


def draw_obstacles(stage: Stage, path: str, obstacles: tuple[Shape, ...], place: Place) -> None:
    """Log the obstacles below an entity path, where they stand."""
    import rerun as rr

    for name, shape in _named(obstacles):
        pose = shape.pose
        if isinstance(shape, HalfSpace):
            drawn, pose = _slab(pose, place)
        else:
            drawn = archetype(obstacle_object(shape), OBSTACLE)
        placed = rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3])
        stage.static(f"{path}/{part(name)}", drawn, placed)


def _named(obstacles: tuple[Shape, ...]) -> Iterator[tuple[str, Shape]]:
    names = [shape.name for shape in obstacles]
    for i, shape in enumerate(obstacles):
        yield (shape.name if names.count(shape.name) == 1 else f"{shape.name} {i + 1}"), shape


def _slab(pose: Array, place: Place) -> tuple[Any, Array]:
    """A half-space as a thin sheet just below its surface, in front of the middle of the scene."""
    import rerun as rr

    normal, out = pose[:3, 2], pose.copy()
    middle = 0.5 * (place.lower + place.upper)
    thin = _THICKNESS * place.size
    out[:3, 3] = middle - normal * (normal @ (middle - pose[:3, 3]) + thin)
    half = [0.75 * place.size, 0.75 * place.size, thin]
    return rr.Boxes3D(half_sizes=[half], colors=[OBSTACLE], fill_mode="solid"), out
