"""Reading URDF and SRDF files."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

import os
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array
from taskopt.errors import InvalidValue, MissingFile
from taskopt.kinematics.engine import GeometryModel, JointModel, Model
from taskopt.kinematics.robot.parts import Parts


def read_urdf(
    path: str | Path,
    package_dirs: Iterable[str | Path] | None = None,
    floating: bool = False,
    srdf: str | Path | None = None,
    meshes: bool = True,
) -> Parts:
    """Read the parts of a robot from a URDF file, and look for every mesh that it refers to.

    Args:
        path: The URDF file.
        package_dirs: Folders in which package:// is looked for; default: those above the file.
        floating: Give the robot a floating base.
        srdf: File with named postures and disabled pairs of links, or None.
        meshes: False does without shapes.

    Returns:
        The parts; shapes are loaded on first use.

    Raises:
        MissingFile: The file, its SRDF or a mesh is not there.
        InvalidValue: Pinocchio cannot read the file.
    """
    path = _existing(path, "URDF")
    folders = _folders(path, package_dirs)
    if meshes:
        require_meshes(path, folders)
    return lazy_parts(path, folders, floating, None if srdf is None else _existing(srdf, "SRDF"), meshes)


def lazy_parts(
    path: Path, folders: list[str], floating: bool, srdf: Path | None, meshes: bool = True
) -> Parts:
    """Read the tree of a robot now, and its shapes on first use.

    Args:
        path: The URDF file.
        folders: Folders in which meshes are looked for.
        floating: Give the robot a floating base.
        srdf: Its SRDF file, or None.
        meshes: False does without shapes.

    Returns:
        The parts of the robot.

    Raises:
        InvalidValue: Pinocchio cannot read the file.
    """

    def shapes(kind: pin.GeometryType) -> GeometryModel:
        require_meshes(path, folders)
        out = pin.buildGeomFromUrdf(model, str(path), kind, package_dirs=folders)
        if srdf is not None and kind == pin.GeometryType.COLLISION:
            _add_pairs(model, out, srdf)
        return out

    model = read_tree(path, floating)
    return Parts(
        model,
        (lambda: shapes(pin.GeometryType.COLLISION)) if meshes else None,
        (lambda: shapes(pin.GeometryType.VISUAL)) if meshes else None,
        path.stem,
        {} if srdf is None else postures(srdf, model),
    )


def read_tree(path: Path, floating: bool) -> Model:
    """Read the kinematic tree of a URDF file.

    Args:
        path: The URDF file.
        floating: Give the robot a floating base.

    Returns:
        The tree (`pin.Model`).

    Raises:
        InvalidValue: Pinocchio cannot read the file.
    """
    try:
        if floating:
            return pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
        return pin.buildModelFromUrdf(str(path))
    except ValueError as error:
        raise InvalidValue(f"{path} is not a URDF that Pinocchio can read: {error}") from error


def require_meshes(path: Path, folders: list[str]) -> None:
    """Look for every mesh that a URDF file refers to.

    Args:
        path: The URDF file.
        folders: Folders in which meshes are looked for.

    Raises:
        MissingFile: a mesh is in none of the folders.
    """
    for mesh in _parse(path).iter("mesh"):
        filename = mesh.get("filename", "")
        if not _found(filename, folders):
            raise MissingFile(
                f"mesh {filename}, which {path} refers to, is not there; give package_dirs= the folder "
                f"that holds the package (looked in: {', '.join(folders)}), or meshes=False to do without"
            )


def named_states(srdf: Path) -> dict[str, dict[str, list[float]]]:
    """Read the joint values of each `group_state` of an SRDF file.

    States of one name that belong to several groups are merged.

    Args:
        srdf: The SRDF file.

    Returns:
        For each state, the values [rad, m] of each of its joints.

    Raises:
        InvalidValue: The file is not XML.
    """
    states: dict[str, dict[str, list[float]]] = {}
    for state in _parse(srdf).iter("group_state"):
        values = states.setdefault(state.get("name", ""), {})
        for joint in state.iter("joint"):
            values[joint.get("name", "")] = [float(x) for x in joint.get("value", "").split()]
    return states


def postures(srdf: Path, model: Model) -> dict[str, Array]:
    """Read the named configurations of an SRDF file; joints that it does not name are neutral.

    A state of which the model lacks most joints belongs to another variant of the robot, and is left out.

    Args:
        srdf: The SRDF file.
        model: The kinematic tree.

    Returns:
        Configurations (nq,) [rad, m] by name.

    Raises:
        InvalidValue: The file is not XML.
    """
    out = {}
    for name, values in named_states(srdf).items():
        known = [joint for joint in values if model.existJointName(joint)]
        if 2 * len(known) <= len(values):
            continue
        q = pin.neutral(model)
        for joint in known:
            _set(q, model.joints[model.getJointId(joint)], values[joint])
        out[name] = pin.normalize(model, q)
    return out


def _add_pairs(model: Model, shapes: GeometryModel, srdf: Path) -> None:
    """Give the shapes all pairs except those that an SRDF disables; no pairs if it disables none."""
    if next(_parse(srdf).iter("disable_collisions"), None) is not None:
        shapes.addAllCollisionPairs()
        pin.removeCollisionPairs(model, shapes, str(srdf))


def _set(q: Array, joint: JointModel, values: list[float]) -> None:
    """Write a joint's value into q; an SRDF states an angle even where q holds cosine and sine."""
    if len(values) == 1 and joint.nq == 2 and joint.nv == 1:
        values = [float(np.cos(values[0])), float(np.sin(values[0]))]
    if len(values) == joint.nq:
        q[joint.idx_q : joint.idx_q + joint.nq] = values


def _parse(path: Path) -> "ET.ElementTree[ET.Element]":
    """Read an XML file; raise `InvalidValue` if it is none."""
    try:
        return ET.parse(path)
    except ET.ParseError as error:
        raise InvalidValue(f"{path} is not XML: {error}") from error


def _existing(path: str | Path, kind: str) -> Path:
    """Return the absolute path of a file; raise `MissingFile` if it is not there."""
    path = Path(path).expanduser().resolve()
    if not path.is_file():
        near = sorted(p.name for p in path.parent.glob(f"*{path.suffix}"))[:5] if path.parent.is_dir() else []
        there = f"; in that folder: {', '.join(near)}" if near else "; check the path"
        raise MissingFile(f"no {kind} file {path}{there}")
    return path


def _folders(path: Path, package_dirs: Iterable[str | Path] | None) -> list[str]:
    """List the folders in which meshes are looked for: those given, or all above the file; always its own."""
    if package_dirs is None:
        return [str(folder) for folder in path.parents]
    if isinstance(package_dirs, str | Path):
        package_dirs = [package_dirs]
    return [str(Path(folder).expanduser().resolve()) for folder in [*package_dirs, path.parent]]


def _found(filename: str, folders: list[str]) -> bool:
    """Return True if Pinocchio will find a mesh, in one of the folders or under its absolute name."""
    scheme, _, inner = filename.rpartition("://")
    if Path(inner).is_absolute() and scheme in {"", "file"}:
        return Path(inner).is_file()
    ros = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    return any((Path(folder) / inner.lstrip("/")).is_file() for folder in [*folders, *filter(None, ros)])
