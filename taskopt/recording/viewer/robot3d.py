"""The shapes of a robot in the scene, and their motion."""

from pathlib import Path
from typing import Any, Protocol

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.recording.batch import Nanoseconds
from taskopt.recording.viewer.palette import mesh_tint, packed_colour, shape_tint
from taskopt.recording.viewer.paths import escaped_part
from taskopt.recording.viewer.writer import RecordingWriter

Geometry = Any  # a class of Coal, which ships no stubs and is not imported here
Drawn = rr.Asset3D | rr.Boxes3D | rr.Capsules3D | rr.Cylinders3D | rr.Ellipsoids3D | rr.Mesh3D
Triangles = tuple[Array, IntArray, Array]

_MEDIA_TYPES = {
    ".dae": "model/vnd.collada+xml",
    ".stl": "model/stl",
    ".obj": "model/obj",
    ".glb": "model/gltf-binary",
    ".gltf": "model/gltf+json",
}


class Placement(Protocol):
    """The interface of a pose of Pinocchio.

    Attributes:
        homogeneous: The matrix of the pose, (4, 4) [m].
    """

    homogeneous: Array


class GeometryObject(Protocol):
    """The interface of a shape of Pinocchio, which ships no stubs and is not imported here.

    Attributes:
        name: The name of the shape.
        parentJoint: The number of the joint that carries it; 0 is the base.
        placement: The pose of the shape on its joint.
        geometry: The geometry of Coal.
        meshPath: The file of the mesh, or the kind of a plain shape.
        meshScale: The factors of the mesh along its axes, (3,).
        meshColor: Red, green, blue and opacity, (4,), from 0 to 1.
        overrideMaterial: True if the colour replaces those of the mesh file.
    """

    name: str
    parentJoint: int  # noqa: N815 (Pinocchio's name)
    placement: Placement
    geometry: Geometry
    meshPath: str  # noqa: N815 (Pinocchio's name)
    meshScale: Array  # noqa: N815 (Pinocchio's name)
    meshColor: Array  # noqa: N815 (Pinocchio's name)
    overrideMaterial: bool  # noqa: N815 (Pinocchio's name)


class RobotDrawing:
    """Draw the visual shapes of a robot under any number of entity paths, and move them joint by joint."""

    def __init__(self, robot: Robot) -> None:
        """Find the shapes and the joints that carry them.

        Args:
            robot: The robot.
        """
        self._robot = robot
        self._configuration = Configuration(robot, robot.neutral)
        self._shapes: list[GeometryObject] = list(robot.visual.geometryObjects)
        self._joints = sorted({int(shape.parentJoint) for shape in self._shapes} - {0})  # 0 never moves
        self._names = [escaped_part(name) for name in ("base", *robot.joints)]
        self._meshes: dict[str, Triangles] = {}

    def draw(self, writer: RecordingWriter, path: str, colour: int | None = None) -> None:
        """Send every shape with its pose on its joint.

        Args:
            writer: The recording.
            path: The entity path of the robot.
            colour: The colour 0xRRGGBBAA that tells this robot from others; without it the shapes and mesh
                files have their own colours.
        """
        for shape in self._shapes:
            drawn = self._painted(shape, colour) if colour is not None else archetype(shape)
            if drawn is None:
                continue
            pose = np.asarray(shape.placement.homogeneous)
            scale = np.asarray(shape.meshScale).ravel() if isinstance(drawn, rr.Asset3D) else np.ones(3)
            placed = rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3] * scale)
            joint = self._names[int(shape.parentJoint)]
            writer.log_static(f"{path}/{joint}/{escaped_part(shape.name)}", drawn, placed)

    def move(self, writer: RecordingWriter, path: str, tick: IntArray, time: Nanoseconds, q: Array) -> None:
        """Send the poses of the joints.

        Args:
            writer: The recording.
            path: The entity path of the robot.
            tick: The numbers of the ticks, (k,).
            time: The times of the ticks, (k,).
            q: The configurations, (k, nq) [rad, m].
        """
        poses = self.joint_poses(q)
        for joint in self._joints:
            rotation = poses[:, joint, :3, :3].reshape(-1, 9)
            motion = rr.Transform3D.columns(translation=poses[:, joint, :3, 3], mat3x3=rotation)
            writer.send_columns(f"{path}/{self._names[joint]}", tick, time, motion)

    def joint_poses(self, q: Array) -> Array:
        """Compute the poses of all joints.

        Args:
            q: The configurations, (k, nq) [rad, m].

        Returns:
            Homogeneous matrices, (k, joints + 1, 4, 4), in the robot's world [m]; the first one of each
            configuration is the base.
        """
        out = np.empty((len(q), len(self._robot.joints) + 1, 4, 4))
        for row, configuration in zip(out, q, strict=True):
            self._configuration.update(configuration)
            row[:] = self._configuration.joint_poses()
        return out

    def corners(self, q: Array) -> Array:
        """Find the box around the joints and the centres of all shapes.

        Args:
            q: The configuration, (nq,) [rad, m].

        Returns:
            The lower and the upper corner, (2, 3), in the robot's world [m].
        """
        poses = self.joint_poses(q[None])[0]
        centres = [
            (poses[int(shape.parentJoint)] @ shape.placement.homogeneous @ [*_centre(shape), 1.0])[:3]
            for shape in self._shapes
        ]
        points = np.array([*centres, *poses[:, :3, 3]])
        return np.array([points.min(axis=0), points.max(axis=0)])

    @property
    def thickness(self) -> float:
        """Median over all shapes of half their smallest side [m]; 0 without shapes."""
        return float(np.median([_half_thickness(shape) for shape in self._shapes] or [0.0]))

    def _painted(self, shape: GeometryObject, colour: int) -> Drawn | None:
        """Draw a shape in one colour; a mesh becomes bare triangles, a quarter of the size of its file."""
        if not type(shape.geometry).__name__.startswith("BVHModel"):
            return archetype(shape, shape_tint(colour))
        if shape.name not in self._meshes:
            self._meshes[shape.name] = triangles(shape.geometry)
        return _mesh(self._meshes[shape.name], mesh_tint(colour))


