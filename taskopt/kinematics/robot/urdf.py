"""Reading URDF and SRDF files."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array
from taskopt.errors import InvalidValue, MissingFile
from taskopt.kinematics.robot.parts import Parts


def read_urdf(
    path: str | Path,
    package_dirs: Iterable[str | Path] | None = None,
    floating: bool = False,
    srdf: str | Path | None = None,
    meshes: bool = True,
) -> Parts:
    """The parts of a robot from a URDF file; every mesh that it refers to is looked for at once."""
    path = _existing(path, "URDF")
    folders = _folders(path, package_dirs)
    if meshes:
        require_meshes(path, folders)
    return lazy_parts(path, folders, floating, None if srdf is None else _existing(srdf, "SRDF"), meshes)


def lazy_parts(
    path: Path, folders: list[str], floating: bool, srdf: Path | None, meshes: bool = True
) -> Parts:
    """The tree now, the shapes when they are asked for."""

    def shapes(kind: Any) -> Any:
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


def read_tree(path: Path, floating: bool) -> Any:
    """The pin.Model of a URDF; raise `InvalidValue` if it is none."""
    try:
        if floating:
            return pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
        return pin.buildModelFromUrdf(str(path))
    except ValueError as error:
        raise InvalidValue(f"{path} is not a URDF that Pinocchio can read: {error}") from error


def require_meshes(path: Path, folders: list[str]) -> None:
    """Raise `MissingFile` for the first mesh of the URDF that is in none of the folders."""
    for mesh in _parse(path).iter("mesh"):
        filename = mesh.get("filename", "")
        if not _found(filename, folders):
            raise MissingFile(
                f"mesh {filename}, which {path} refers to, is not there; give package_dirs= the folder "
                f"that holds the package (looked in: {', '.join(folders)}), or meshes=False to do without"
            )


def named_states(srdf: Path) -> dict[str, dict[str, list[float]]]:
    """Joint values of each `group_state`; states of one name over several groups are merged."""
    states: dict[str, dict[str, list[float]]] = {}
    for state in _parse(srdf).iter("group_state"):
        values = states.setdefault(state.get("name", ""), {})
        for joint in state.iter("joint"):
            values[joint.get("name", "")] = [float(x) for x in joint.get("value", "").split()]
    return states


def postures(srdf: Path, model: Any) -> dict[str, Array]:
    """Configurations (nq,) of an SRDF: named joints from there, all others neutral.

    A state most of whose joints the model lacks belongs to another variant of the robot, and is left out.
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


def _add_pairs(model: Any, shapes: Any, srdf: Path) -> None:
    """Give the shapes all pairs but those that an SRDF disables; none where it disables none."""
    if next(_parse(srdf).iter("disable_collisions"), None) is not None:
        shapes.addAllCollisionPairs()
        pin.removeCollisionPairs(model, shapes, str(srdf))


def _set(q: Array, joint: Any, values: list[float]) -> None:
    """Write a joint's value as SRDF states it: an angle even where q holds cosine and sine."""
    if len(values) == 1 and joint.nq == 2 and joint.nv == 1:
        values = [float(np.cos(values[0])), float(np.sin(values[0]))]
    if len(values) == joint.nq:
        q[joint.idx_q : joint.idx_q + joint.nq] = values


def _parse(path: Path) -> Any:
    try:
        return ET.parse(path)
    except ET.ParseError as error:
        raise InvalidValue(f"{path} is not XML: {error}") from error


def _existing(path: str | Path, kind: str) -> Path:
    path = Path(path).expanduser().resolve()
    if not path.is_file():
        near = sorted(p.name for p in path.parent.glob(f"*{path.suffix}"))[:5] if path.parent.is_dir() else []
        there = f"; in that folder: {', '.join(near)}" if near else "; check the path"
        raise MissingFile(f"no {kind} file {path}{there}")
    return path


def _folders(path: Path, package_dirs: Iterable[str | Path] | None) -> list[str]:
    """Where meshes are looked for: the folders given, or all above the file; its own in either case."""
    if package_dirs is None:
        return [str(folder) for folder in path.parents]
    if isinstance(package_dirs, str | Path):
        package_dirs = [package_dirs]
    return [str(Path(folder).expanduser().resolve()) for folder in [*package_dirs, path.parent]]


def _found(filename: str, folders: list[str]) -> bool:
    """Whether Pinocchio will find a mesh: in the folders, or where an absolute name says."""
    scheme, _, inner = filename.rpartition("://")
    if Path(inner).is_absolute() and scheme in {"", "file"}:
        return Path(inner).is_file()
    ros = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    return any((Path(folder) / inner.lstrip("/")).is_file() for folder in [*folders, *filter(None, ros)])
