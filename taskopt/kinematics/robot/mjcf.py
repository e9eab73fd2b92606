"""Reading MJCF files, the format of MuJoCo.

MuJoCo itself compiles the file, so that includes, defaults, attachments, replicas, references and units are
resolved by the program that defines them. The tree is then built from the compiled numbers, body by body.
Pinocchio's own reader is not used, since it ignores includes and all trees of a file except the first, for
example. Coordinates are those of MuJoCo's `qpos` in the same order, except that a quaternion is (w, x, y, z)
in `qpos` and (x, y, z, w) in a `pin.Model`.
"""

# Pinocchio, Coal and MuJoCo ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pinocchio as pin
from typing_extensions import TypeAliasType

from taskopt.arrays import Array
from taskopt.errors import InvalidValue, MissingFile, NotInstalled
from taskopt.kinematics.engine import JointModel
from taskopt.kinematics.robot.couplings import Coupling, chained, narrow_leaders
from taskopt.kinematics.robot.dropped import warn_of_dropped
from taskopt.kinematics.robot.mjcf_shapes import shapes_of
from taskopt.kinematics.robot.parts import ALWAYS, Parts
from taskopt.kinematics.robot.xml_file import existing, parse

Compiled = TypeAliasType("Compiled", Any)
"""`mujoco.MjModel`: a compiled MJCF file."""

_NO_SPEED = (
    "an MJCF file states no velocity limits and no acceleration limits, so the robot has none; "
    "robot.with_limits(velocity={joint: …}, acceleration={joint: …}) sets them"
)


def read_mjcf(path: str | Path) -> Parts:
    """Read the parts of a robot from an MJCF file.

    Args:
        path: The MJCF file.

    Returns:
        The parts: joints with the names, ranges and coordinates of the file; bodies and sites as frames;
        keyframes and MuJoCo's own "qpos0" as postures; linear couplings of joints.

    Raises:
        MissingFile: The file, or one that it refers to, is not there.
        NotInstalled: The package mujoco, which compiles the file, is not installed.
        InvalidValue: The file is not MJCF, MuJoCo cannot compile it, or it has no movable joint.

    Warns:
        DroppedWarning: The file states something that the robot lacks.
    """
    file = existing(path, "MJCF")
    compiled, said = _compiled(file, _mujoco())
    if compiled.nq == 0:
        raise InvalidValue(f"{file} has no joint that moves")
    tree = _Tree(compiled)
    couplings, held, unread = _equalities(compiled, tree)
    couplings = chained(file, couplings)
    beyond = narrow_leaders(tree.model, couplings)
    postures, unusual = _postures(compiled, tree)
    dropped = (*_lost(compiled, tree), *unread, *beyond, *unusual, *said, _NO_SPEED)
    parts = Parts(
        tree.model,
        partial(shapes_of, compiled, tree.joints, tree.offsets, collision=True),
        partial(shapes_of, compiled, tree.joints, tree.offsets, collision=False),
        file.stem,
        postures,
        couplings,
        dropped,
    )
    warn_of_dropped(file, dropped)
    return _held(parts, held)


def _mujoco() -> ModuleType:
    """Import MuJoCo; raise `NotInstalled` if it is not there."""
    try:
        import mujoco
    except ImportError as error:
        raise NotInstalled("the package mujoco, which compiles MJCF files,", "'taskopt[mujoco]'") from error
    return mujoco


def _compiled(path: Path, mujoco: ModuleType) -> tuple[Compiled, list[str]]:
    """Compile a file; return it with what MuJoCo warns of, which it would else write to a file of its own."""
    root = parse(path)
    if root.tag != "mujoco":
        way_out = "; read a URDF with Robot.from_urdf" if root.tag == "robot" else ""
        raise InvalidValue(f"{path} is no MJCF: its root element is <{root.tag}>, not <mujoco>{way_out}")
    said: list[str] = []
    handler = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: said.append(f"MuJoCo warns: {text}"))
    try:
        return mujoco.MjModel.from_xml_path(str(path)), said
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        if "rror opening file" in reason or "could not open" in reason.lower():
            raise MissingFile(f"a file that {path} refers to is not there: {reason}") from error
        raise InvalidValue(f"{path} is no MJCF that MuJoCo can compile: {reason}") from error
    finally:
        mujoco.set_mju_user_warning(handler)


