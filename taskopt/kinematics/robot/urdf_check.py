"""Checks of a URDF file: it must be a tree with readable numbers; statements that are not read are listed.

The loader of Pinocchio reads only what it knows: a link with two parents loses a joint, a cycle vanishes, and
a shape with a flawed number is left out, each without a message. This module therefore reads the file as
well. An error names every element from which the loader would make another robot than the file describes.
Statements that have no counterpart in a `pin.Model` become sentences of `Robot.dropped`.

Source:
    The URDF elements and their defaults are those of the XML format that ROS documents for urdfdom.
"""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from taskopt.errors import InvalidValue
from taskopt.kinematics.robot.xml_file import names_of, number, numbers, parse

_SHAPES: Mapping[str, Mapping[str, int]] = {  # attributes of each shape and how many numbers they have
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "box": {"size": 3},
    "mesh": {},
}
_NO_MOTION = {"transmission", "gazebo", "ros2_control", "sensor", "mujoco", "material", "link", "joint"}
_JOINT_PARTS = {
    "origin", "parent", "child", "axis", "calibration", "dynamics", "limit", "mimic", "safety_controller",
    "hardwareInterface", "command_interface", "state_interface",
}  # fmt: skip
_TYPES = ("revolute", "continuous", "prismatic", "planar", "floating", "fixed")
_WITH_AXIS = ("revolute", "continuous", "prismatic", "planar")
_LIMITS = ("lower", "upper", "velocity", "effort")
_ATTRIBUTES = {"axis": {"xyz"}, "limit": set(_LIMITS), "mimic": {"joint", "multiplier", "offset"}}
_UNEXPANDED = re.compile(r"\$\{|\$\(")


@dataclass(frozen=True, eq=False)
class UrdfFile:
    """A URDF file that has been read and checked.

    Attributes:
        path: The file.
        root: Its root element.
        dropped: One sentence for each kind of thing in it that a `pin.Model` cannot hold.
    """

    path: Path
    root: ET.Element
    dropped: tuple[str, ...]


def checked_urdf(path: Path, root: ET.Element | None = None) -> UrdfFile:
    """Read a URDF file, and raise an error where a loader would make another robot than it describes.

    Args:
        path: The file.
        root: Its root element, if it has been parsed already.

    Returns:
        The file with its root element.

    Raises:
        InvalidValue: The file is not a URDF, is unexpanded xacro, is not a tree, or a name, number, axis or
            limit is flawed; the message names the file and the element.
    """
    root = _parsed(path) if root is None else root
    links, joints = root.findall("link"), root.findall("joint")
    _refuse_xacro(path, root)
    if root.tag != "robot" or not links:
        way_out = "; read an MJCF file with Robot.from_mjcf" if root.tag == "mujoco" else ""
        raise InvalidValue(f"{path} is no URDF: it needs a root element <robot> with links in it{way_out}")
    link_names = names_of(str(path), links, "link")
    names_of(str(path), joints, "joint")
    _check_tree(path, link_names, joints)
    for joint in joints:
        _check_joint(f"{path}: joint '{joint.get('name')}'", joint)
    dropped = [
        sentence for link in links for sentence in _check_link(f"{path}: link '{link.get('name')}'", link)
    ]
    return UrdfFile(path, root, (*_dropped_of_joints(joints), *dropped, *_foreign(root)))


def _parsed(path: Path) -> ET.Element:
    """Parse a file; where it is no XML because of an unbound prefix of xacro, say so."""
    try:
        return parse(path)
    except InvalidValue:
        if "<xacro:" in path.read_text("utf-8", errors="replace"):
            raise _xacro(path, "an element <xacro:…>") from None
        raise


def _xacro(path: Path, found: str) -> InvalidValue:
    """Return the error for a file that is unexpanded xacro."""
    return InvalidValue(
        f"{path} is xacro that is not expanded: it holds {found}; read it with Robot.from_xacro(path), which "
        "expands it with the package xacrodoc, or expand it first with: xacro FILE -o FILE.urdf"
    )


