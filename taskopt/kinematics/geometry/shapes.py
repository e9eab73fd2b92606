"""Obstacles: solids that stand still in the world, declared by plain numbers.

The shapes are frozen records that can be compared and hashed. `geometry.coal` turns them into Coal's own.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from typing_extensions import TypeAliasType

from taskopt.arrays import Array, ArrayLike, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import numbered
from taskopt.hierarchy.tolerances import NO_DIRECTION
from taskopt.kinematics.pose import checked_pose, homogeneous

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Sphere:
    """A ball, which consists of all points within a radius of a centre.

    Attributes:
        centre: (3,) [m], in the world.
        radius: [m], greater than zero.
        name: Name in rows, pictures and logs.
    """

    centre: ArrayLike
    radius: float
    name: str = field(default="sphere", kw_only=True)

    def __post_init__(self) -> None:
        _check_name(self)
        _set(self, centre=_vector("centre of a sphere", self.centre))
        _set(self, radius=positive("radius of a sphere", self.radius))

    @property
    def pose(self) -> Array:
        """Pose (4, 4) of the centre in the world [m], its axes along those of the world."""
        return homogeneous(np.eye(3), np.asarray(self.centre))


@dataclass(frozen=True)
class Capsule:
    """A capsule, which consists of all points within a radius of a line segment.

    Attributes:
        start: (3,) [m], one end of the segment, in the world.
        stop: (3,) [m], the other end, in the world.
        radius: [m], greater than zero.
        name: Name in rows, pictures and logs.
    """

    start: ArrayLike
    stop: ArrayLike
    radius: float
    name: str = field(default="capsule", kw_only=True)

    def __post_init__(self) -> None:
        _check_name(self)
        _set(self, start=_vector("start of a capsule", self.start))
        _set(self, stop=_vector("stop of a capsule", self.stop))
        _set(self, radius=positive("radius of a capsule", self.radius))

    @property
    def length(self) -> float:
        """Length of the segment [m], without the round ends."""
        return float(np.linalg.norm(np.subtract(self.stop, self.start)))

    @property
    def pose(self) -> Array:
        """Pose (4, 4) of the middle in the world [m], with the z axis along the segment."""
        along = np.subtract(self.stop, self.start)
        return homogeneous(turning_z_to(along), 0.5 * np.add(self.start, self.stop))


@dataclass(frozen=True)
class Box:
    """A box with three edge lengths.

    Attributes:
        place: Its centre (3,) [m] in the world, with edges along the axes of the world; or its pose (4, 4) in
            the world.
        size: (3,) [m], lengths of the edges along x, y and z of the box.
        name: Name in rows, pictures and logs.
    """

    place: ArrayLike
    size: ArrayLike
    name: str = field(default="box", kw_only=True)

    def __post_init__(self) -> None:
        _check_name(self)
        turned = np.ndim(self.place) == 2
        pose = checked_pose("place of a box", self.place) if turned else None
        _set(self, place=_vector("place of a box", self.place) if pose is None else _nested(pose))
        size = _vector("size of a box", self.size)
        if min(size) <= 0.0:
            raise InvalidValue(f"size of a box must be > 0 along each edge, got {size}")
        _set(self, size=size)

    @property
    def pose(self) -> Array:
        """Pose (4, 4) of the centre in the world [m], with the axes along the edges."""
        place = np.array(self.place, dtype=np.float64)
        return place if place.ndim == 2 else homogeneous(np.eye(3), place)


@dataclass(frozen=True)
class HalfSpace:
    """A half-space such as a floor or a wall: all points x of the world with nᵀx ≤ offset.

    Attributes:
        normal: n (3,), pointing out of the solid, in the world; stored at length 1.
        offset: [m], distance of the surface from the origin of the world along n.
        name: Name in rows, pictures and logs.
    """

    normal: ArrayLike
    offset: float = 0.0
    name: str = field(default="half-space", kw_only=True)

    def __post_init__(self) -> None:
        _check_name(self)
        normal = np.array(_vector("normal of a half-space", self.normal))
        length = float(np.linalg.norm(normal))
        if length < NO_DIRECTION:
            raise InvalidValue(f"normal of a half-space must be a direction, got {normal}")
        _set(self, normal=_nested(normal / length))
        _set(self, offset=float(finite("offset of a half-space", self.offset, ())))

    @property
    def pose(self) -> Array:
        """Pose (4, 4) of the point of its surface nearest to the world's origin [m], with z along n."""
        normal = np.array(self.normal)
        return homogeneous(turning_z_to(normal), self.offset * normal)


