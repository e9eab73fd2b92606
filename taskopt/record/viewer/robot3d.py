"""A robot's shapes in the scene, and their motion."""

from pathlib import Path
from typing import Any

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.record.viewer.palette import part, tint
from taskopt.record.viewer.writer import Stage

_FILES = {
    ".dae": "model/vnd.collada+xml",
    ".stl": "model/stl",
    ".obj": "model/obj",
    ".glb": "model/gltf-binary",
    ".gltf": "model/gltf+json",
}


class RobotDrawing:
    """The visual shapes of a robot, drawn under any number of entity paths and moved joint by joint."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._at = Configuration(robot, robot.neutral)
        self._shapes = list(robot.visual.geometryObjects)
        self._joints = sorted({int(shape.parentJoint) for shape in self._shapes})
        self._names = [part(name) for name in ("base", *robot.joints)]
        self._meshes: dict[str, tuple[Array, IntArray, Array]] = {}

    def draw(self, stage: Stage, path: str, colour: int | None = None) -> None:
        """Log every shape where it sits on its joint.

        `colour` paints them, to tell robots apart; without it the mesh files bring their own colours.
        """
        import rerun as rr

        for shape in self._shapes:
            drawn = self._painted(shape, colour) if colour is not None else archetype(shape)
            if drawn is None:
                continue
            pose = np.asarray(shape.placement.homogeneous)
            scale = np.asarray(shape.meshScale).ravel() if isinstance(drawn, rr.Asset3D) else np.ones(3)
            placed = rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3] * scale)
            stage.static(f"{path}/{self._names[int(shape.parentJoint)]}/{part(shape.name)}", drawn, placed)

    def move(self, stage: Stage, path: str, tick: IntArray, time: Any, q: Array) -> None:
        """Send the joint poses for each q, (k, nq)."""
        import rerun as rr

        poses = self.joint_poses(q)
        for joint in self._joints:
            if joint == 0:
                continue
            at = poses[:, joint]
            turned = at[:, :3, :3].reshape(-1, 9)
            motion = rr.Transform3D.columns(translation=at[:, :3, 3], mat3x3=turned)
            stage.columns(f"{path}/{self._names[joint]}", tick, time, motion)

    def joint_poses(self, q: Array) -> Array:
        """(k, joints + 1, 4, 4) in the robot's world."""
        out = np.empty((len(q), len(self._robot.joints) + 1, 4, 4))
        for row, posture in zip(out, q, strict=True):
            self._at.update(posture)
            row[:] = self._at.joint_poses()
        return out

    def corners(self, q: Array) -> Array:
        """Points (2, 3) of the box around the joints and the middles of all shapes at q."""
        poses = self.joint_poses(q[None])[0]
        centres = [
            (poses[int(s.parentJoint)] @ s.placement.homogeneous @ [*_centre(s), 1.0])[:3]
            for s in self._shapes
        ]
        points = np.array([*centres, *poses[:, :3, 3]])
        return np.array([points.min(axis=0), points.max(axis=0)])

    def _painted(self, shape: Any, colour: int) -> Any:
        """One colour all over; a mesh goes in as bare triangles, a quarter of the size of its file."""
        import rerun as rr

        if not type(shape.geometry).__name__.startswith("BVHModel"):
            return archetype(shape, tint(colour, 0.75))
        if shape.name not in self._meshes:
            self._meshes[shape.name] = _triangles(shape.geometry)
        vertices, triangles, normals = self._meshes[shape.name]
        return rr.Mesh3D(
            vertex_positions=vertices,
            triangle_indices=triangles,
            vertex_normals=normals,
            albedo_factor=tint(colour, 0.45),
        )


def archetype(shape: Any, paint: int | None = None) -> Any:
    """What draws a pin.GeometryObject, in its own colour unless painted; None for a kind that has none."""
    import rerun as rr

    form, kind = shape.geometry, type(shape.geometry).__name__
    paint = _rgba(shape.meshColor) if paint is None else paint
    ending = Path(shape.meshPath).suffix.lower()
    if ending in _FILES:
        bare = ending == ".stl" or shape.overrideMaterial
        return rr.Asset3D(
            path=shape.meshPath, media_type=_FILES[ending], albedo_factor=paint if bare else None
        )
    solid = {"colors": [paint], "fill_mode": "solid"}
    if kind == "Capsule":
        length = 2.0 * form.halfLength
        return rr.Capsules3D(
            lengths=[length], radii=[form.radius], translations=[[0.0, 0.0, -0.5 * length]], **solid
        )
    if kind == "Cylinder":
        return rr.Cylinders3D(lengths=[2.0 * form.halfLength], radii=[form.radius], **solid)
    if kind == "Sphere":
        return rr.Ellipsoids3D(half_sizes=[[form.radius] * 3], **solid)
    if kind == "Box":
        return rr.Boxes3D(half_sizes=[form.halfSide], **solid)
    if kind.startswith("BVHModel"):
        vertices, triangles, normals = _triangles(form)
        return rr.Mesh3D(
            vertex_positions=vertices, triangle_indices=triangles, vertex_normals=normals, albedo_factor=paint
        )
    return None


def _triangles(form: Any) -> tuple[Array, IntArray, Array]:
    """Vertices (v, 3), scaled already, triangles (t, 3), and the mean normal at each vertex."""
    vertices = np.array(form.vertices())
    corners = (form.tri_indices(i) for i in range(form.num_tris))
    triangles = np.array([(corner[0], corner[1], corner[2]) for corner in corners], dtype=np.int64)
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    normals = np.zeros_like(vertices)
    for i in range(3):
        np.add.at(normals, triangles[:, i], np.cross(b - a, c - a))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return vertices, triangles, normals / np.where(length > 0.0, length, 1.0)


def _centre(shape: Any) -> Array:
    shape.geometry.computeLocalAABB()
    return np.asarray(shape.geometry.aabb_center).ravel()


def _rgba(colour: Any) -> int:
    r, g, b, a = (round(255 * float(channel)) for channel in np.clip(np.ravel(colour), 0.0, 1.0))
    return (r << 24) | (g << 16) | (b << 8) | a
