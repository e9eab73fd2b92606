"""The files that `robot_files.py` damages, by kind, and how a file of each kind is read and judged.

The judges share no code with the readers: poses of a URDF come from its elements by matrices that are written
out here, poses of an MJCF file from MuJoCo's own kinematics.
"""

# MuJoCo ships no stubs.
# pyright: reportAttributeAccessIssue=false

import struct
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from taskopt import Array, Configuration, Robot
from taskopt.arrays import ArrayLike

_SPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
ET.register_namespace("xacro", "http://www.ros.org/wiki/xacro")
_LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="1"/>'
_TETRAHEDRON = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
_CORNERS = ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1))
_FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes:
        name: Its name.
        files: Whole files: the ending of each and its content.
        read: Reads the file of a path, and returns the robot.
        farthest: Returns by how much the robot differs from what the file says: poses in m and of rotations.
    """

    name: str
    files: tuple[tuple[str, bytes], ...]
    read: Callable[[Path], Robot]
    farthest: Callable[[Path, Robot], float]


def kinds() -> tuple[Kind, ...]:
    """Return all kinds of files."""
    return (
        Kind("URDF", ((".urdf", _urdf().encode()),), _read_urdf, _far_from_urdf),
        Kind("SRDF", ((".srdf", _SRDF.encode()),), _read_srdf, _far_from_srdf),
        Kind("xacro", ((".xacro", _XACRO.encode()),), Robot.from_xacro, _far_from_xacro),
        Kind("MJCF", ((".xml", _MJCF.encode()),), Robot.from_mjcf, _far_from_mjcf),
        Kind("mesh", tuple(_meshes()), _read_mesh, _far_from_mesh),
    )


def _joint(name: str, kind: str, parent: str, child: str, inner: str = "") -> str:
    """Return a joint whose origin and axis, but for the normal of a plane, are no multiples of anything."""
    axis = "0 0 1" if kind == "planar" else "0.6 0 0.8"
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0.1 -0.2 0.3" rpy="0.4 0.5 -0.6"/><axis xyz="{axis}"/>{inner}</joint>'
    )


def _urdf() -> str:
    """Return a robot with a joint of each type, a mimic joint, and shapes."""
    shape = '<collision><origin xyz="0 0 0.1"/><geometry><sphere radius="0.05"/></geometry></collision>'
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    links = "".join(f'<link name="{name}">{mass}{shape}</link>' for name in "abcdefgh")
    mimic = _LIMIT + '<mimic joint="turn" multiplier="-0.5" offset="0.1"/>'
    return (
        f'<robot name="arm">{links}{_joint("turn", "revolute", "a", "b", _LIMIT)}'
        f"{_joint('slide', 'prismatic', 'b', 'c', _LIMIT)}{_joint('wheel', 'continuous', 'c', 'd')}"
        f"{_joint('weld', 'fixed', 'd', 'e')}{_joint('follow', 'revolute', 'e', 'f', mimic)}"
        f"{_joint('plane', 'planar', 'c', 'g')}{_joint('fly', 'floating', 'c', 'h')}</robot>"
    )


_SRDF = """<robot name="arm"><group name="arm"><joint name="turn"/></group>
<group_state name="home" group="arm"><joint name="turn" value="0.5"/><joint name="slide" value="0.1"/>
<joint name="wheel" value="1.0"/></group_state>
<group_state name="away" group="arm"><joint name="turn" value="1.0"/><joint name="slide" value="1e-1"/>
</group_state>
<disable_collisions link1="a" link2="b" reason="Adjacent"/></robot>"""

_XACRO = f"""<robot name="arm" {_SPACE}><xacro:arg name="long" default="true"/>
<xacro:property name="size" value="0.3"/>
<xacro:macro name="segment" params="name parent upper:=1.5"><link name="${{name}}_link"/>
<joint name="${{name}}" type="revolute"><parent link="${{parent}}"/><child link="${{name}}_link"/>
<origin xyz="0 ${{size * 2}} 0" rpy="0 0 ${{pi / 3}}"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="${{upper * 2}}" velocity="1" effort="1"/></joint></xacro:macro>
<link name="base"/><xacro:segment name="pan" parent="base" upper="1"/>
<xacro:if value="$(arg long)"><xacro:segment name="tilt" parent="pan_link"/></xacro:if></robot>"""

_BALL = '<geom size="0.05" mass="1"/>'
_MJCF = f"""<mujoco><compiler angle="degree"/><default><joint axis="1 0 0"/></default><worldbody>
<body name="cart" pos="0.1 0.2 0.3" euler="10 20 30"><joint name="along" type="slide" ref="0.2" range="-1 2"/>
<joint name="swing" pos="0.1 0 0.2" axis="0 1 3" ref="30" range="-90 90"/>{_BALL}
<body name="arm" pos="0 0 0.5" axisangle="0 0 1 45"><joint name="elbow" axis="0 1 0"/>{_BALL}
<frame pos="0 0 0.1"><body name="wrist"><joint name="wrist" type="ball" pos="0 0.05 0"/>{_BALL}</body></frame>
<body name="finger"><joint name="finger" axis="0 0 1"/>{_BALL}</body></body></body>
<body name="free" pos="1 2 3"><freejoint/>{_BALL}</body></worldbody>
<equality><joint joint1="finger" joint2="elbow" polycoef="0.1 2 0 0 0"/></equality></mujoco>"""


def _meshes() -> Iterator[tuple[str, bytes]]:
    """Yield a tetrahedron as OBJ, as STL in text and as STL in bytes."""
    yield ".obj", _TETRAHEDRON.encode()
    facets = "".join(
        "facet normal 0 0 1\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*_CORNERS[i]) for i in face)
        + "endloop\nendfacet\n"
        for face in _FACES
    )
    yield ".stl", f"solid a\n{facets}endsolid a\n".encode()
    body = b"".join(
        struct.pack("<12fH", 0, 0, 1, *(x for i in face for x in _CORNERS[i]), 0) for face in _FACES
    )
    yield ".stl", bytes(80) + struct.pack("<I", len(_FACES)) + body


def _read_urdf(path: Path) -> Robot:
    return Robot.from_urdf(path, meshes=False)


def _read_srdf(path: Path) -> Robot:
    arm = path.with_name("whole.urdf")
    arm.write_text(_urdf(), encoding="utf-8")
    robot = Robot.from_urdf(arm, srdf=path)
    _ = robot.geometry
    return robot


def _read_mesh(path: Path) -> Robot:
    shape = f'<geometry><mesh filename="{path.name}"/></geometry>'
    link = f'<link name="b"><collision>{shape}</collision><visual>{shape}</visual></link>'
    arm = path.with_name("meshed.urdf")
    arm.write_text(
        f'<robot name="arm"><link name="a"/>{link}{_joint("turn", "continuous", "a", "b")}</robot>'
    )
    robot = Robot.from_urdf(arm)
    _ = robot.geometry, robot.visual
    return robot


def _far_from_urdf(path: Path, robot: Robot) -> float:
    return _far_from_tree(ET.parse(path).getroot(), robot)


def _far_from_xacro(path: Path, robot: Robot) -> float:
    import xacro

    return _far_from_tree(ET.fromstring(xacro.process_file(str(path)).toxml()), robot)  # type: ignore[union-attr]


def _far_from_srdf(path: Path, robot: Robot) -> float:
    """Return how far the named postures are from the values of the file."""
    worst = 0.0
    for state in ET.parse(path).getroot().findall("group_state"):
        q = robot.postures.get(state.get("name", ""))
        for joint in state.findall("joint"):
            name = joint.get("name", "")
            if q is not None and name in ("turn", "slide"):
                at = robot.model.idx_qs[robot.joint_id(name)]
                worst = max(worst, abs(q[at] - float(joint.get("value", "nan"))))
    return float(worst)


def _far_from_mesh(path: Path, robot: Robot) -> float:  # noqa: ARG001
    """Return 0 if all shapes have a finite size."""
    shapes = [*robot.geometry.geometryObjects, *robot.visual.geometryObjects]
    return 0.0 if shapes and all(np.isfinite(shape.geometry.aabb_radius) for shape in shapes) else np.inf


def _far_from_tree(root: ET.Element, robot: Robot) -> float:
    """Return how far links are from where the elements of a URDF put them, at a random configuration."""
    rng = np.random.default_rng(0)
    q = robot.coupled(robot.integrate(robot.neutral, rng.uniform(-0.5, 0.5, robot.nv), 1.0))
    at, joints = Configuration(robot, q), {j.find("child").get("link"): j for j in root.findall("joint")}  # type: ignore[union-attr]
    poses: dict[str, Array] = {}

    def pose(link: str) -> Array:
        if link not in poses:
            joint = joints.get(link)
            inner = np.eye(4) if joint is None else _motion(joint, robot, q)
            poses[link] = inner if joint is None else pose(joint.find("parent").get("link")) @ inner  # type: ignore[union-attr]
        return poses[link]

    names = [link.get("name", "") for link in root.findall("link")]
    return max(float(np.abs(at.pose(name) - pose(name)).max()) for name in names)


def _motion(joint: ET.Element, robot: Robot, q: Array) -> Array:
    """Return the pose (4, 4) of a joint's child in its parent."""
    origin, axis_element = joint.find("origin"), joint.find("axis")
    xyz, rpy = (
        [float(x) for x in ("0 0 0" if origin is None else origin.get(k, "0 0 0")).split()]
        for k in ("xyz", "rpy")
    )
    place = _transform(_about(2, rpy[2]) @ _about(1, rpy[1]) @ _about(0, rpy[0]), xyz)
    kind, name = joint.get("type"), joint.get("name", "")
    if kind == "fixed":
        return place
    text = "1 0 0" if axis_element is None else axis_element.get("xyz", "1 0 0")
    axis = np.array([float(x) for x in text.split()])
    axis /= np.linalg.norm(axis) or 1.0
    if name not in robot.joints:  # it follows a joint that does not move
        mimic = joint.find("mimic")
        return place @ _step(kind, axis, np.array([float(mimic.get("offset", "0"))]))  # type: ignore[union-attr]
    first = robot.model.idx_qs[robot.joint_id(name)]
    return place @ _step(kind, axis, q[first:])


