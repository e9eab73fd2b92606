"""Shapes of a compiled MJCF file, for collisions and for a viewer."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Sequence
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from taskopt.kinematics.engine import CoalShape, GeometryModel

_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = 2, 3, 4, 5, 6, 7  # mujoco.mjtGeom
_DRAWN = 3  # MuJoCo's viewer shows the groups below this one


def shapes_of(
    compiled: Any, joints: Sequence[int], offsets: Sequence[pin.SE3], *, collision: bool
) -> GeometryModel:
    """Make the shapes of a compiled MJCF file.

    A shape collides if the file lets it touch anything (contype or conaffinity), and is drawn if it is in one
    of the groups that MuJoCo draws. Shapes of the world, planes and height fields are left out.

    Args:
        compiled: The compiled file (`mujoco.MjModel`).
        joints: Index of the joint that carries each body.
        offsets: Pose of each body in that joint.
        collision: True for the shapes that collide, False for those that are drawn.

    Returns:
        The shapes. If the file excludes pairs of bodies from contact, they contain all other pairs.
    """
    out = pin.GeometryModel()
    touches = (compiled.geom_contype | compiled.geom_conaffinity) != 0
    drawn = compiled.geom_group < _DRAWN
    chosen = touches if collision else (drawn if drawn.any() else np.ones_like(drawn))
    bodies: list[int] = []
    for g in np.flatnonzero(chosen & (compiled.geom_bodyid > 0)).tolist():
        form, body = _form(compiled, g), int(compiled.geom_bodyid[g])
        if form is None:
            continue
        w, x, y, z = compiled.geom_quat[g]
        turn = pin.Quaternion(w, x, y, z).normalized().matrix()
        place = offsets[body] * pin.SE3(turn, np.array(compiled.geom_pos[g]))
        name = compiled.geom(g).name or f"{compiled.body(body).name or f'body{body}'}_{g}"
        shape = pin.GeometryObject(name, joints[body], place, form)
        shape.meshColor = np.array(compiled.geom_rgba[g], dtype=float)
        out.addGeometryObject(shape)
        bodies.append(body)
    if collision and compiled.nexclude:
        _add_pairs(compiled, out, bodies)
    return out


def _form(compiled: Any, g: int) -> CoalShape | None:
    """Return the solid of a geom, or None for a kind that a robot's link cannot have."""
    kind, (a, b, c) = int(compiled.geom_type[g]), (float(s) for s in compiled.geom_size[g])
    if kind == _SPHERE:
        return coal.Sphere(a)
    if kind == _CAPSULE:
        return coal.Capsule(a, 2.0 * b)
    if kind == _ELLIPSOID:
        return coal.Ellipsoid(a, b, c)
    if kind == _CYLINDER:
        return coal.Cylinder(a, 2.0 * b)
    if kind == _BOX:
        return coal.Box(2.0 * a, 2.0 * b, 2.0 * c)
    return _mesh(compiled, int(compiled.geom_dataid[g])) if kind == _MESH else None


def _mesh(compiled: Any, m: int) -> CoalShape:
    """Return a mesh as Coal's tree of triangles."""
    corners = slice(compiled.mesh_vertadr[m], compiled.mesh_vertadr[m] + compiled.mesh_vertnum[m])
    faces = slice(compiled.mesh_faceadr[m], compiled.mesh_faceadr[m] + compiled.mesh_facenum[m])
    points = coal.StdVec_Vec3s()
    for point in compiled.mesh_vert[corners]:
        points.append(np.array(point, dtype=float))
    triangles = coal.StdVec_Triangle()
    for face in compiled.mesh_face[faces]:
        triangles.append(coal.Triangle(*(int(corner) for corner in face)))
    out = coal.BVHModelOBBRSS()
    out.beginModel(len(triangles), len(points))
    out.addSubModel(points, triangles)
    out.endModel()
    return out


def _add_pairs(compiled: Any, shapes: GeometryModel, bodies: Sequence[int]) -> None:
    """Add all pairs of shapes of different bodies except those that the file excludes from contact."""
    excluded = {(int(s) >> 16, int(s) & 0xFFFF) for s in compiled.exclude_signature}
    for i, one in enumerate(bodies):
        for j in range(i + 1, len(bodies)):
            two = bodies[j]
            if one != two and (one, two) not in excluded:  # in both the lower index comes first
                shapes.addCollisionPair(pin.CollisionPair(i, j))
