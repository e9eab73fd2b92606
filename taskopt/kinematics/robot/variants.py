"""Parts of a robot with a change: one more frame, tighter limits, or pairs of links that are not checked."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array, ArrayLike, finite, number, require_mapping
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.engine import GeometryModel, JointModel, Model
from taskopt.kinematics.robot.joints import joint_table, velocity_slice
from taskopt.kinematics.robot.parts import Lazy, Parts, Shapes, link_of, loaded


@dataclass(frozen=True)
class TighterLimits:
    """Limits that replace wider limits of a robot.

    Attributes:
        position: q_min and q_max of joints [rad, m], by name.
        velocity: v_max of joints [rad/s, m/s], by name.
        acceleration: a_max of joints [rad/s², m/s²], by name.
        margin: Amount by which both ends of the ranges move inwards [rad, m], for all joints or by name of
            joint.
    """

    position: Mapping[str, tuple[float, float]]
    velocity: Mapping[str, float]
    acceleration: Mapping[str, float]
    margin: float | Mapping[str, float]


def with_frame(parts: Parts, name: str, parent: int, pose: Array) -> Parts:
    """Add a frame.

    Args:
        parts: Parts of a robot.
        name: Name of the new frame.
        parent: Pinocchio's index of the frame to which it is fixed.
        pose: Pose (4, 4) in the parent [m].

    Returns:
        Parts whose tree has the frame; their shapes are the same.

    Raises:
        InvalidValue: The name is empty, or no text.
    """
    if not isinstance(name, str) or not name:
        raise InvalidValue(f"a frame needs a name, got {name!r}")
    model = pin.Model(parts.model)
    frame = model.frames[parent]
    place = frame.placement * pin.SE3(pose[:3, :3], pose[:3, 3])
    model.addFrame(pin.Frame(name, frame.parentJoint, parent, place, pin.FrameType.OP_FRAME), False)
    return replace(parts, model=model)


def with_limits(parts: Parts, limits: TighterLimits) -> Parts:
    """Tighten limits of joints.

    Args:
        parts: Parts of a robot.
        limits: The new limits.

    Returns:
        Parts with the limits; postures are moved into the ranges.

    Raises:
        UnknownName: There is no joint of that name.
        InvalidValue: A limit is wider than the present one, no range is left, or the joint has no single
            coordinate that could have a limit.
    """
    _check_mappings(limits)
    model = pin.Model(parts.model)
    for name, ends in limits.position.items():
        lower, upper = finite(f"the range (q_min, q_max) of {name}", ends, (2,))
        _narrow(model, _joint(model, name), name, float(lower), float(upper))
    for name, margin in _margins(model, limits.margin).items():
        joint = _joint(model, name)
        place = joint.idx_q
        lower, upper = model.lowerPositionLimit[place], model.upperPositionLimit[place]
        if not margin >= 0.0:
            raise InvalidValue(f"the margin of {name} must be ≥ 0, got {margin:g}")
        _narrow(model, joint, name, float(lower) + margin, float(upper) - margin)
    present = joint_table(parts.model).velocity_limit
    for name, fastest in limits.velocity.items():
        joint = _joint(model, name, single=False)
        columns = velocity_slice(joint)
        way_out = "for a wider one make a Robot of a changed pin.Model"
        most = _tighter(f"velocity limit of {name}", fastest, float(present[columns].min()), way_out)
        model.upperVelocityLimit[columns], model.lowerVelocityLimit[columns] = most, -most
    acceleration = dict(parts.acceleration)
    for name, strongest in limits.acceleration.items():
        _joint(model, name, single=False)
        before, way_out = acceleration.get(name, np.inf), "a wider one is given to the original robot"
        acceleration[name] = _tighter(f"acceleration limit of {name}", strongest, before, way_out)
    postures = {name: _inside(model, q) for name, q in parts.postures.items()}
    return replace(parts, model=model, postures=postures, acceleration=acceleration)


def _check_mappings(limits: TighterLimits) -> None:
    """Raise `InvalidValue` unless limits are given by name of joint."""
    require_mapping("position", limits.position, '{"elbow": (-1.0, 1.0)}')
    require_mapping("velocity", limits.velocity, '{"elbow": 0.5}')
    require_mapping("acceleration", limits.acceleration, '{"elbow": 2.0}')


def without_collision(parts: Parts, pairs: frozenset[frozenset[str]]) -> Parts:
    """Leave out pairs of links, which are then never checked for collision.

    Args:
        parts: Parts of a robot.
        pairs: Sets of two names of links, or of one name, which leaves out all pairs of that link.

    Returns:
        Parts whose shapes, when they are loaded, lack these pairs.
    """
    return replace(parts, geometry=Lazy(_without_pairs, parts.geometry, pairs))


def _without_pairs(shapes: Shapes, pairs: frozenset[frozenset[str]]) -> GeometryModel:
    """Load shapes, and leave out pairs of links."""
    out = pin.GeometryModel(loaded(shapes))
    if len(out.collisionPairs) == 0:
        out.addAllCollisionPairs()
    names = [link_of(shape.name) for shape in out.geometryObjects]
    # As numbers, because the pairs themselves are references that shift when one is removed.
    for i, j in [(int(pair.first), int(pair.second)) for pair in out.collisionPairs]:
        links = frozenset((names[i], names[j]))
        if links in pairs or any(frozenset((link,)) in pairs for link in links):
            out.removeCollisionPair(pin.CollisionPair(i, j))
    return out


def _joint(model: Model, name: str, *, single: bool = True) -> JointModel:
    """Return a joint by name; raise an error if there is none, or if it has no single coordinate."""
    if not model.existJointName(name):
        raise UnknownName("joint", name, list(model.names)[1:])
    joint = model.joints[model.getJointId(name)]
    if single and (joint.nq, joint.nv) != (1, 1):
        raise InvalidValue(
            f"{name} is a {joint.shortname()} with {joint.nq} coordinates, and cannot have one range"
        )
    return joint


def _margins(model: Model, margin: float | Mapping[str, float]) -> dict[str, float]:
    """Return the margin of each joint that gets one: the named joints, or all joints with a finite range."""
    if isinstance(margin, Mapping):
        return {name: float(number) for name, number in margin.items()}
    if margin == 0.0:
        return {}
    table, joints = joint_table(model), list(zip(model.names, model.joints, strict=True))[1:]
    limited = np.isfinite(table.position_lower) | np.isfinite(table.position_upper)
    return {name: float(margin) for name, joint in joints if joint.nv == 1 and limited[joint.idx_v]}


def _narrow(model: Model, joint: JointModel, name: str, lower: float, upper: float) -> None:
    """Write a range that lies inside the present one; raise `InvalidValue` if it does not."""
    place = joint.idx_q
    least, most = float(model.lowerPositionLimit[place]), float(model.upperPositionLimit[place])
    if not least <= lower <= upper <= most:
        raise InvalidValue(
            f"the range of {name} must lie inside {least:g} to {most:g}, the present one, and not be empty, "
            f"got {lower:g} to {upper:g}; for a wider one make a Robot of a changed pin.Model"
        )
    model.lowerPositionLimit[place], model.upperPositionLimit[place] = lower, upper


def _tighter(what: str, limit: ArrayLike, present: float, way_out: str) -> float:
    """Return a limit that is > 0 and at most the present one; raise `InvalidValue` if it is not."""
    out = float(number(f"the {what}", limit, ()))
    if not 0.0 < out <= present:
        most = f"at most {present:g}, the present one" if np.isfinite(present) else "a number"
        raise InvalidValue(f"the {what} must be > 0 and {most}, got {out:g}; {way_out}")
    return out


def _inside(model: Model, q: Array) -> Array:
    """Move a posture (nq,) into the ranges of the joints that have one coordinate."""
    out = q.copy()
    places = [joint.idx_q for joint in list(model.joints)[1:] if joint.nq == joint.nv == 1]
    out[places] = np.clip(out[places], model.lowerPositionLimit[places], model.upperPositionLimit[places])
    return out