def _step(kind: str | None, axis: Array, q: Array) -> Array:
    """Return the motion (4, 4) of a joint whose coordinates are the first of q."""
    if kind == "prismatic":
        return _transform(np.eye(3), q[0] * axis)
    if kind == "planar":
        return _transform(_turn(np.array([0.0, 0.0, 1.0]), np.arctan2(q[3], q[2])), [q[0], q[1], 0.0])
    if kind == "floating":
        x, y, z, w = q[3:7]
        s = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return _transform(np.eye(3) + 2 * w * s + 2 * s @ s, q[:3])
    return _transform(
        _turn(axis, float(np.arctan2(q[1], q[0])) if kind == "continuous" and q.size > 1 else q[0]), [0, 0, 0]
    )


def _transform(turn: Array, at: ArrayLike) -> Array:
    """Return a pose (4, 4)."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn, at
    return out


def _about(k: int, angle: float) -> Array:
    """Return the rotation about the k-th axis."""
    return _turn(np.eye(3)[k], angle)


def _turn(axis: Array, angle: float) -> Array:
    """Return the rotation about a unit axis."""
    x, y, z = axis
    s = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * s + (1.0 - np.cos(angle)) * s @ s


def _far_from_mjcf(path: Path, robot: Robot) -> float:
    """Return how far bodies are from where MuJoCo puts them."""
    import mujoco

    compiled = mujoco.MjModel.from_xml_path(str(path))
    data, rng = mujoco.MjData(compiled), np.random.default_rng(0)
    q = robot.coupled(robot.integrate(robot.neutral, rng.uniform(-0.5, 0.5, robot.nv), 1.0))
    at = Configuration(robot, q)
    for j in range(compiled.njnt):
        first, name = int(compiled.jnt_qposadr[j]), _joint_name(compiled, j)
        if name not in robot.joints:  # held by an equality: a constant over its reference
            held = [
                e for e in range(compiled.neq) if compiled.eq_obj1id[e] == j and compiled.eq_obj2id[e] < 0
            ]
            data.qpos[first] = compiled.qpos0[first] + compiled.eq_data[held[0]][0]
            continue
        joint = robot.model.joints[robot.joint_id(name)]
        part = np.array(q[joint.idx_q : joint.idx_q + joint.nq])
        if joint.nq in (4, 7):
            part[-4:] = np.roll(part[-4:], 1)
        data.qpos[first : first + joint.nq] = part
    mujoco.mj_kinematics(compiled, data)
    worst = 0.0
    for b in range(1, compiled.nbody):
        pose = at.pose(compiled.body(b).name or f"body{b}")
        worst = max(worst, np.abs(pose[:3, 3] - data.xpos[b]).max())
        worst = max(worst, np.abs(pose[:3, :3] - data.xmat[b].reshape(3, 3)).max())
    return float(worst)


def _joint_name(compiled: object, j: int) -> str:
    """Return the name of a joint, as the reader names one without a name after its body."""
    name = compiled.joint(j).name  # type: ignore[union-attr]
    if name:
        return name
    body = int(compiled.jnt_bodyid[j])  # type: ignore[union-attr]
    return f"{compiled.body(body).name or f'body{body}'}_joint"  # type: ignore[union-attr]


def quiet(read: Callable[[Path], Robot], path: Path) -> Robot:
    """Read a file without the warning of what is dropped.

    Args:
        read: Reads the file.
        path: The file.

    Returns:
        The robot.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return read(path)