SHAPES = (Sphere, Capsule, Box, HalfSpace)
"""The classes of obstacles, for `isinstance`."""

Shape = TypeAliasType("Shape", Sphere | Capsule | Box | HalfSpace)
"""Any obstacle."""


def checked_obstacles(obstacles: Iterable[Shape] | Shape) -> tuple[Shape, ...]:
    """Check that there are obstacles and that each is a shape, and return them as a tuple.

    Args:
        obstacles: One obstacle, or several.

    Returns:
        The obstacles in order.

    Raises:
        InvalidValue: There is no obstacle, or one of them is not a shape.
    """
    if isinstance(obstacles, SHAPES):
        return (obstacles,)
    out = tuple(obstacles) if isinstance(obstacles, Iterable) else (obstacles,)
    for item in out or (None,):
        if not isinstance(item, SHAPES):
            raise InvalidValue(
                f"obstacles must be a list of Sphere, Capsule, Box or HalfSpace, got {item!r} in it"
            )
    return out


def obstacle_names(obstacles: Iterable[Shape]) -> list[str]:
    """Number the names of obstacles, so that each has one name in rows, pictures and logs.

    Args:
        obstacles: The obstacles of one limit, objective or scene, in order.

    Returns:
        One name for each: [ball, sphere, sphere] gives ball, sphere, sphere 2.
    """
    return numbered(obstacle.name for obstacle in obstacles)


def named_apart(groups: Iterable[Iterable[Shape]]) -> list[tuple[Shape, ...]]:
    """Name obstacles so that equal obstacles share a name, and different obstacles do not.

    Args:
        groups: The obstacles of each limit and objective of a stack.

    Returns:
        The groups with the same obstacles, renamed where names were taken.
    """
    collected = [tuple(group) for group in groups]
    distinct = list(dict.fromkeys(shape for group in collected for shape in group))
    name_of = dict(zip(distinct, obstacle_names(distinct), strict=True))
    return [tuple(replace(shape, name=name_of[shape]) for shape in group) for group in collected]


def facts_of(shape: Shape) -> dict[str, Any]:
    """Describe an obstacle by plain data.

    Args:
        shape: The obstacle.

    Returns:
        The name of its class as "kind", and its attributes.
    """
    return {"kind": type(shape).__name__, **asdict(shape)}


def shape_of(facts: Mapping[str, Any]) -> Shape:
    """Make an obstacle again from its data.

    Args:
        facts: What `facts_of` returned, perhaps through JSON.

    Returns:
        The obstacle.
    """
    kinds = {kind.__name__: kind for kind in SHAPES}
    return kinds[facts["kind"]](**{name: value for name, value in facts.items() if name != "kind"})


def turning_z_to(direction: Array) -> Array:
    """Find a rotation that turns the z axis to a direction.

    Args:
        direction: (3,), of any length.

    Returns:
        A rotation (3, 3) whose third column is along the direction; the identity for a zero vector.
    """
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
    """Check three finite numbers, and return them as a tuple."""
    x, y, z = finite(name, value, (3,)).tolist()
    return x, y, z


def _nested(array: Array) -> tuple[float | tuple[float, ...], ...]:
    """Turn an array into nested tuples, so that an obstacle can be compared and hashed."""
    return tuple(map(tuple, array.tolist())) if array.ndim == 2 else tuple(array.tolist())


def _check_name(shape: Shape) -> None:
    """Raise `InvalidValue` unless an obstacle has a name that can be shown."""
    if not isinstance(shape.name, str) or not shape.name.strip():
        raise InvalidValue(
            f"name of an obstacle must be a word, got {shape.name!r}; leave it out for a default"
        )


def _set(shape: Shape, **values: object) -> None:
    """Write checked values into a frozen record while it is being made."""
    for name, value in values.items():
        object.__setattr__(shape, name, value)
