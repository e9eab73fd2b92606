"""Obstacles as declarations: what they keep, what they refuse."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.geometry.coal import obstacle_object
from taskopt.kinematics.geometry.shapes import Box, Capsule, HalfSpace, Sphere, obstacle_names, turning_z_to
from taskopt.kinematics.pose import homogeneous
from taskopt.kinematics.robot import planar_arm


def test_shapes_are_values():
    """Equal numbers make equal obstacles, whatever they were given as."""
    assert Sphere([0.1, 0.2, 0.3], 0.1) == Sphere(np.array([0.1, 0.2, 0.3]), 0.1)
    boxes = {Box([0, 0, 1], [1, 1, 1]), Box((0.0, 0.0, 1.0), np.ones(3)), Box(np.eye(4), [1, 1, 1])}
    assert len(boxes) == 2
    assert HalfSpace([0, 0, 5], 0.3) == HalfSpace([0, 0, 1], 0.3)


def test_a_half_space_at_an_offset_contains_what_is_below():
    """n·x ≤ offset: its pose is the surface point nearest to the origin, z along n."""
    wall = HalfSpace([3, 0, 4], 0.5)
    np.testing.assert_allclose(wall.pose[:3, 3], [0.3, 0, 0.4], atol=1e-15)
    np.testing.assert_allclose(wall.pose[:3, 2], [0.6, 0, 0.8], atol=1e-15)


def test_a_capsule_lies_along_its_segment():
    """The middle and the direction are those of the two ends, for no direction too."""
    rod = Capsule([1, 0, 0], [1, 2, 0], 0.1)
    assert rod.length == 2.0
    np.testing.assert_allclose(rod.pose[:3, 2:], [[0, 1], [1, 1], [0, 0]], atol=1e-15)
    assert np.array_equal(Capsule([1, 0, 0], [1, 0, 0], 0.1).pose[:3, :3], np.eye(3))


@pytest.mark.parametrize("direction", [[0, 0, 1], [0, 0, -2], [1, 2, 3], [1e-9, 0, 0]])
def test_turning_z_is_a_rotation(direction):
    """Orthonormal, right-handed, third column along the direction."""
    R = turning_z_to(np.array(direction, dtype=float))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) == pytest.approx(1.0)
    np.testing.assert_allclose(R[:, 2], np.array(direction) / np.linalg.norm(direction), atol=1e-14)


def test_obstacles_can_be_drawn():
    """Each becomes a geometry object of its name, at its pose, with a colour."""
    turned = homogeneous(turning_z_to(np.array([1.0, 1.0, 0.0])), np.array([0.1, 0.2, 0.3]))
    for shape in (
        Sphere([1, 2, 3], 0.1),
        Capsule([0, 0, 0], [1, 0, 0], 0.1),
        Box(turned, [1, 2, 3]),
        HalfSpace([0, 0, 1]),
    ):
        drawn = obstacle_object(shape)
        assert drawn.name == shape.name
        assert drawn.parentJoint == 0
        np.testing.assert_allclose(drawn.placement.homogeneous, shape.pose, atol=1e-15)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Sphere([0, 0], 0.1), "centre of a sphere must have shape 3"),
        (lambda: Sphere([0, 0, np.nan], 0.1), "centre of a sphere has NaN"),
        (lambda: Sphere([0, 0, 0], 0.0), "radius of a sphere must be > 0"),
        (lambda: Capsule([0, 0, 0], [1, 0, 0], -1), "radius of a capsule must be > 0"),
        (lambda: Box([0, 0, 0], [1, 0, 1]), "size of a box must be > 0"),
        (lambda: Box(np.zeros((4, 4)), [1, 1, 1]), "place of a box"),
        (lambda: HalfSpace([0, 0, 0]), "must be a direction"),
        (lambda: HalfSpace([0, 0, 1], np.inf), "offset of a half-space"),
    ],
)
def test_shapes_refuse_what_has_no_meaning(make, said):
    """Wrong sizes, NaN, no extent, no direction."""
    with pytest.raises(InvalidValue, match=said):
        make()


def test_pairs_call_obstacles_what_obstacle_names_says() -> None:
    """Of [ball, sphere, sphere], the pairs of an arm say ball, sphere, sphere 2, as `obstacle_names` does."""
    obstacles = [Sphere([1, 0, 0], 0.1, name="ball"), Sphere([2, 0, 0], 0.1), Sphere([3, 0, 0], 0.1)]
    assert obstacle_names(obstacles) == ["ball", "sphere", "sphere 2"]
    pairs = Collision.with_obstacles(planar_arm([0.5]), obstacles).names
    assert [name.partition(" – ")[2] for name in pairs] == obstacle_names(obstacles)
