"""Reading URDF files."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio as pin

from taskopt.errors import InvalidValue
from taskopt.kinematics.engine import GeometryModel, Model
from taskopt.kinematics.robot.couplings import Coupling, chained, narrow_leaders
from taskopt.kinematics.robot.dropped import warn_of_dropped
from taskopt.kinematics.robot.meshes import mesh_folders, read_shapes, with_found_meshes, without_meshes
from taskopt.kinematics.robot.parts import Lazy, Parts
from taskopt.kinematics.robot.srdf import add_pairs, postures
from taskopt.kinematics.robot.urdf_check import UrdfFile, checked_urdf
from taskopt.kinematics.robot.xml_file import existing, number

_ONE_AXIS = ("revolute", "continuous", "prismatic")


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
        package_dirs: Folders in which package:// is looked for; default: those above the file. The variables
            ROS_PACKAGE_PATH and AMENT_PREFIX_PATH are followed in either case.
        floating: Give the robot a floating base.
        srdf: File with named postures and disabled pairs of links, or None.
        meshes: False leaves out meshes, and keeps spheres, boxes and cylinders.

    Returns:
        The parts; shapes are loaded on first use.

    Raises:
        MissingFile: The file, its SRDF or a mesh is not there.
        InvalidValue: The file is not a tree that a `pin.Model` can hold; the message names file and element.

    Warns:
        DroppedWarning: The file states something that the robot lacks.
    """
    return read_checked(checked_urdf(existing(path, "URDF")), package_dirs, floating, srdf, meshes)


def read_checked(
    file: UrdfFile,
    package_dirs: Iterable[str | Path] | None,
    floating: bool,
    srdf: str | Path | None,
    meshes: bool,
) -> Parts:
    """Read the parts of a robot from a URDF file that has been checked; see `read_urdf`.

    Args:
        file: The file.
        package_dirs: Folders in which package:// is looked for; None: those above the file.
        floating: Give the robot a floating base.
        srdf: File with named postures and disabled pairs of links, or None.
        meshes: False leaves out meshes.

    Returns:
        The parts; shapes are loaded on first use.

    Raises:
        MissingFile: The SRDF or a mesh is not there.
        InvalidValue: The file is not a tree that a `pin.Model` can hold.

    Warns:
        DroppedWarning: The file states something that the robot lacks.
    """
    folders = mesh_folders(file.path, package_dirs)
    parts = lazy_parts(file, folders, floating, None if srdf is None else existing(srdf, "SRDF"), meshes)
    if meshes:
        with_found_meshes(file.path, file.root, folders)
    warn_of_dropped(file.path, parts.dropped)
    left_out = () if meshes else without_meshes(file.root)[1]
    return replace(parts, dropped=(*parts.dropped, *left_out))


def lazy_parts(
    file: UrdfFile, folders: list[Path], floating: bool, srdf: Path | None, meshes: bool = True
) -> Parts:
    """Read the tree of a robot now, and its shapes on first use.

    Args:
        file: The URDF file.
        folders: Folders in which meshes are looked for.
        floating: Give the robot a floating base.
        srdf: Its SRDF file, or None.
        meshes: False leaves out meshes.

    Returns:
        The parts of the robot.

    Raises:
        InvalidValue: The file is not a tree that a `pin.Model` can hold.
    """
    path, root = file.path, file.root
    model = _tree(file, floating)
    couplings, lost = _couplings(path, root)
    moving = [coupling for coupling in couplings if model.existJointName(coupling.leader)]
    root = root if meshes else without_meshes(root)[0]
    fixed = {joint.get("name", "") for joint in root.findall("joint") if joint.get("type") == "fixed"}
    states, unread = ({}, ()) if srdf is None else postures(srdf, model, fixed)
    beyond = narrow_leaders(model, moving)

    parts = Parts(
        model,
        Lazy(_collision_shapes, path, root, folders, model, srdf),
        Lazy(_visual_shapes, path, root, folders, model),
        path.stem,
        states,
        tuple(moving),
        (*file.dropped, *lost, *beyond, *unread),
    )
    return _without_stuck(parts, couplings)