def _refuse_xacro(path: Path, root: ET.Element) -> None:
    """Raise `InvalidValue` for a macro, or for an expression in a link or a joint."""
    for element in root.iter():
        space, _, tag = str(element.tag).rpartition("}")
        if "xacro" in space:
            raise _xacro(path, f"an element <xacro:{tag}>")
    for owner in (root, *root.findall("link"), *root.findall("joint")):
        for element in [owner] if owner is root else owner.iter():
            for text in (*element.attrib.values(), element.text or ""):
                if _UNEXPANDED.search(text):
                    raise _xacro(path, f"'{text.strip()}' in <{element.tag}>")


def _check_tree(path: Path, links: list[str], joints: list[ET.Element]) -> None:
    """Raise `InvalidValue` unless the joints connect all links to one tree."""
    parent_joint: dict[str, ET.Element] = {}
    children: dict[str, list[str]] = defaultdict(list)
    for joint in joints:
        name, (parent, child) = joint.get("name"), _ends(path, joint, links)
        if child in parent_joint:
            raise InvalidValue(
                f"{path}: link '{child}' has two parent joints, '{parent_joint[child].get('name')}' and "
                f"'{name}', so the file is no tree; end '{name}' at a link of its own, and close the loop "
                "with LoopTask"
            )
        parent_joint[child] = joint
        children[parent].append(child)
    roots = [link for link in links if link not in parent_joint]
    if len(roots) > 1:
        raise InvalidValue(
            f"{path} has {len(roots)} root links, {', '.join(roots[:8])}; connect them to one tree by joints"
        )
    reached, waiting = set(roots), list(roots)
    while waiting:
        waiting += children[waiting.pop()]
        reached.update(waiting)
    lost = [link for link in links if link not in reached]
    if lost:
        raise InvalidValue(f"{path} has a cycle through the links {', '.join(lost[:8])}; a URDF is a tree")


def _ends(path: Path, joint: ET.Element, links: list[str]) -> tuple[str, str]:
    """Return the parent link and the child link of a joint."""
    ends = []
    for tag in ("parent", "child"):
        found = joint.findall(tag)
        link = found[0].get("link", "") if len(found) == 1 else ""
        if link not in links:
            raise InvalidValue(
                f"{path}: joint '{joint.get('name')}' needs one <{tag} link=…> with the name of a link, got "
                + (f"'{link}'" if len(found) == 1 else f"{len(found)} elements")
            )
        ends.append(link)
    return ends[0], ends[1]


def _check_joint(where: str, joint: ET.Element) -> None:
    """Raise `InvalidValue` for a flawed type, origin, axis, limit, or number of a joint."""
    kind = joint.get("type")
    if kind not in _TYPES:
        raise InvalidValue(f"{where} has the type '{kind}'; a URDF has {', '.join(_TYPES)}")
    for tag in _JOINT_PARTS - {
        "parent",
        "child",
        "hardwareInterface",
        "command_interface",
        "state_interface",
    }:
        if len(joint.findall(tag)) > 1:
            raise InvalidValue(f"{where} has two elements <{tag}>; keep one")
    _check_origin(where, joint)
    stated = joint.find("axis")
    axis = [1.0, 0.0, 0.0] if stated is None else numbers(where, stated, "xyz", 3, None)
    if kind in _WITH_AXIS and not np.linalg.norm(axis) > 0.0:
        raise InvalidValue(f"{where} moves, and its axis is 0 0 0, which is no direction")
    if kind == "planar" and stated is not None and (axis[0] or axis[1]):
        raise InvalidValue(
            f"{where} is planar, and its <axis>, the normal of the plane, is '{stated.get('xyz')}'; it is "
            "read along z only: turn the joint with <origin rpy=…>"
        )
    if kind in ("revolute", "prismatic"):
        _check_range(where, joint)
    elif (limit := joint.find("limit")) is not None:
        for name in _LIMITS:
            number(where, limit, name, "0")
    _check_extras(where, joint)