class _Tree:
    """The kinematic tree of a compiled file.

    Args:
        compiled: The compiled file.

    Attributes:
        model: The tree.
        joints: Index of the joint of the tree that carries each body.
        offsets: Pose of each body in that joint.
        names: Name of each joint of the file.
    """

    def __init__(self, compiled: Compiled) -> None:
        self.model = pin.Model()
        self.joints: list[int] = [0]
        self.offsets: list[pin.SE3] = [pin.SE3.Identity()]
        self._compiled, self.names = compiled, _joint_names(compiled)
        for body in range(1, compiled.nbody):
            self._add_body(body)
        for site in range(compiled.nsite):
            self._add_frame(
                compiled.site(site).name, compiled.site_bodyid[site], _pose(compiled, "site", site)
            )

    def posture(self, qpos: Array) -> Array:
        """Convert a `qpos` of MuJoCo to a configuration (nq,) [rad, m] of the tree."""
        q = np.array(qpos)
        for joint in self.model.joints[1:]:
            if joint.nq in (4, 7):
                part = slice(joint.idx_q + joint.nq - 4, joint.idx_q + joint.nq)
                q[part] = np.roll(q[part], -1)
        return q

    def _add_body(self, body: int) -> None:
        """Add a body with its joints, its inertia and its frame."""
        c, parent = self._compiled, int(self._compiled.body_parentid[body])
        joint, offset = self.joints[parent], self.offsets[parent] * _pose(c, "body", body)
        first = int(c.body_jntadr[body])
        for j in range(first, first + int(c.body_jntnum[body])):
            joint, offset = self._add_joint(j, joint, offset)
        self.joints.append(joint)
        self.offsets.append(offset)
        if joint and c.body_mass[body] > 0.0:
            self.model.appendBodyToJoint(joint, _inertia(c, body), offset)
        self._add_frame(c.body(body).name or f"body{body}", body, pin.SE3.Identity())

    def _add_joint(self, j: int, parent: int, offset: pin.SE3) -> tuple[int, pin.SE3]:
        """Add a joint whose body is at `offset` in the parent; return its index and the body's pose in it."""
        c, kind = self._compiled, int(self._compiled.jnt_type[j])
        anchor = pin.SE3(np.eye(3), np.array(c.jnt_pos[j]))
        limited, (lower, upper) = bool(c.jnt_limited[j]) and kind >= _SLIDE, c.jnt_range[j]
        model, place = self._kind(j, kind, offset * anchor)
        joint = self.model.addJoint(parent, model, place, self.names[j])
        self.model.addJointFrame(joint, self._frame_of(parent))
        where = self.model.joints[joint].idx_q
        if kind >= _SLIDE:
            self.model.lowerPositionLimit[where] = lower if limited else -np.inf
            self.model.upperPositionLimit[where] = upper if limited else np.inf
        columns = slice(self.model.joints[joint].idx_v, self.model.nv)
        self.model.upperVelocityLimit[columns], self.model.lowerVelocityLimit[columns] = np.inf, -np.inf
        return joint, pin.SE3.Identity() if kind == _FREE else anchor.inverse()

    def _kind(self, j: int, kind: int, place: pin.SE3) -> tuple[JointModel, pin.SE3]:
        """Return the model of a joint, and its pose in the parent moved back by its reference value."""
        axis = np.array(self._compiled.jnt_axis[j])
        start = float(self._compiled.qpos0[self._compiled.jnt_qposadr[j]])
        if kind == _FREE:  # its qpos is the pose of the body in the world
            return pin.JointModelFreeFlyer(), pin.SE3.Identity()
        if kind == _BALL:
            return pin.JointModelSpherical(), place
        if kind == _SLIDE:
            return pin.JointModelPrismaticUnaligned(axis), place * pin.SE3(np.eye(3), -start * axis)
        return pin.JointModelRevoluteUnaligned(axis), place * pin.SE3(pin.exp3(-start * axis), np.zeros(3))

    def _add_frame(self, name: str, body: int, inner: pin.SE3) -> None:
        """Add a frame that is fixed to a body, unless a body or site of that name is there already."""
        joint = self.joints[body]
        if name and not self.model.existFrame(name, pin.FrameType.BODY):
            place = self.offsets[body] * inner
            self.model.addFrame(pin.Frame(name, joint, self._frame_of(joint), place, pin.FrameType.BODY))

    def _frame_of(self, joint: int) -> int:
        """Return the index of the frame of a joint."""
        return self.model.getFrameId(self.model.names[joint], pin.FrameType.JOINT) if joint else 0


_FREE, _BALL, _SLIDE = 0, 1, 2  # mujoco.mjtJoint; 3 is a hinge
_CONNECT, _WELD, _JOINT = 0, 1, 2  # mujoco.mjtEq; others couple tendons and flexible bodies


def _joint_names(compiled: Compiled) -> list[str]:
    """Name the joints; one without a name is named after its body."""
    names = [compiled.joint(j).name for j in range(compiled.njnt)]
    taken = Counter(names)
    for j, name in enumerate(names):
        if not name:
            body = int(compiled.jnt_bodyid[j])
            own = f"{compiled.body(body).name or f'body{body}'}_joint"
            names[j] = own if not taken[own] else f"{own}{j}"
            taken[names[j]] += 1
    return names