def _visual_shapes(path: Path, root: ET.Element, folders: list[Path], model: Model) -> GeometryModel:
    """Read the shapes that a viewer draws."""
    return read_shapes(path, with_found_meshes(path, root, folders), model, pin.GeometryType.VISUAL)


def _collision_shapes(
    path: Path, root: ET.Element, folders: list[Path], model: Model, srdf: Path | None
) -> GeometryModel:
    """Read the shapes that may not collide, with the pairs that the SRDF file leaves."""
    out = read_shapes(path, with_found_meshes(path, root, folders), model, pin.GeometryType.COLLISION)
    if srdf is not None:
        add_pairs(model, out, srdf)
    return out


def read_tree(path: Path, floating: bool) -> Model:
    """Read the kinematic tree of a URDF file.

    Args:
        path: The URDF file.
        floating: Give the robot a floating base.

    Returns:
        The tree (`pin.Model`).

    Raises:
        InvalidValue: The file is not a tree that a `pin.Model` can hold.
    """
    return _tree(checked_urdf(path), floating)


def _tree(file: UrdfFile, floating: bool) -> Model:
    """Read the tree of a file that has been checked; see `read_tree`."""
    path, root = file.path, file.root
    moving = [joint.get("name", "") for joint in root.findall("joint") if joint.get("type") != "fixed"]
    if not moving and not floating:
        raise InvalidValue(f"{path} has no joint that moves; floating=True gives it a floating base")
    text = ET.tostring(root, encoding="unicode")
    try:
        model = (
            pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
            if floating
            else pin.buildModelFromXML(text)
        )
    except (ValueError, RuntimeError, IndexError) as error:
        raise InvalidValue(f"{path} is not a URDF that Pinocchio can read: {error}") from error
    lost = [name for name in moving if not model.existJointName(name)]
    lost += [
        link.get("name", "") for link in root.findall("link") if not model.existFrame(link.get("name", ""))
    ]
    if lost:
        raise InvalidValue(f"Pinocchio read {path} without {', '.join(lost)}, of which the file says more")
    return model


def _couplings(path: Path, root: ET.Element) -> tuple[tuple[Coupling, ...], tuple[str, ...]]:
    """Read the mimic joints of a file, with leaders that follow no joint; say which have none to follow."""
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    stated, lost = [], []
    for name, joint in joints.items():
        mimic = joint.find("mimic")
        if mimic is None or joint.get("type") not in _ONE_AXIS:
            continue
        where, leader = f"{path}: joint '{name}'", mimic.get("joint", "")
        if leader not in joints:
            lost.append(f"{name} (of '{leader}')")
            continue
        if joints[leader].get("type") in ("planar", "floating"):
            raise InvalidValue(
                f"{where} mimics '{leader}', which has several axes; it can follow one axis only"
            )
        factor, offset = number(where, mimic, "multiplier", "1"), number(where, mimic, "offset", "0")
        stated.append(Coupling(name, leader, multiplier=factor, offset=offset))
    said = f"a joint that is mimicked is not there, so that these move by themselves: {', '.join(lost)}"
    return chained(path, stated), (said,) if lost else ()


def _without_stuck(parts: Parts, couplings: Iterable[Coupling]) -> Parts:
    """Lock the joints that follow a fixed joint, whose coordinate is 0."""
    stuck = [coupling for coupling in couplings if not parts.model.existJointName(coupling.leader)]
    if not stuck:
        return parts
    q, ids = pin.neutral(parts.model), []
    for coupling in stuck:
        ids.append(parts.model.getJointId(coupling.follower))
        joint = parts.model.joints[ids[-1]]
        angle = coupling.offset
        q[joint.idx_q : joint.idx_q + joint.nq] = (
            (angle,) if joint.nq == 1 else (np.cos(angle), np.sin(angle))
        )
    return parts.locked(ids, q)
