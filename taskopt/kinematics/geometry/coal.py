"""Solids as shapes of Coal: capsules of links, obstacles, and convex hulls of meshes.

This is the one module that knows Coal's shapes. Distances between solids are computed in
`taskopt.kinematics.collision`.
"""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Sequence

import coal
import numpy as np
import pinocchio as pin

from taskopt.arrays import Array
from taskopt.hierarchy.tolerances import COAL
from taskopt.kinematics.engine import CoalShape, GeometryData, GeometryModel, GeometryObject
from taskopt.kinematics.geometry.shapes import Box, Capsule, HalfSpace, Shape, Sphere, turning_z_to
from taskopt.kinematics.pose import homogeneous

_LINK_COLOUR = np.array([0.35, 0.55, 0.85, 1.0])
_OBSTACLE_COLOUR = np.array([0.85, 0.35, 0.30, 0.8])
_ITERATIONS = 500  # at most, where Coal's default is 128: our tolerance is much smaller than its own
_FLAT = 1e-6  # [m] thickness given to a mesh without volume, since Coal's boxes must have one
_SIDES = 48  # of the prism around a cylinder: at most 1/cos(π/48) − 1 = 0.2 % thicker than the cylinder


def add_capsule(
    shapes: GeometryModel,
    name: str,
    joint: int,
    start: Sequence[float] | Array,
    stop: Sequence[float] | Array,
    radius: float,
) -> None:
    """Add a capsule to the shapes of a robot.

    Args:
        shapes: The shapes, to which the capsule is added.
        name: Name of the new shape.
        joint: Index of the joint that carries it.
        start: (3,) [m], one end of its segment, in the frame of the joint.
        stop: (3,) [m], the other end, in the frame of the joint.
        radius: Radius of the capsule [m].
    """
    a, b = np.asarray(start, dtype=float), np.asarray(stop, dtype=float)
    placement = homogeneous(turning_z_to(b - a), 0.5 * (a + b))
    form = coal.Capsule(radius, float(np.linalg.norm(b - a)))
    shape = pin.GeometryObject(name, joint, pin.SE3(placement), form)
    shape.meshColor = _LINK_COLOUR
    shapes.addGeometryObject(shape)


def obstacle_object(shape: Shape, name: str | None = None) -> GeometryObject:
    """Make a `pin.GeometryObject` of an obstacle, fixed to the world.

    Args:
        shape: The obstacle.
        name: Name of the new object; default: the obstacle's own.

    Returns:
        The object, from which distances are computed and which a viewer draws.
    """
    out = pin.GeometryObject(name or shape.name, 0, pin.SE3(shape.pose), _form(shape))
    out.meshColor = _OBSTACLE_COLOUR
    return out


def _form(shape: Shape) -> CoalShape:
    """Make Coal's shape of an obstacle, without its pose."""
    match shape:
        case Sphere():
            return coal.Sphere(shape.radius)
        case Capsule():
            return coal.Capsule(shape.radius, shape.length)
        case Box():
            return coal.Box(np.array(shape.size))
        case HalfSpace():
            return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)


def solid(shapes: GeometryModel) -> GeometryModel:
    """Copy shapes as convex solids, without pairs of shapes.

    A mesh becomes its convex hull, since a loaded mesh is a surface without an inside, and a shape deep
    inside it has a positive distance. A cylinder becomes a prism around it, at most 0.2 % of its radius
    thicker, since Coal's gradients have errors of 1e-6 where curved faces meet in an edge.

    Args:
        shapes: The shapes of a robot; they are not changed.

    Returns:
        A new model with the same shapes in the same order.
    """
    out = pin.GeometryModel(shapes)
    out.removeAllCollisionPairs()
    for shape in out.geometryObjects:
        if isinstance(shape.geometry, coal.BVHModelBase):
            _fill(shape)
        elif isinstance(shape.geometry, coal.Cylinder):
            shape.geometry = _prism(shape.geometry.radius, shape.geometry.halfLength)
    return out


def _fill(shape: GeometryObject) -> None:
    """Replace a mesh by its convex hull, or by its bounding box where Coal cannot build the hull."""
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


def _prism(radius: float, half_length: float) -> CoalShape:
    """Make the regular prism whose side faces touch a cylinder from outside."""
    angles = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    corner = radius / np.cos(np.pi / _SIDES)
    points = coal.StdVec_Vec3s()
    for x, y in zip(corner * np.cos(angles), corner * np.sin(angles), strict=True):
        points.extend([np.array([x, y, -half_length]), np.array([x, y, half_length])])
    return coal.ConvexBase.convexHull(points, True, "Qt")


def exact(data: GeometryData) -> GeometryData:
    """Set Coal's tolerances to the accuracy of floats, which gives gradients to about 1e-9.

    Args:
        data: Memory of distance computations; its requests are changed in place.

    Returns:
        The same memory.
    """
    for request in data.distanceRequests:
        request.gjk_tolerance = request.epa_tolerance = COAL
        request.gjk_max_iterations = request.epa_max_iterations = _ITERATIONS
    return data


def core(shape: GeometryObject) -> tuple[float, float]:
    """Decompose a solid into the sum core ⊕ ball: all points within a radius of a core.

    Args:
        shape: The solid.

    Returns:
        Diameter of the core and radius of the ball [m]. A sphere has the core diameter 0, a half-space
        an infinite one, and a solid without round edges the radius 0.
    """
    form = shape.geometry
    if isinstance(form, coal.Sphere):
        return 0.0, float(form.radius)
    if isinstance(form, coal.Capsule):
        return 2.0 * float(form.halfLength), float(form.radius)
    if isinstance(form, coal.Halfspace):
        return np.inf, 0.0
    form.computeLocalAABB()
    return 2.0 * float(form.aabb_radius), 0.0


def extent(shape: GeometryObject) -> float:
    """Return a bound on the distance of any point of a solid from the origin of its joint.

    Args:
        shape: The solid.

    Returns:
        An upper bound [m], from the sphere around the solid's bounding box.
    """
    centre, radius = ball_around(shape)
    return float(np.linalg.norm(centre)) + radius


def ball_around(shape: GeometryObject) -> tuple[Array, float]:
    """Enclose a solid in the ball around its bounding box.

    Args:
        shape: The solid.

    Returns:
        Centre (3,) in the frame of the solid's joint, and radius [m]; the centre is zero and the radius
        infinite for a half-space.
    """
    if isinstance(shape.geometry, coal.Halfspace):
        return np.zeros(3), np.inf
    shape.geometry.computeLocalAABB()
    centre = shape.placement.act(np.asarray(shape.geometry.aabb_center).ravel())
    return centre, float(shape.geometry.aabb_radius)
