"""Meshes that a URDF file refers to: they are found where ROS finds them, and read with clear errors."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

import os
from collections.abc import Iterable, Iterator
from copy import deepcopy
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree as ET

import coal
import numpy as np
import pinocchio as pin

from taskopt.errors import InvalidValue, MissingFile
from taskopt.kinematics.engine import GeometryModel, Model

_POINTER = b"version https://git-lfs"  # how a file begins that Git LFS has not replaced by its content
_UNREADABLE = (ValueError, RuntimeError, IndexError)  # what the loaders of Pinocchio and Coal raise


def mesh_folders(path: Path, package_dirs: Iterable[str | Path] | None) -> list[Path]:
    """List the folders in which the meshes of a URDF file are looked for.

    Args:
        path: The URDF file.
        package_dirs: Folders that hold packages; None: all folders above the file.

    Returns:
        The folders of packages and that of the file, then those of the variables ROS_PACKAGE_PATH and
        AMENT_PREFIX_PATH.

    Raises:
        InvalidValue: package_dirs is not a list of folders.
    """
    if package_dirs is None:
        given = list(path.parents)
    else:
        given = [*package_folders(package_dirs), path.parent]
    ros = [Path(folder) for folder in _listed("ROS_PACKAGE_PATH")]
    return [*given, *ros, *(Path(prefix) / "share" for prefix in _listed("AMENT_PREFIX_PATH"))]


def package_folders(package_dirs: Iterable[str | Path]) -> list[Path]:
    """Return the absolute paths of folders that a user gave.

    Args:
        package_dirs: The folders, or a single one.

    Returns:
        The folders.

    Raises:
        InvalidValue: package_dirs is not a list of folders.
    """
    listed = [package_dirs] if isinstance(package_dirs, str | os.PathLike) else package_dirs
    if not isinstance(listed, Iterable):
        raise InvalidValue(f"package_dirs must be a list of folders, got {package_dirs!r}")
    return [_folder(folder) for folder in listed]


def with_found_meshes(path: Path, root: ET.Element, folders: list[Path]) -> ET.Element:
    """Replace the name of each mesh by the absolute path of its file.

    Args:
        path: The URDF file, for messages.
        root: Its root element, which stays as it is.
        folders: Folders in which meshes are looked for.

    Returns:
        A copy of the root element with absolute paths.

    Raises:
        MissingFile: A mesh is in none of the folders.
        InvalidValue: A mesh is empty, or a pointer of Git LFS.
    """
    out = deepcopy(root)
    for mesh in _meshes(out):
        name = mesh.get("filename", "")
        file = next(filter(Path.is_file, _places(name, folders)), None)
        if file is None:
            raise MissingFile(
                f"mesh {name}, which {path} refers to, is not there; give package_dirs= the folder that "
                f"holds the package (looked in: {', '.join(map(str, folders))}), or meshes=False to do "
                "without meshes"
            )
        _check_content(file, path)
        mesh.set("filename", str(file))
    return out


def without_meshes(root: ET.Element) -> tuple[ET.Element, tuple[str, ...]]:
    """Leave out every shape that is a mesh, and keep spheres, boxes and cylinders.

    Args:
        root: Root element of a URDF file, which stays as it is.

    Returns:
        A copy of the root element without meshes, and a sentence that names them if there were any.
    """
    out, names = deepcopy(root), []
    for link in out.findall("link"):
        for owner in [*link.findall("visual"), *link.findall("collision")]:
            mesh = owner.find("geometry/mesh")
            if mesh is not None:
                names.append(mesh.get("filename", ""))
                link.remove(owner)
    found = ", ".join(dict.fromkeys(names))
    return out, ((f"meshes are left out, as meshes=False asks for: {found}",) if names else ())


def read_shapes(path: Path, root: ET.Element, model: Model, kind: pin.GeometryType) -> GeometryModel:
    """Read the shapes of a robot.

    Args:
        path: The URDF file, for messages.
        root: Its root element, in which meshes have absolute paths.
        model: The kinematic tree that was read from it.
        kind: `pin.GeometryType.COLLISION` or `pin.GeometryType.VISUAL`.

    Returns:
        The shapes.

    Raises:
        InvalidValue: A mesh cannot be read, or has points that are not finite; the message names its file.
    """
    text = ET.tostring(root, encoding="unicode")
    try:
        shapes = pin.buildGeomFromUrdfString(model, text, kind)
    except _UNREADABLE as error:
        for mesh in _meshes(root):
            _try_alone(mesh.get("filename", ""), path)
        raise InvalidValue(f"the shapes of {path} cannot be read: {_first_line(error)}") from error
    for shape in shapes.geometryObjects:
        shape.geometry.computeLocalAABB()
        if not np.isfinite(shape.geometry.aabb_radius):
            raise InvalidValue(
                f"mesh {shape.meshPath}, which {path} refers to, has points that are not finite"
            )
    return shapes


def _meshes(root: ET.Element) -> Iterator[ET.Element]:
    """Yield the elements <mesh> of all links."""
    for link in root.findall("link"):
        yield from link.iterfind("visual/geometry/mesh")
        yield from link.iterfind("collision/geometry/mesh")


def _places(name: str, folders: list[Path]) -> Iterator[Path]:
    """Yield the files that the name of a mesh may mean: package://, model://, file://, or a plain path."""
    scheme, separator, inner = name.rpartition("://")
    if separator and scheme == "file":
        inner = inner.removeprefix("localhost")
    for text in dict.fromkeys((inner, unquote(inner))):
        if scheme in ("", "file") and Path(text).is_absolute():
            yield Path(text)
        elif scheme in ("", "file", "package", "model"):
            relative = Path(text.lstrip("/"))
            yield from (folder / relative for folder in folders)
            if scheme == "package" and len(relative.parts) > 1:  # a folder that is the package itself
                within = Path(*relative.parts[1:])
                yield from (folder / within for folder in folders if folder.name == relative.parts[0])


def _check_content(file: Path, path: Path) -> None:
    """Raise `InvalidValue` for an empty file and for a pointer of Git LFS."""
    try:
        with file.open("rb") as stream:
            head = stream.read(len(_POINTER))
    except OSError as error:
        raise InvalidValue(f"mesh {file} of {path} cannot be read: {error.strerror}") from error
    if not head:
        raise InvalidValue(f"mesh {file}, which {path} refers to, is empty")
    if head == _POINTER:
        raise InvalidValue(
            f"mesh {file}, which {path} refers to, is a pointer of Git LFS and no mesh; fetch the content "
            "with: git lfs pull"
        )


def _try_alone(file: str, path: Path) -> None:
    """Raise `InvalidValue` if a mesh cannot be read."""
    try:
        coal.MeshLoader().load(file, np.ones(3))
    except _UNREADABLE as error:
        raise InvalidValue(
            f"mesh {file}, which {path} refers to, cannot be read: {_first_line(error)}"
        ) from error


def _first_line(error: Exception) -> str:
    """Return the message of a loader, without the place in the loader's source that precedes it."""
    lines = [
        line for line in str(error).splitlines() if line and not line.startswith(("From ", "in ", "at "))
    ]
    return " ".join(lines[:2]).removeprefix("message: ")


def _folder(folder: str | Path) -> Path:
    """Return the absolute path of a folder that the caller gave."""
    if not isinstance(folder, str | os.PathLike):
        raise InvalidValue(f"package_dirs must be a list of folders, got {folder!r} in it")
    return Path(folder).expanduser().resolve()


def _listed(variable: str) -> list[str]:
    """Return the folders that an environment variable lists."""
    return [folder for folder in os.environ.get(variable, "").split(os.pathsep) if folder]
