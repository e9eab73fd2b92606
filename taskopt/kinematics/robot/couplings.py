"""Couplings of joints, which a URDF file states as <mimic> and an MJCF file as <equality><joint>."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, finite
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.engine import Model


@dataclass(frozen=True)
class Coupling:
    """A joint that follows another: q_follower = multiplier · q_leader + offset.

    Attributes:
        follower: Name of the joint that follows.
        leader: Name of the joint that leads.
        multiplier: Factor, in the unit of the follower divided by that of the leader [rad or m].
        offset: Coordinate of the follower where that of the leader is 0 [rad or m].
    """

    follower: str
    leader: str
    multiplier: float = field(default=1.0, kw_only=True)
    offset: float = field(default=0.0, kw_only=True)


def chained(path: object, couplings: Iterable[Coupling]) -> tuple[Coupling, ...]:
    """Rewrite couplings so that every leader is a joint that follows no other.

    If q = m p + o and p = n r + s, then q = (m n) r + (m s + o).

    Args:
        path: The file, for messages.
        couplings: Couplings as the file states them.

    Returns:
        Couplings whose leaders follow no joint, in the same order.

    Raises:
        InvalidValue: A joint follows itself, directly or through others.
    """
    stated = {coupling.follower: coupling for coupling in couplings}
    out = []
    for coupling in stated.values():
        found, seen = coupling, [coupling.follower]
        while found.leader in stated:
            if found.leader in seen:
                raise InvalidValue(
                    f"{path}: joint '{coupling.follower}' mimics itself, through {', '.join(seen)}"
                )
            seen.append(found.leader)
            next_ = stated[found.leader]
            m, n = found.multiplier, next_.multiplier
            found = Coupling(
                coupling.follower, next_.leader, multiplier=m * n, offset=m * next_.offset + found.offset
            )
        out.append(found)
    return tuple(out)


def checked_couplings(name: str, model: Model, couplings: Iterable[Coupling]) -> tuple[Coupling, ...]:
    """Check that couplings fit a tree.

    Args:
        name: Name of the robot, for messages.
        model: The kinematic tree.
        couplings: The couplings.

    Returns:
        Couplings whose leaders follow no joint.

    Raises:
        InvalidValue: Something is no `Coupling`, a number of it is not finite, a joint has several axes, or
            one follows itself.
        UnknownName: There is no joint of a name.
    """
    listed = tuple(couplings)
    for coupling in listed:
        if not isinstance(coupling, Coupling):
            raise InvalidValue(f"couplings of {name} must be a list of Coupling, got {coupling!r} in it")
        finite(f"multiplier and offset of {coupling.follower}", (coupling.multiplier, coupling.offset), (2,))
        for joint in (coupling.follower, coupling.leader):
            if not model.existJointName(joint) or joint == model.names[0]:
                raise UnknownName("joint", joint, list(model.names)[1:])
            if model.joints[model.getJointId(joint)].nv != 1:
                raise InvalidValue(f"joint '{joint}' of {name} has several axes; a coupling takes one axis")
    return chained(name, listed)


def coupled(model: Model, couplings: Sequence[Coupling], q: Array) -> Array:
    """Set the coordinates of all followers in a configuration to the values that follow from their leaders.

    Args:
        model: The kinematic tree.
        couplings: Couplings whose leaders follow no joint.
        q: Configuration (nq,) [rad, m].

    Returns:
        A new configuration (nq,) that satisfies the couplings.
    """
    out = q.copy()
    for coupling in couplings:
        angle = coupling.multiplier * _coordinate(model, coupling.leader, out) + coupling.offset
        joint = model.joints[model.getJointId(coupling.follower)]
        out[joint.idx_q : joint.idx_q + joint.nq] = (
            (angle,) if joint.nq == 1 else (np.cos(angle), np.sin(angle))
        )
    return out


def narrow_leaders(model: Model, couplings: Sequence[Coupling]) -> tuple[str, ...]:
    """Narrow the position range of each leader, so that its followers stay in their own ranges.

    Args:
        model: The kinematic tree, whose limits are changed in place.
        couplings: Couplings whose leaders follow no joint.

    Returns:
        One sentence for each coupling whose ranges contradict each other.
    """
    dropped = []
    for coupling in couplings:
        leader, follower = (
            model.joints[model.getJointId(name)] for name in (coupling.leader, coupling.follower)
        )
        if leader.nq != 1 or follower.nq != 1 or coupling.multiplier == 0.0:
            continue
        of_follower = np.array(
            [model.lowerPositionLimit[follower.idx_q], model.upperPositionLimit[follower.idx_q]]
        )
        ends = np.sort((of_follower - coupling.offset) / coupling.multiplier)
        lower = max(float(model.lowerPositionLimit[leader.idx_q]), ends[0])
        upper = min(float(model.upperPositionLimit[leader.idx_q]), ends[1])
        if lower > upper:
            dropped.append(
                f"joint {coupling.follower} mimics {coupling.leader} beyond its own range, wherever that is"
            )
            continue
        for limit, value in ((model.lowerPositionLimit, lower), (model.upperPositionLimit, upper)):
            limit[leader.idx_q] = value
    return tuple(dropped)


def _coordinate(model: Model, name: str, q: Array) -> float:
    """Return the coordinate of a joint with one axis [rad or m], for a continuous joint in (−π, π]."""
    joint = model.joints[model.getJointId(name)]
    part = q[joint.idx_q : joint.idx_q + joint.nq]
    return float(part[0]) if joint.nq == 1 else float(np.arctan2(part[1], part[0]))
