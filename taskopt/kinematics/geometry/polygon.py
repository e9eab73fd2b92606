"""Convex polygons in the x-y plane of the world, described by their edges."""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import NO_DIRECTION


class Edges(NamedTuple):
    """The edges of a convex polygon, which is the set of points c (2,) with normals · c ≤ offsets.

    Attributes:
        normals: Unit normals that point outwards, (m, 2).
        offsets: Distance of each edge from the origin along its normal, (m,) [m].
    """

    normals: Array
    offsets: Array


def polygon_edges(points: ArrayLike, margin: float) -> Edges:
    """Return the edges of the convex hull of some points, moved inwards by a margin.

    Args:
        points: Points (k, 2) or (k, 3) [m]; a third coordinate does not matter.
        margin: Distance by which every edge is moved inwards [m].

    Returns:
        The edges, counter-clockwise.

    Raises:
        InvalidValue: A point is not finite, the points enclose no area, or the margin leaves no area.
    """
    flat = finite("points", points, (None, None))
    if flat.shape[1] not in (2, 3):
        raise InvalidValue(f"points must be (k, 2) or (k, 3) numbers, got {flat.shape[0]}×{flat.shape[1]}")
    if finite("margin", margin, ()) < 0.0:
        raise InvalidValue(f"margin must be ≥ 0, got {margin:g}")
    corners = _convex_hull(flat[:, :2])
    if len(corners) < 3:
        raise InvalidValue(f"points must enclose an area, got {len(flat)} that lie on one line")
    along = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    offsets = np.einsum("ij,ij->i", normals, corners) - margin
    _check_inside(normals, offsets, margin)
    return Edges(normals, offsets)


def _check_inside(normals: Array, offsets: Array, margin: float) -> None:
    """Raise `InvalidValue` if no point has normals · c < offsets: all crossings of two edges are tried."""
    m = len(offsets)
    crossings = [
        np.linalg.solve(normals[[i, j]], offsets[[i, j]])
        for i in range(m)
        for j in range(i)
        if abs(normals[i, 0] * normals[j, 1] - normals[i, 1] * normals[j, 0]) > NO_DIRECTION
    ]
    inside = [c for c in crossings if (normals @ c <= offsets + NO_DIRECTION).all()]
    middle = np.mean(inside, axis=0) if inside else None
    if middle is None or (normals @ middle >= offsets - NO_DIRECTION).any():
        raise InvalidValue(f"margin {margin:g} m leaves no area of the polygon; make it smaller")


def _convex_hull(points: Array) -> Array:
    """Return the corners of the convex hull counter-clockwise; two or fewer where there is no area."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]
    halves = []
    for path in (ordered, ordered[::-1]):
        half: list[Array] = []
        for point in path:
            while len(half) > 1 and _turn(half[-2], half[-1], point) <= 0.0:
                half.pop()
            half.append(point)
        halves.append(half[:-1])
    return np.array(halves[0] + halves[1])


def _turn(a: Array, b: Array, c: Array) -> float:
    """Return the distance of c to the left of the line from a to b [m]; 0 if it is only rounding."""
    along, out = b - a, c - a
    length = float(np.hypot(*along))
    left = float(along[0] * out[1] - along[1] * out[0]) / length if length > NO_DIRECTION else 0.0
    return left if abs(left) > NO_DIRECTION else 0.0
