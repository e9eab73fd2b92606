"""Pairs of shapes that are near each other in every posture, as a bound from lengths of links proves."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterable
from itertools import pairwise

import coal
import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.collision.lengths import slide_length
from taskopt.kinematics.collision.pairs import SolidPair
from taskopt.kinematics.engine import GeometryModel, GeometryObject
from taskopt.kinematics.geometry.coal import core
from taskopt.kinematics.robot.robot import Robot

_POINT = 1e-9  # [m] radius of the ball that stands for a point, since Coal knows no points


def always_near(
    robot: Robot, solids: GeometryModel, pairs: Iterable[SolidPair], clearance: float
) -> tuple[SolidPair, ...]:
    """Find pairs whose distance is at most `clearance` in every posture.

    Let o_1, …, o_m be the origins of the joints between two solids A and B. Origin o_1 is fixed in A, o_m is
    fixed in B, and o_i and o_(i+1) are fixed in one link. Hence, with d the signed distance,

        d(A, B) ≤ d(A, o_1) + Σ |o_(i+1) − o_i| + d(o_m, B)

    in every posture, since no number on the right depends on it. A sliding joint adds the length of its
    range.

    Args:
        robot: The robot.
        solids: Its shapes as convex solids.
        pairs: Indices in `solids` of the two shapes of each pair.
        clearance: Largest distance of the pairs that are searched for [m].

    Returns:
        The pairs for which the right-hand side is at most the clearance. Other pairs may be near in every
        posture, too, since the bound is not exact.
    """
    chains = _Chains(robot)
    shapes = list(solids.geometryObjects)
    joints = [int(shape.parentJoint) for shape in shapes]
    depths = [0.5 * diameter + radius for diameter, radius in map(core, shapes)]
    found = []
    for first, second in pairs:
        start, length, stop = chains.between(joints[first], joints[second])
        if length - depths[first] - depths[second] > clearance:  # no origin is deeper in a solid than that
            continue
        apart = length + _signed_distance(shapes[first], start) + _signed_distance(shapes[second], stop)
        if apart <= clearance:
            found.append((first, second))
    return tuple(found)


class _Chains:
    """The lengths between joints along the chains that connect the bodies of a robot."""

    def __init__(self, robot: Robot) -> None:
        """Copy the parents and placements of the joints of a robot."""
        self._supports = [list(support) for support in robot.model.supports]
        self._origins = np.array([place.translation for place in robot.model.jointPlacements])
        self._slides = [slide_length(robot, joint) for joint in range(len(self._supports))]

    def between(self, first: int, second: int) -> tuple[Array, float, Array]:
        """Return o_1 (3,) in the frame of the first joint, Σ |o_(i+1) − o_i|, and o_m (3,) in the other's."""
        mine, theirs = self._supports[first], self._supports[second]
        shared = sum(a == b for a, b in zip(mine, theirs, strict=False))
        mine, theirs, o = mine[shared:], theirs[shared:], self._origins
        start = np.zeros(3) if mine else o[theirs[0]]
        stop = np.zeros(3) if theirs else o[mine[0]]
        length = float(np.linalg.norm(o[mine[0]] - o[theirs[0]])) if mine and theirs else 0.0
        length += sum(self._slides[joint] for joint in (*mine, *theirs))
        steps = (*pairwise(mine), *pairwise(theirs))
        return start, length + sum(float(np.linalg.norm(o[joint])) for _, joint in steps), stop


def _signed_distance(shape: GeometryObject, point: Array) -> float:
    """Return the signed distance [m] between a solid and a point (3,) in the frame of its joint."""
    pose = coal.Transform3s(shape.placement.rotation, shape.placement.translation)
    place, ball = coal.Transform3s(np.eye(3), point), coal.Sphere(_POINT)
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(shape.geometry, pose, ball, place, request, result)) + _POINT