def _check_extras(where: str, joint: ET.Element) -> None:
    """Raise `InvalidValue` for a flawed mimic, safety controller, or friction of a joint."""
    mimic, safety, dynamics = (joint.find(tag) for tag in ("mimic", "safety_controller", "dynamics"))
    if mimic is not None:
        if not mimic.get("joint"):
            raise InvalidValue(f"{where}: <mimic joint=…> is missing")
        number(where, mimic, "multiplier", "1")
        number(where, mimic, "offset", "0")
    if safety is not None:
        number(where, safety, "k_velocity")
        for name in ("k_position", "soft_lower_limit", "soft_upper_limit"):
            number(where, safety, name, "0")
    if dynamics is not None:
        if not {"damping", "friction"} & set(dynamics.attrib):
            raise InvalidValue(f"{where}: <dynamics> states neither damping nor friction; leave it out")
        for name in ("damping", "friction"):
            number(where, dynamics, name, "0")


def _check_range(where: str, joint: ET.Element) -> None:
    """Raise `InvalidValue` for a flawed limit of a joint that must have one."""
    limit = joint.find("limit")
    if limit is None:
        raise InvalidValue(
            f"{where} is {joint.get('type')} and has no <limit>; a joint without one is continuous"
        )
    lower, upper = number(where, limit, "lower", "0"), number(where, limit, "upper", "0")
    number(where, limit, "effort")
    if number(where, limit, "velocity") < 0.0:
        raise InvalidValue(f"{where}: <limit velocity=…> must be ≥ 0, got '{limit.get('velocity')}'")
    if lower > upper:
        raise InvalidValue(f"{where} has position limits {lower:g} to {upper:g}; lower must be ≤ upper")


def _check_origin(where: str, owner: ET.Element) -> None:
    """Raise `InvalidValue` for an origin that is no pose, or one that the loader would not read."""
    origin = owner.find("origin")
    if origin is None:
        return
    numbers(where, origin, "xyz", 3, "0 0 0")
    numbers(where, origin, "rpy", 3, "0 0 0")
    unread = set(origin.attrib) - {"xyz", "rpy"}
    if unread:
        raise InvalidValue(
            f'{where}: <origin {min(unread)}=…> would be ignored; state the orientation as rpy="… … …"'
        )


def _check_link(where: str, link: ET.Element) -> Iterator[str]:
    """Check inertia and shapes of a link; yield what is not read."""
    inertial = link.find("inertial")
    if inertial is not None:
        _check_origin(where, inertial)
        mass, inertia = inertial.find("mass"), inertial.find("inertia")
        if (mass is not None or inertia is not None) and number(where, mass, "value") < 0.0:
            raise InvalidValue(f"{where}: <mass value=…> must be ≥ 0")
        for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz") if inertia is not None else ():
            number(where, inertia, name, "0")
    for kind in ("visual", "collision"):
        for owner in link.findall(kind):
            _check_origin(where, owner)
            shapes = list(owner.iterfind("geometry/*"))
            for shape in shapes[:1]:
                _check_shape(where, shape)
            unread = [shape.tag for shape in shapes[:1] if shape.tag not in _SHAPES]
            unread += [shape.tag for shape in shapes[1:]]
            if unread or not shapes:
                what = ", ".join(f"<{tag}>" for tag in unread) or "no geometry"
                yield f"a {kind} of link '{link.get('name')}' has {what}, which is no shape of a URDF"


def _check_shape(where: str, shape: ET.Element) -> None:
    """Raise `InvalidValue` for a shape with a flawed size."""
    for name, count in _SHAPES.get(str(shape.tag), {}).items():
        if min(numbers(where, shape, name, count, None)) <= 0.0:
            raise InvalidValue(f"{where}: <{shape.tag} {name}=…> must be > 0, got '{shape.get(name)}'")
    if shape.tag == "mesh":
        if not shape.get("filename"):
            raise InvalidValue(f"{where}: <mesh filename=…> is missing")
        if 0.0 in numbers(where, shape, "scale", 3, "1 1 1"):
            raise InvalidValue(f"{where}: <mesh scale=…> must not be 0, got '{shape.get('scale')}'")


