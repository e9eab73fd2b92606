"""Obstacles: solids that stand still in the world. Plain numbers; Coal sees them in `geometry.py`."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import numbered
from taskopt.kinematics.pose import checked_pose, homogeneous

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Sphere:
    """All points within `radius` [m] of `centre` (3,) [m]; in the plane of a planar arm, a circle."""

    centre: ArrayLike
    radius: float
    name: str = field(default="sphere", kw_only=True)

    def __post_init__(self) -> None:
        _set(self, centre=_vector("centre of a sphere", self.centre))
        _set(self, radius=positive("radius of a sphere", self.radius))

    @property
    def pose(self) -> Array:
        """(4, 4) of the centre."""
        return homogeneous(np.eye(3), np.asarray(self.centre))


@dataclass(frozen=True)
class Capsule:
    """All points within `radius` [m] of the segment from `start` to `stop`, (3,) each [m]."""

    start: ArrayLike
    stop: ArrayLike
    radius: float
    name: str = field(default="capsule", kw_only=True)

    def __post_init__(self) -> None:
        _set(self, start=_vector("start of a capsule", self.start))
        _set(self, stop=_vector("stop of a capsule", self.stop))
        _set(self, radius=positive("radius of a capsule", self.radius))

    @property
    def length(self) -> float:
        """Of the segment [m]."""
        return float(np.linalg.norm(np.subtract(self.stop, self.start)))

    @property
    def pose(self) -> Array:
        """(4, 4) of the middle, its z along the segment."""
        along = np.subtract(self.stop, self.start)
        return homogeneous(turning_z_to(along), 0.5 * np.add(self.start, self.stop))


@dataclass(frozen=True)
class Box:
    """A box with edges `size` (3,) [m]; `place` is its centre (3,), or its pose (4, 4)."""

    place: ArrayLike
    size: ArrayLike
    name: str = field(default="box", kw_only=True)

    def __post_init__(self) -> None:
        turned = np.ndim(self.place) == 2
        pose = checked_pose("place of a box", self.place) if turned else None
        _set(self, place=_vector("place of a box", self.place) if pose is None else _nested(pose))
        _set(self, size=_vector("size of a box", self.size))
        if min(self.size) <= 0.0:  # type: ignore[type-var, arg-type]
            raise InvalidValue(f"size of a box must be > 0 along each edge, got {self.size}")

    @property
    def pose(self) -> Array:
        """(4, 4) of the centre, axes along the edges."""
        place = np.array(self.place, dtype=np.float64)
        return place if place.ndim == 2 else homogeneous(np.eye(3), place)


@dataclass(frozen=True)
class HalfSpace:
    """All points x with n·x ≤ `offset` [m]: a floor, a wall; n is `normal` (3,) at length 1, outward."""

    normal: ArrayLike
    offset: float = 0.0
    name: str = field(default="half-space", kw_only=True)

    def __post_init__(self) -> None:
        normal = np.array(_vector("normal of a half-space", self.normal))
        length = float(np.linalg.norm(normal))
        if length < 1e-9:
            raise InvalidValue(f"normal of a half-space must be a direction, got {normal}")
        _set(self, normal=_nested(normal / length))
        _set(self, offset=float(finite("offset of a half-space", self.offset, ())))

    @property
    def pose(self) -> Array:
        """(4, 4) of the point of its surface nearest to the world's origin, its z out of the solid."""
        normal = np.array(self.normal)
        return homogeneous(turning_z_to(normal), self.offset * normal)


Shape = Sphere | Capsule | Box | HalfSpace


def obstacle_names(obstacles: Iterable[Shape]) -> list[str]:
    """Number the names of obstacles, so that rows, pictures and logs call each of them the same.

    Args:
        obstacles: the obstacles of one limit, objective or scene, in order.

    Returns:
        One name for each: [ball, sphere, sphere] gives ball, sphere, sphere 2.
    """
    return numbered(obstacle.name for obstacle in obstacles)


def turning_z_to(direction: Array) -> Array:
    """A rotation (3, 3) whose third column is the direction (3,); the identity for zero."""
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        return np.eye(3)
    z = direction / length
    out = np.empty((3, 3))
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    out[:, 0] = x / np.linalg.norm(x)
    out[:, 1] = np.cross(z, out[:, 0])
    out[:, 2] = z
    return out


def _vector(name: str, value: ArrayLike) -> Point:
    x, y, z = finite(name, value, (3,)).tolist()
    return x, y, z


def _nested(array: Array) -> tuple:
    """Tuples, so that an obstacle can be compared and hashed."""
    return tuple(map(tuple, array.tolist())) if array.ndim == 2 else tuple(array.tolist())


def _set(shape: Shape, **values: object) -> None:
    for name, value in values.items():
        object.__setattr__(shape, name, value)