def _pose(compiled: Compiled, kind: str, index: int) -> pin.SE3:
    """Return the pose of a body or site in its parent body, with a quaternion (w, x, y, z)."""
    w, x, y, z = getattr(compiled, f"{kind}_quat")[index]
    return pin.SE3(
        pin.Quaternion(w, x, y, z).normalized().matrix(), np.array(getattr(compiled, f"{kind}_pos")[index])
    )


def _inertia(compiled: Compiled, body: int) -> pin.Inertia:
    """Return the inertia of a body in its own frame."""
    w, x, y, z = compiled.body_iquat[body]
    turn = pin.Quaternion(w, x, y, z).normalized().matrix()
    about_centre = turn @ np.diag(compiled.body_inertia[body]) @ turn.T
    return pin.Inertia(float(compiled.body_mass[body]), np.array(compiled.body_ipos[body]), about_centre)


def _postures(compiled: Compiled, tree: _Tree) -> tuple[dict[str, Array], list[str]]:
    """Return the postures by name, and sentences on keyframes that are not as one would expect."""
    postures: dict[str, Array] = {}
    unusual: list[str] = []
    lower, upper = tree.model.lowerPositionLimit, tree.model.upperPositionLimit
    for name, qpos in _keyframes(compiled):
        q, own = tree.posture(qpos), name
        if name in ALWAYS:
            own = f"keyframe {name}"
            unusual.append(f"the keyframe '{name}' is the posture '{own}', since every robot has a '{name}'")
        if name != "qpos0" and ((q < lower) | (q > upper)).any():
            unusual.append(f"the keyframe '{name}' is outside the ranges of the joints")
        postures[own] = q
    return postures, unusual


def _keyframes(compiled: Compiled) -> Iterator[tuple[str, Array]]:
    """Yield the name and `qpos` of MuJoCo's reference configuration and of each keyframe."""
    yield "qpos0", compiled.qpos0
    for k in range(compiled.nkey):
        yield compiled.key(k).name or f"key{k}", compiled.key_qpos[k]


def _equalities(compiled: Compiled, tree: _Tree) -> tuple[list[Coupling], dict[str, float], list[str]]:
    """Read the active equalities: linear couplings, joints held at a value, and sentences on all others."""
    couplings: dict[str, Coupling] = {}
    held: dict[str, float] = {}
    unread: Counter[str] = Counter()
    for e in np.flatnonzero(compiled.eq_active0):
        kind, one, two = int(compiled.eq_type[e]), int(compiled.eq_obj1id[e]), int(compiled.eq_obj2id[e])
        if kind != _JOINT:
            closes = kind in (_CONNECT, _WELD)
            unread["a loop of bodies (<connect>, <weld>) is not held; LoopTask closes it" if closes else
                   "an equality of tendons or flexible bodies is not held"] += 1  # fmt: skip
            continue
        follower, factors = tree.names[one], compiled.eq_data[e][:5]
        start = float(compiled.qpos0[compiled.jnt_qposadr[one]])
        if follower in couplings or follower in held or (two >= 0 and factors[2:].any()):
            unread[f"joint {follower} follows a polynomial, or two joints, which is not held"] += 1
        elif two < 0:
            held[follower] = start + float(factors[0])
        else:
            offset = start + factors[0] - factors[1] * compiled.qpos0[compiled.jnt_qposadr[two]]
            couplings[follower] = Coupling(
                follower, tree.names[two], multiplier=float(factors[1]), offset=float(offset)
            )
    return list(couplings.values()), held, [f"{s} ({n} times)" if n > 1 else s for s, n in unread.items()]


def _held(parts: Parts, held: dict[str, float]) -> Parts:
    """Lock the joints that an equality holds at a value."""
    q, ids = pin.neutral(parts.model), [parts.model.getJointId(name) for name in held]
    for i, value in zip(ids, held.values(), strict=True):
        q[parts.model.joints[i].idx_q] = value
    return parts.locked(ids, q) if ids else parts


def _lost(compiled: Compiled, tree: _Tree) -> Iterator[str]:
    """Yield a sentence for each statement of the file that the tree cannot represent."""
    balls = [
        tree.names[j]
        for j in range(compiled.njnt)
        if compiled.jnt_limited[j] and compiled.jnt_type[j] in (_BALL, _FREE)
    ]
    if balls:
        yield f"the range of {', '.join(balls)} is not held, since the joint has several axes"
    mocap = [
        compiled.body(b).name or f"body{b}" for b in np.flatnonzero(np.asarray(compiled.body_mocapid) >= 0)
    ]
    if mocap:
        yield f"{', '.join(mocap)}, which MuJoCo can move from outside, are fixed where the file places them"
    if compiled.nflex:
        yield "flexible bodies are not read"
    if (compiled.geom_bodyid[: compiled.ngeom] == 0).any():
        yield "shapes of the world, such as a floor, are no part of the robot; give them as obstacles"
