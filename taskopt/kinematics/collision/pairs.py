"""Shapes of a robot and pairs of shapes, found by the names of their links."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from taskopt.arrays import Array, finite, require_mapping
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.robot.parts import link_of
from taskopt.kinematics.robot.robot import Robot

SolidPair = tuple[int, int]  # places in robot.geometry.geometryObjects
Margins = Mapping[str | tuple[str, str], float]  # [m] by the name of a solid or link, or by two of them


def named_pairs(robot: Robot, names: Iterable[tuple[str, str]]) -> tuple[SolidPair, ...]:
    """Find all pairs of shapes of given pairs of links.

    Args:
        robot: The robot.
        names: Pairs of names of links.

    Returns:
        Indices in `robot.geometry` of the two shapes of each pair.

    Raises:
        UnknownName: No link with a shape has that name.
        InvalidValue: An entry is not a pair of names, or its two links move as one body.
    """
    shapes = robot.geometry.geometryObjects
    out = []
    for named in names if isinstance(names, Iterable) else (names,):
        if isinstance(named, str) or not isinstance(named, Sequence) or len(named) != 2:
            raise InvalidValue(f"pairs must be names of links, two and two, got {named!r} in them")
        first, second = named
        for i in shapes_of(robot, [first]):
            for j in shapes_of(robot, [second]):
                if shapes[i].parentJoint == shapes[j].parentJoint:
                    raise InvalidValue(f"{first} and {second} move as one and cannot meet; leave them out")
                out.append((i, j))
    return tuple(out)


def shapes_of(robot: Robot, links: Iterable[str] | None) -> tuple[int, ...]:
    """Find the shapes of links.

    Args:
        robot: The robot.
        links: Names of links, or one name; None: all links that move.

    Returns:
        Indices of the shapes in `robot.geometry`.

    Raises:
        UnknownName: No link with a shape has that name.
        InvalidValue: The robot has no shapes.
    """
    shapes = robot.geometry.geometryObjects
    if not len(shapes):
        raise InvalidValue(
            f"{robot.name} has no collision shapes to keep away from anything; give Robot a geometry"
        )
    if links is None:
        return tuple(i for i, shape in enumerate(shapes) if shape.parentJoint > 0)
    owners = [link_of(shape.name) for shape in shapes]
    out: list[int] = []
    for link in [links] if isinstance(links, str) else links:
        if link not in owners:
            raise UnknownName("link with a shape", link, sorted(set(owners)))
        out += [i for i, owner in enumerate(owners) if owner == link]
    return tuple(out)


def shape_names(robot: Robot) -> tuple[str, ...]:
    """Name each shape of a robot by its link, or by its own name if the link has several shapes.

    Args:
        robot: The robot.

    Returns:
        One name for each shape, in the order of the robot's geometry.
    """
    names = [shape.name for shape in robot.geometry.geometryObjects]
    count = Counter(map(link_of, names))
    return tuple(link_of(name) if count[link_of(name)] == 1 else name for name in names)


def pair_margins(names: Sequence[str], margin: float, margins: Margins) -> Array:
    """Find the margin of each pair of solids.

    Args:
        names: Names of the pairs, such as "panda_link5 – sphere", (P,).
        margin: Of pairs that no entry of `margins` fits [m].
        margins: Other margins by the name of a solid or link, or by two of them [m].

    Returns:
        The margin of each pair, (P,) [m].

    Raises:
        UnknownName: No pair has the solid or link, or the two of them.
        InvalidValue: A margin is negative or not finite.
    """
    require_mapping("margins", margins, '{"panda_hand": 0.05}')
    ends = [[{side, link_of(side)} for side in name.split(" – ")] for name in names]
    out = np.full(len(names), margin)
    for key, value in margins.items():
        least = float(finite(f"margin of {key}", value, ()))
        if least < 0.0:
            raise InvalidValue(f"margin of {key} must be ≥ 0, got {least:g}")
        one, *other = (key,) if isinstance(key, str) else key
        fits = [(one in a and not set(other) - b) or (one in b and not set(other) - a) for a, b in ends]
        if not any(fits):
            known = {side for a, b in ends for side in a | b}
            raise UnknownName("link or obstacle", " – ".join((one, *other)), sorted(known), "(in margins)")
        out[fits] = least
    return out