def _dropped_of_joints(joints: list[ET.Element]) -> Iterator[str]:
    """Yield a sentence for each statement on a joint that a model cannot represent, or that surprises."""
    said: dict[str, list[str]] = defaultdict(list)
    for joint in joints:
        name, kind = joint.get("name", ""), joint.get("type", "")
        for sentence in _surprises(joint, kind):
            said[sentence].append(name)
    for sentence, names in said.items():
        yield (f"joint {names[0]}" if len(names) == 1 else f"joints {', '.join(names)}") + sentence


def _surprises(joint: ET.Element, kind: str) -> Iterator[str]:
    """Yield sentences that go on after the name of the joint."""
    limit = joint.find("limit")
    stated = set() if limit is None else {key for key in _LIMITS if float(limit.get(key, "0")) != 0.0}
    if kind in ("revolute", "prismatic") and limit is not None:
        if not {"lower", "upper"} & set(limit.attrib):
            yield " cannot move: <limit> states no lower and no upper, and the range is then 0 to 0"
        if "velocity" not in stated:
            yield ": velocity 0 in <limit> is read as no velocity limit"
    if kind == "continuous" and stated & {"lower", "upper"}:
        yield ": lower and upper in <limit> are not held, since a continuous joint turns without end"
    if kind in ("planar", "floating") and stated - {"effort"}:
        yield ": <limit> is not held, since the joint has several axes"
    if kind in ("planar", "floating") and joint.find("mimic") is not None:
        yield ": <mimic> is not held, since the joint has several axes"
    if kind in ("revolute", "prismatic") and limit is not None and _is_softer(joint, limit):
        yield ": the soft limits of <safety_controller> are not held; the range is that of <limit>"
    if kind == "planar" and joint.find("axis") is None:
        yield ": no <axis> is stated; the plane is that of x and y of the joint"
    for part in joint:
        if part.tag not in _JOINT_PARTS:
            yield f": the element <{_local(part)}> is not read"
        for name in sorted(set(part.attrib) - _ATTRIBUTES.get(str(part.tag), set(part.attrib))):
            yield f": the attribute {name} of <{part.tag}> is not read"


def _is_softer(joint: ET.Element, limit: ET.Element) -> bool:
    """Return True if a safety controller states a narrower range than the limit of its joint."""
    safety = joint.find("safety_controller")
    if safety is None:
        return False
    where = f"joint '{joint.get('name')}'"
    soft = [number(where, safety, f"soft_{side}_limit", "0") for side in ("lower", "upper")]
    hard = [number(where, limit, side, "0") for side in ("lower", "upper")]
    return soft[0] < soft[1] and (soft[0] > hard[0] or soft[1] < hard[1])


def _local(element: ET.Element) -> str:
    """Return the tag of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]


def _foreign(root: ET.Element) -> Iterator[str]:
    """Yield a sentence for each element besides links and joints that would change the robot's motion."""
    count: dict[str, int] = defaultdict(int)
    for element in root:
        if isinstance(element.tag, str) and element.tag not in _NO_MOTION:
            count[_local(element)] += 1
    for tag, times in count.items():
        yield f"the element <{tag}> is not read" + (f" ({times} times)" if times > 1 else "")
    for owner in root.findall("gazebo"):
        for joint in owner.iter("joint"):
            if joint.get("name"):
                yield f"joint '{joint.get('name')}' of <gazebo> is not read; LoopTask closes a loop"
    coupled = {joint.get("name") for joint in root.findall("joint") if joint.find("mimic") is not None}
    elsewhere = [
        joint.get("name", "")
        for joint in root.iterfind("ros2_control/joint")
        if joint.get("name") not in coupled and any(p.get("name") == "mimic" for p in joint.iter("param"))
    ]
    if elsewhere:
        yield f"the couplings of {', '.join(elsewhere)} stand in <ros2_control> only, and are not held"
