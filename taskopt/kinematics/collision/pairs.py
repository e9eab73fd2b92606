"""Which shapes of a robot can meet, and what they are called."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

import re
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.geometry.coal import exact, solid
from taskopt.kinematics.robot.robot import Robot

Pair = tuple[int, int]  # places in robot.geometry.geometryObjects

_SAMPLES = 300


def self_pairs(robot: Robot, clearance: float = 0.0) -> tuple[Pair, ...]:
    """Pairs that can meet: the robot's own (from its SRDF), else found automatically.

    Automatic: all pairs on different joints, but for neighbours (joints that follow each other) and those
    that are never farther apart than `clearance` [m] in 300 random postures.
    """
    shapes = robot.geometry.geometryObjects
    known = [(int(pair.first), int(pair.second)) for pair in robot.geometry.collisionPairs]
    if known:
        return tuple(p for p in known if shapes[p[0]].parentJoint != shapes[p[1]].parentJoint)
    return _ever_apart(robot, _strangers(robot), clearance)


def named_pairs(robot: Robot, names: Iterable[tuple[str, str]]) -> tuple[Pair, ...]:
    """All pairs of shapes of the links named; raise `UnknownName`, or `InvalidValue` if two move as one."""
    shapes = robot.geometry.geometryObjects
    out = []
    for named in names:
        if isinstance(named, str) or len(named) != 2:
            raise InvalidValue(f"pairs must be names of links, two and two, got {named!r} in them")
        first, second = named
        for i in shapes_of(robot, [first]):
            for j in shapes_of(robot, [second]):
                if shapes[i].parentJoint == shapes[j].parentJoint:
                    raise InvalidValue(f"{first} and {second} move as one and cannot meet; leave them out")
                out.append((i, j))
    return tuple(out)


def shapes_of(robot: Robot, links: Iterable[str] | None) -> tuple[int, ...]:
    """Places of the shapes of some links; of all that move for None.

    Raises `UnknownName`, and `InvalidValue` for a robot without shapes.
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


def link_of(shape: str) -> str:
    """The link that a shape belongs to; here and in URDF's loader, its shapes are link_0, link_1, …"""
    return re.sub(r"_\d+$", "", shape)


def shape_names(robot: Robot) -> tuple[str, ...]:
    """The link's name for each shape, or the shape's own where the link has several."""
    names = [shape.name for shape in robot.geometry.geometryObjects]
    count = Counter(map(link_of, names))
    return tuple(link_of(name) if count[link_of(name)] == 1 else name for name in names)


def _strangers(robot: Robot) -> list[Pair]:
    """Pairs on joints that are not the same, and do not follow each other."""
    joints = [int(shape.parentJoint) for shape in robot.geometry.geometryObjects]
    parents = robot.model.parents
    return [
        (i, j)
        for j in range(len(joints))
        for i in range(j)
        if joints[i] != joints[j] and joints[i] != parents[joints[j]] and joints[j] != parents[joints[i]]
    ]


def _ever_apart(robot: Robot, pairs: Sequence[Pair], clearance: float) -> tuple[Pair, ...]:
    if not pairs:
        return ()
    shapes, data = solid(robot.geometry), robot.model.createData()
    for pair in pairs:
        shapes.addCollisionPair(pin.CollisionPair(*pair))
    memory = exact(shapes.createData())
    rng, apart = np.random.default_rng(0), np.zeros(len(pairs), dtype=bool)
    for q in [*robot.postures.values(), *(random_posture(robot, rng) for _ in range(_SAMPLES))]:
        pin.computeDistances(robot.model, data, shapes, memory, q)
        apart |= [result.min_distance > clearance for result in memory.distanceResults]
    return tuple(pair for pair, kept in zip(pairs, apart, strict=True) if kept)


def random_posture(robot: Robot, rng: np.random.Generator) -> Array:
    """Uniform within the limits, and within half a turn or half a metre where a joint has none."""
    q = robot.integrate(robot.posture("middle"), rng.uniform(-np.pi, np.pi, robot.nv), 1.0)
    has = robot.position_index >= 0
    lower, upper = robot.position_lower[has], robot.position_upper[has]
    low = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper, 0.0) - np.pi)
    high = np.where(np.isfinite(upper), upper, low + 2.0 * np.pi)
    q[robot.position_index[has]] = rng.uniform(low, np.maximum(low, high))
    return q