def archetype(shape: GeometryObject, paint: int | None = None) -> Drawn | None:
    """Convert a shape to Rerun's archetype, in the shape's own coordinates.

    Args:
        shape: A pin.GeometryObject.
        paint: The colour 0xRRGGBBAA; without it the shape has its own.

    Returns:
        Rerun's archetype; None for a kind of geometry that Rerun has no archetype for.
    """
    form, kind = shape.geometry, type(shape.geometry).__name__
    paint = packed_colour(np.ravel(shape.meshColor)) if paint is None else paint
    ending = Path(shape.meshPath).suffix.lower()
    solid: dict[str, Any] = {"colors": [paint], "fill_mode": "solid"}
    if ending in _MEDIA_TYPES:
        own_colours = ending != ".stl" and not shape.overrideMaterial
        factor = None if own_colours else paint
        return rr.Asset3D(path=shape.meshPath, media_type=_MEDIA_TYPES[ending], albedo_factor=factor)
    if kind == "Capsule":
        length = 2.0 * form.halfLength
        start = [[0.0, 0.0, -0.5 * length]]
        return rr.Capsules3D(lengths=[length], radii=[form.radius], translations=start, **solid)
    if kind == "Cylinder":
        return rr.Cylinders3D(lengths=[2.0 * form.halfLength], radii=[form.radius], **solid)
    if kind == "Sphere":
        return rr.Ellipsoids3D(half_sizes=[[form.radius] * 3], **solid)
    if kind == "Box":
        return rr.Boxes3D(half_sizes=[form.halfSide], **solid)
    return _mesh(triangles(form), paint) if kind.startswith("BVHModel") else None


def triangles(form: Geometry) -> Triangles:
    """Read the triangles of a mesh.

    Args:
        form: A mesh of Coal, already scaled.

    Returns:
        The vertices, (v, 3) [m], the three vertices of each triangle, (t, 3), and the mean unit normal at
        each vertex, (v, 3), which is zero at a vertex of no triangle.
    """
    vertices = np.array(form.vertices())
    corners = (form.tri_indices(i) for i in range(form.num_tris))
    faces = np.array([(corner[0], corner[1], corner[2]) for corner in corners], dtype=np.int64)
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    normals = np.zeros_like(vertices)
    for i in range(3):
        np.add.at(normals, faces[:, i], np.cross(b - a, c - a))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return vertices, faces, normals / np.where(length > 0.0, length, 1.0)


def _mesh(parts: Triangles, paint: int) -> rr.Mesh3D:
    """Draw triangles in one colour."""
    vertices, faces, normals = parts
    return rr.Mesh3D(
        vertex_positions=vertices, triangle_indices=faces, vertex_normals=normals, albedo_factor=paint
    )


def _half_thickness(shape: GeometryObject) -> float:
    """Return half the smallest side of the box around a shape [m]."""
    shape.geometry.computeLocalAABB()
    box = shape.geometry.aabb_local
    return 0.5 * float(min(box.width(), box.height(), box.depth()))


def _centre(shape: GeometryObject) -> Array:
    """Return the centre of the box around a shape, in its own coordinates, (3,) [m]."""
    shape.geometry.computeLocalAABB()
    return np.asarray(shape.geometry.aabb_center).ravel()
