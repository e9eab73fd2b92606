"""Shapes as Coal has them: links made in code, obstacles, convex hulls of meshes. The one door to Coal."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Sequence
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from taskopt.arrays import Array
from taskopt.kinematics.geometry.shapes import Box, Capsule, HalfSpace, Shape, Sphere, turning_z_to
from taskopt.kinematics.pose import homogeneous

_LINK_COLOUR = np.array([0.35, 0.55, 0.85, 1.0])
_OBSTACLE_COLOUR = np.array([0.85, 0.35, 0.30, 0.8])
_TOLERANCE, _ITERATIONS = 1e-12, 500  # at Coal's own 1e-6, gradients of hulls are off by 5 %
_FLAT = 1e-6  # [m] thickness of what has none
_SIDES = 48  # of the prism around a cylinder


def add_capsule(
    shapes: Any,
    name: str,
    joint: int,
    start: Sequence[float] | Array,
    stop: Sequence[float] | Array,
    radius: float,
) -> None:
    """Add a capsule around the segment from `start` to `stop` [m] in the frame of a joint."""
    a, b = np.asarray(start, dtype=float), np.asarray(stop, dtype=float)
    placement = homogeneous(turning_z_to(b - a), 0.5 * (a + b))
    form = coal.Capsule(radius, float(np.linalg.norm(b - a)))
    shape = pin.GeometryObject(name, joint, pin.SE3(placement), form)
    shape.meshColor = _LINK_COLOUR
    shapes.addGeometryObject(shape)


def obstacle_object(shape: Shape, name: str | None = None) -> Any:
    """An obstacle as a pin.GeometryObject fixed to the world, also for drawing it."""
    out = pin.GeometryObject(name or shape.name, 0, pin.SE3(shape.pose), _form(shape))
    out.meshColor = _OBSTACLE_COLOUR
    return out


def _form(shape: Shape) -> Any:
    match shape:
        case Sphere():
            return coal.Sphere(shape.radius)
        case Capsule():
            return coal.Capsule(shape.radius, shape.length)
        case Box():
            return coal.Box(np.array(shape.size))
        case HalfSpace():
            return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)


def solid(shapes: Any) -> Any:
    """A copy of a pin.GeometryModel with convex solids only, and no pairs.

    A mesh becomes its convex hull: as loaded it is a surface that knows no inside, and a shape deep in it
    is at a positive distance. A cylinder becomes a prism around it, at most 0.2 % of its radius thicker:
    on curved faces that meet in an edge, Coal's gradients stop at 1e-6.
    """
    out = pin.GeometryModel(shapes)
    out.removeAllCollisionPairs()
    for shape in out.geometryObjects:
        if isinstance(shape.geometry, coal.BVHModelBase):
            _fill(shape)
        elif isinstance(shape.geometry, coal.Cylinder):
            shape.geometry = _prism(shape.geometry.radius, shape.geometry.halfLength)
    return out


def _fill(shape: Any) -> None:
    """Replace a mesh by its convex hull; by its bounding box where Coal gives the hull up."""
    mesh = shape.geometry
    try:
        mesh.buildConvexHull(True, "Qt")
    except (RuntimeError, ValueError):  # no volume, or a corner with more neighbours than Coal counts
        mesh.computeLocalAABB()
        box, centre = mesh.aabb_local, np.ravel(mesh.aabb_center)
        shape.geometry = coal.Box(*np.maximum([box.width(), box.height(), box.depth()], _FLAT))
        shape.placement = shape.placement * pin.SE3(np.eye(3), centre)
        return
    shape.geometry = mesh.convex


def _prism(radius: float, half_length: float) -> Any:
    angles = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    corner = radius / np.cos(np.pi / _SIDES)
    points = coal.StdVec_Vec3s()
    for x, y in zip(corner * np.cos(angles), corner * np.sin(angles), strict=True):
        points.extend([np.array([x, y, -half_length]), np.array([x, y, half_length])])
    return coal.ConvexBase.convexHull(points, True, "Qt")


def exact(data: Any) -> Any:
    """A pin.GeometryData whose distances are as good as floats allow, gradients to about 1e-9."""
    for request in data.distanceRequests:
        request.gjk_tolerance = request.epa_tolerance = _TOLERANCE
        request.gjk_max_iterations = request.epa_max_iterations = _ITERATIONS
    return data


def core(shape: Any) -> tuple[float, float]:
    """Size and radius [m] of a solid, as a convex core of at most that size thickened by the radius."""
    form = shape.geometry
    if isinstance(form, coal.Sphere):
        return 0.0, float(form.radius)
    if isinstance(form, coal.Capsule):
        return 2.0 * float(form.halfLength), float(form.radius)
    if isinstance(form, coal.Halfspace):
        return np.inf, 0.0
    form.computeLocalAABB()
    return 2.0 * float(form.aabb_radius), 0.0


def extent(shape: Any) -> float:
    """The farthest that any point of a solid can be from the origin of its joint [m]."""
    shape.geometry.computeLocalAABB()
    centre = shape.placement.act(np.asarray(shape.geometry.aabb_center).ravel())
    return float(np.linalg.norm(centre)) + float(shape.geometry.aabb_radius)
