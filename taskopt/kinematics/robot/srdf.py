"""Reading SRDF files: named postures, and pairs of links that are never checked for collision."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Container, Mapping
from pathlib import Path

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.kinematics.engine import GeometryModel, JointModel, Model
from taskopt.kinematics.robot.xml_file import finite_numbers, parse

States = Mapping[str, Mapping[str, list[float]]]
"""For each named state, the values [rad, m] of each of its joints."""


def named_states(srdf: Path) -> dict[str, dict[str, list[float]]]:
    """Read the joint values of each `group_state` of an SRDF file.

    States of the same name in several groups are merged into one.

    Args:
        srdf: The SRDF file.

    Returns:
        For each state, the values [rad, m] of each of its joints.

    Raises:
        InvalidValue: The file is not an SRDF, a value is not a number, a joint has two values in one state,
            or a pair lacks a link; the message names what is flawed.
    """
    root = parse(srdf)
    if root.tag != "robot":
        raise InvalidValue(f"{srdf} is no SRDF: its root element is <{root.tag}>, and not <robot>")
    for pair in root.iter("disable_collisions"):
        if not (pair.get("link1") and pair.get("link2")):
            raise InvalidValue(f"{srdf}: <disable_collisions> needs two links, got {pair.attrib}")
    states: dict[str, dict[str, list[float]]] = {}
    for state in root.findall("group_state"):
        name = state.get("name", "")
        values = states.setdefault(name, {})
        for joint in state.findall("joint"):
            where = f"{srdf}: joint '{joint.get('name')}' of the state '{name}'"
            found = _values(where, joint.get("value", ""))
            if values.setdefault(joint.get("name", ""), found) != found:
                raise InvalidValue(f"{where} has two values, {values[joint.get('name', '')]} and {found}")
    return states


def postures(
    srdf: Path, model: Model, fixed: Container[str] = ()
) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Read the named postures of an SRDF file; joints that it does not name are neutral.

    A state is left out if the model lacks most of its joints, since it then belongs to another variant of the
    robot.

    Args:
        srdf: The SRDF file.
        model: The kinematic tree.
        fixed: Names of joints that the tree rightly lacks, since they do not move.

    Returns:
        Configurations (nq,) [rad, m] by name, and one sentence for each state that was not read as a whole.

    Raises:
        InvalidValue: The file is not an SRDF, or a value is not a number or does not fit its joint.
    """
    out: dict[str, Array] = {}
    dropped: list[str] = []
    for name, values in named_states(srdf).items():
        known = [joint for joint in values if model.existJointName(joint)]
        lost = [joint for joint in values if joint not in known and joint not in fixed]
        whole = 2 * len(known) > len(values)
        if whole and (others := [joint for joint in lost if joint != "root_joint"]):
            dropped.append(
                f"the state '{name}' of the SRDF names joints that are not there: {', '.join(others)}"
            )
        elif not whole and lost:
            dropped.append(
                f"the state '{name}' of the SRDF is left out, since most of its joints are not there"
            )
        if whole:
            q = pin.neutral(model)
            for joint in known:
                where = f"{srdf}: joint '{joint}' of the state '{name}'"
                _set(q, model.joints[model.getJointId(joint)], values[joint], where)
            out[name] = pin.normalize(model, q)
    return out, tuple(dropped)


def add_pairs(model: Model, shapes: GeometryModel, srdf: Path) -> None:
    """Add all pairs of shapes except those that an SRDF disables; add none if it disables none.

    Args:
        model: The kinematic tree.
        shapes: Its collision shapes.
        srdf: The SRDF file.

    Raises:
        InvalidValue: The file is not XML.
    """
    if next(parse(srdf).iter("disable_collisions"), None) is not None:
        shapes.addAllCollisionPairs()
        pin.removeCollisionPairs(model, shapes, str(srdf))


def _values(where: str, text: str) -> list[float]:
    """Return the numbers of a value."""
    values = finite_numbers(text)
    if not values:
        expand = "; expand it with xacro first" if "${" in text or "$(" in text else ""
        raise InvalidValue(f"{where} has the value '{text}', which is no number [rad, m]{expand}")
    return values


def _set(q: Array, joint: JointModel, values: list[float], where: str) -> None:
    """Write a joint's value into q; an SRDF states an angle even where q holds cosine and sine."""
    if len(values) == 1 and joint.nq == 2 and joint.nv == 1:
        values = [float(np.cos(values[0])), float(np.sin(values[0]))]
    if len(values) != joint.nq:
        raise InvalidValue(f"{where} has {len(values)} numbers, and the joint takes {joint.nq}")
    q[joint.idx_q : joint.idx_q + joint.nq] = values
