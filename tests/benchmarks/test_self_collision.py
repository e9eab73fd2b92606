"""The acceptance of self-collision: a seeded sample of TIAGo dual, judged by Pinocchio and Coal alone."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import coal
import numpy as np
import pinocchio as pin
import pytest
from self_collision import INFLUENCE, MARGIN, Case, draw, way

from taskopt import Robot, SelfCollisionLimit
from taskopt.arrays import Array

SLACK = 2e-6  # [m], twice the tolerance of Coal's distances
EVERY = 60  # a posture of so many is judged
FREE, SENT = 3, 2  # cases

pytestmark = pytest.mark.slow


class Oracle:
    """Distances of pairs of the robot's own shapes, whose meshes Coal replaces by their convex hulls."""

    def __init__(self, robot: Robot, pairs: Iterable[tuple[int, int]]) -> None:
        self.robot, self.data, self.shapes = robot, robot.model.createData(), robot.geometry.copy()
        self.shapes.removeAllCollisionPairs()
        for shape in self.shapes.geometryObjects:
            if isinstance(shape.geometry, coal.BVHModelBase):
                shape.geometry.buildConvexHull(True, "Qt")
                shape.geometry = shape.geometry.convex
        for pair in pairs:
            self.shapes.addCollisionPair(pin.CollisionPair(*pair))
        self.memory = self.shapes.createData()

    def distances(self, q: Array) -> Array:
        """The distance of each pair [m]."""
        pin.computeDistances(self.robot.model, self.data, self.shapes, self.memory, q)
        return np.array([result.min_distance for result in self.memory.distanceResults])

    def missing(self, postures: Sequence[Array]) -> float:
        """How far a pair comes below its margin, or below the distance it started with inside it [m]."""
        floor = np.minimum(self.distances(postures[0]), MARGIN)
        return max(float((floor - self.distances(q)).max()) for q in [*postures[::EVERY], postures[-1]])


class Setting(NamedTuple):
    """The robot, its limit, and the judge of its pairs."""

    robot: Robot
    limit: SelfCollisionLimit
    oracle: Oracle


@pytest.fixture(scope="module")
def setting() -> Setting:
    """TIAGo dual, whose pairs that are always near are found in 200 postures."""
    robot, limit = Robot.load("tiago_dual"), SelfCollisionLimit(MARGIN, influence=INFLUENCE, sampled=200)
    return Setting(robot, limit, Oracle(robot, limit.choice(robot).pairs))


def test_targets_whose_way_is_free_are_reached_and_no_pair_comes_below_its_margin(setting: Setting) -> None:
    """A way is free if it arrives without the limit and keeps the margins; then it does so with the limit."""
    robot, limit, oracle = setting
    rng, free = np.random.default_rng(11), 0
    for _ in range(3 * FREE):
        case = draw(robot, rng)
        reached, postures = way(robot, case, [])
        if reached and oracle.missing(postures) <= SLACK:
            free += 1
            reached, postures = way(robot, case, [limit])
            assert reached
            assert oracle.missing(postures) <= SLACK
        if free == FREE:
            return
    pytest.fail(f"only {free} of {3 * FREE} ways are free")


def test_wrists_that_are_sent_into_each_other_stay_apart(setting: Setting) -> None:
    """Without the limit the judge sees them collide; with it, no pair comes below its margin."""
    robot, limit, oracle = setting
    rng = np.random.default_rng(12)
    for _ in range(SENT):
        case = draw(robot, rng)
        middle = 0.5 * (case.poses[0][:3, 3] + case.poses[1][:3, 3])
        for pose in case.poses:
            pose[:3, 3] = middle
        _, postures = way(robot, Case(case.q, case.poses), [])
        assert oracle.missing(postures) > MARGIN
        reached, postures = way(robot, case, [limit])
        assert not reached
        assert oracle.missing(postures) <= SLACK
