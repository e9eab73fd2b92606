"""Which pairs there are, what they are called, and how far a step can carry them."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.collision.choice import choose_pairs
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.pairs import named_pairs
from taskopt.kinematics.geometry.coal import core, extent
from taskopt.kinematics.geometry.shapes import Box, Sphere, checked_obstacles
from taskopt.kinematics.robot import Robot, planar_arm
from taskopt.kinematics.robot.parts import link_of
from taskopt.kinematics.robot.random_posture import random_posture
from tests.helpers.robots import robot


def test_pairs_by_name_are_all_shapes_of_the_two_links():
    """One link against a finger of four boxes."""
    of = Robot.load("panda")
    pairs = named_pairs(of, [("panda_link0", "panda_leftfinger")])
    names = Collision.of_itself(of, pairs).names
    assert names == tuple(f"panda_link0 – panda_leftfinger_{i}" for i in range(4))


def test_what_cannot_meet_is_refused():
    """Two links on one joint, a link that there is not, and a robot without shapes."""
    of = robot("panda")
    with pytest.raises(InvalidValue, match="panda_hand and panda_link7 move as one"):
        named_pairs(of, [("panda_hand", "panda_link7")])
    with pytest.raises(UnknownName, match="did you mean panda_link5"):
        named_pairs(of, [("panda_hand", "panda_lnk5")])
    with pytest.raises(InvalidValue, match="no collision shapes"):
        Collision.with_obstacles(Robot(of.model), [Sphere([0, 0, 0], 1)])


def test_every_shape_that_moves_meets_every_obstacle():
    """16 shapes of the Panda, the base not among them, against spheres; the second gets a number."""
    of = Robot.load("panda")
    names = Collision.with_obstacles(
        of, [Sphere([1, 0, 0], 0.1), Sphere([2, 0, 0], 0.1), Box([0, 2, 0], [1, 1, 1])]
    ).names
    assert len(names) == len(set(names)) == 48
    assert {name.partition(" – ")[2] for name in names} == {"sphere", "sphere 2", "box"}
    assert not any(name.startswith("panda_link0") for name in names)
    assert "panda_link5 – sphere 2" in names


@pytest.mark.parametrize("given", [[], [None], ["sphere"], [Sphere([0, 0, 0], 1), 3]])
def test_what_is_no_obstacle_is_refused(given):
    """Nothing at all, or something that is not a shape."""
    with pytest.raises(InvalidValue, match="obstacles must be a list of"):
        checked_obstacles(given)


@pytest.mark.parametrize("name", ["planar3", "panda", "talos_reduced"])
def test_random_postures_keep_the_limits(name):
    """Each is inside, and they differ."""
    of, rng = robot(name), np.random.default_rng(0)
    some = [random_posture(of, rng) for _ in range(5)]
    assert all(of.outside(q) == () and np.isfinite(q).all() for q in some)
    assert np.abs(some[0] - some[1]).max() > 0.1


def test_shapes_are_named_after_links():
    """A number at the end is the place among the shapes of the link."""
    assert [link_of(name) for name in ("panda_link5_0", "link1_1", "tool")] == [
        "panda_link5",
        "link1",
        "tool",
    ]


def test_cores_and_extents_cover_the_solids():
    """A capsule is a segment and a radius, a hull is a core without radius that holds all its vertices."""
    of = planar_arm([0.5, 0.3, 0.3], radius=0.02)
    assert core(of.geometry.geometryObjects[0]) == pytest.approx((0.5, 0.02))
    assert extent(of.geometry.geometryObjects[0]) >= 0.52
    arm = robot("panda")
    for shape in Collision.of_itself(arm, choose_pairs(arm).pairs).shapes.geometryObjects:
        points = np.array(shape.geometry.points()) if hasattr(shape.geometry, "points") else None
        if points is not None:
            placed = points @ shape.placement.rotation.T + shape.placement.translation
            assert np.linalg.norm(placed, axis=1).max() <= extent(shape)
            assert np.linalg.norm(points[:, None] - points[None], axis=2).max() <= core(shape)[0]
