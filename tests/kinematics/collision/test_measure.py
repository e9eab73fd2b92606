"""Distances, witness points and gradients against closed forms and central differences."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

import coal
import numpy as np
import pinocchio as pin
import pytest

from taskopt.kinematics.collision.choice import choose_pairs
from taskopt.kinematics.collision.measure import Distances, distances_into
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Box, Capsule, HalfSpace, Sphere
from taskopt.kinematics.robot import Robot, planar_arm
from tests.helpers.near import NAMES, SOLIDS, beside, circle_clearance
from tests.helpers.robots import robot

STEP = 1e-5
KINK = 3e-8  # fourth-order differences from two steps that disagree by more have a kink between them


def measured(distances, at):
    """Distances at a configuration, as a copy."""
    distances.update(at)
    return distances.distance.copy()


def slopes(distances, at):
    """(P, nv) differences along each velocity on the manifold, and (P,) whether all of them are smooth.

    Fourth order, since near a corner distances curve within millimetres. A kink is where the slope jumps,
    or its own slope does, as where a vertex takes over from an edge.
    """
    of = at.robot

    def central(size):
        columns = []
        for step in np.eye(of.nv) * size:
            ahead = measured(distances, Configuration(of, of.integrate(at.q, step, 1.0)))
            behind = measured(distances, Configuration(of, of.integrate(at.q, step, -1.0)))
            columns.append((ahead - behind) / (2.0 * size))
        return np.stack(columns, axis=-1)

    one, two, four = central(STEP), central(2.0 * STEP), central(4.0 * STEP)
    fine, coarse = (4.0 * one - two) / 3.0, (4.0 * two - four) / 3.0
    return fine, np.abs(fine - coarse).max(axis=1) < KINK


def judge(distances, at):
    """The largest relative error of the gradients away from kinks, how many kinks, of how many pairs."""
    numeric, smooth = slopes(distances, at)
    distances.update(at)
    size = np.maximum(np.abs(numeric).max(axis=1), 0.05)
    error = np.abs(distances.gradient - numeric).max(axis=1) / size
    return error[smooth].max(initial=0.0), int((~smooth).sum()), len(smooth)


@pytest.mark.slow
@pytest.mark.parametrize("solid", SOLIDS)
@pytest.mark.parametrize("name", NAMES)
def test_the_gradient_is_the_derivative_of_the_distance(name, solid):
    """∂d/∂q = nᵀ(J₂ − J₁) to 1e-8 of its size, overlapping or apart; kinks are counted, and are few."""
    rng = np.random.default_rng(len(name) + len(solid))
    worst, kinks, pairs, inside = 0.0, 0, 0, 0
    for _ in range(2 if name == "talos_reduced" else 6):
        at, place = beside(robot(name), rng, scatter=0.08)
        distances = Distances(Collision.with_obstacles(robot(name), [SOLIDS[solid](place)]))
        error, bent, count = judge(distances, at)
        worst, kinks, pairs = max(worst, error), kinks + bent, pairs + count
        inside += int((distances.distance < 0.0).sum())
    assert worst < 1e-8
    assert kinks <= 0.02 * pairs
    assert inside > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "talos_reduced"])
def test_the_gradient_of_self_distances_is_their_derivative(name):
    """With both solids moving, joints below both count for nothing."""
    of, rng = robot(name), np.random.default_rng(3)
    pairs = choose_pairs(of).pairs
    chosen = [pairs[i] for i in rng.choice(len(pairs), min(len(pairs), 60), replace=False)]
    distances = Distances(Collision.of_itself(of, chosen))
    results = [judge(distances, beside(of, rng)[0]) for _ in range(3)]
    assert max(error for error, _, _ in results) < 1e-7
    assert sum(bent for _, bent, _ in results) <= 0.02 * 3 * len(chosen)


def test_a_wrong_gradient_is_caught():
    """The check sees a sign, and a witness point that is off by a tenth of a millimetre."""
    of, rng = robot("panda"), np.random.default_rng(0)
    at, place = beside(of, rng)
    distances = Distances(Collision.with_obstacles(of, [Sphere(place, 0.05)]))
    numeric, _ = slopes(distances, at)
    distances.update(at)
    true = distances.gradient.copy()
    np.testing.assert_allclose(true, numeric, rtol=0, atol=1e-7)
    assert np.abs(-true - numeric).max() > 0.1
    moved = distances.collision.contact.copy()
    normals = moved[:, :3]
    moved[:, 3:6] += 1e-4 * np.cross(normals, [0.36, 0.48, 0.8])
    distances_into(
        moved,
        distances.collision.crossed,
        distances.collision.turn,
        at.joint_jacobians,
        distances.distance,
        distances.gradient,
    )
    assert np.abs(distances.gradient - numeric).max() > 1e-6


def test_a_mesh_as_loaded_would_know_no_inside():
    """The hulls that we measure overlap a sphere in the middle of a link by more than its radius."""
    of = robot("panda")
    at = Configuration(of, of.posture("default"))
    shape = next(s for s in of.geometry.geometryObjects if s.name == "panda_link5_0")
    shape.geometry.computeLocalAABB()
    middle = (
        at.joint_poses()[shape.parentJoint]
        @ shape.placement.homogeneous
        @ [*np.ravel(shape.geometry.aabb_center), 1.0]
    )
    distances = Distances(Collision.with_obstacles(of, [Sphere(middle[:3], 0.03)], links=["panda_link5"]))
    assert measured(distances, at)[0] < -0.03


def test_planar_links_are_segments_with_a_radius():
    """Distances of the three capsules to a circle are those of elementary geometry, to 1e-12."""
    lengths, radius, centre = np.array([0.5, 0.3, 0.3]), 0.01, np.array([0.3, 0.1])
    of, rng = planar_arm(lengths.tolist(), radius=radius), np.random.default_rng(5)
    distances = Distances(Collision.with_obstacles(of, [Sphere([*centre, 0.0], 0.1)]))
    assert distances.collision.names == ("link1 – sphere", "link2 – sphere", "link3 – sphere")
    for _ in range(50):
        q = rng.uniform(-np.pi, np.pi, 3)
        expected = circle_clearance(lengths, q, centre, 0.1) - radius
        np.testing.assert_allclose(measured(distances, Configuration(of, q)), expected, rtol=0, atol=1e-12)


def test_a_mesh_without_volume_counts_as_its_bounding_box():
    """Where there is no hull to be had, a flat triangle is a plate: the distance above it is exact."""
    corners = [np.array([0.0, 0.0, 0.2]), np.array([1.0, 0.0, 0.2]), np.array([0.0, 1.0, 0.2])]
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(1, 3)
    mesh.addTriangle(*corners)
    mesh.endModel()
    shapes = pin.GeometryModel()
    shapes.addGeometryObject(pin.GeometryObject("plate_0", 1, pin.SE3.Identity(), mesh))
    of = Robot(planar_arm().model, shapes)
    distances = Distances(Collision.with_obstacles(of, [Sphere([0.2, 0.2, 1.0], 0.1)]))
    assert measured(distances, Configuration(of, [0, 0, 0]))[0] == pytest.approx(0.7, abs=2e-6)


@pytest.mark.parametrize(
    ("obstacle", "distance", "point"),
    [
        (Sphere([0.8, 0.5, 0], 0.1), 0.38, [0.8, 0.4, 0]),
        (Capsule([0.8, 0.5, -1], [0.8, 0.5, 1], 0.1), 0.38, [0.8, 0.4, 0]),
        (HalfSpace([0, -2, 0], -0.5), 0.48, [1.1, 0.5, 0]),
        (HalfSpace([-1, 0, 0], -1.3), 0.18, [1.3, 0, 0]),
        (Box([0.8, 0.5, 0], [0.2, 0.2, 0.2]), 0.38, None),
        (Sphere([1.0, 0.01, 0], 0.1), -0.11, [1.0, -0.09, 0]),
    ],
)
def test_witness_points_are_the_nearest_points(obstacle, distance, point):
    """A stretched arm along x, radius 0.02: distance and point follow by inspection, overlap included."""
    of = planar_arm([0.5, 0.3, 0.3], radius=0.02)
    distances = Distances(Collision.with_obstacles(of, [obstacle], links=["link3"]))
    assert measured(distances, Configuration(of, [0, 0, 0]))[0] == pytest.approx(distance, abs=1e-10)
    first, second = distances.witness[0]
    normal = distances.collision.contact[0, :3]
    np.testing.assert_allclose(second - first, distance * normal, rtol=0, atol=1e-10)
    if point is not None and not isinstance(obstacle, HalfSpace):
        np.testing.assert_allclose(second, point, rtol=0, atol=1e-9)
    if isinstance(obstacle, HalfSpace):
        assert second @ obstacle.normal == pytest.approx(obstacle.offset, abs=1e-12)


@pytest.mark.parametrize("offset", [0.0, 1e-9, -1e-9, 1e-6, -1e-6])
def test_touching_solids_have_a_normal(offset):
    """At d = 0 the direction is still the right one: the gradient does not vanish, flip, or turn NaN."""
    of = planar_arm([0.5, 0.3, 0.3], radius=0.02)
    distances = Distances(
        Collision.with_obstacles(of, [Sphere([0.95, 0.12 + offset, 0], 0.1)], links=["link3"])
    )
    at = Configuration(of, [0, 0, 0])
    assert measured(distances, at)[0] == pytest.approx(offset, abs=1e-15)
    np.testing.assert_allclose(distances.gradient[0], [-0.95, -0.45, -0.15], rtol=0, atol=1e-7)


def test_capsules_whose_segments_cross_overlap_by_both_radii():
    """In the plane of an arm Coal has no normal for them; the distance is −(0.02 + 0.05), not 0."""
    arm = planar_arm([1.0], radius=0.02)
    across = Capsule([0.5, -0.3, 0.0], [0.5, 0.3, 0.0], 0.05)
    distances = Distances(Collision.with_obstacles(arm, [across]))
    distances.update(Configuration(arm, [0.0]))
    assert distances.distance[0] == pytest.approx(-0.07, abs=1e-12)


def test_a_measurement_that_failed_is_taken_again():
    """NaN, or one witness point for two solids apart, as Coal gives now and then, do not stay."""
    of = robot("panda")
    at = Configuration(of, of.posture("default"))
    collision = Collision.with_obstacles(of, [Sphere([2.0, 0.0, 0.5], 0.1)])
    distances = Distances(collision)
    distances.update(at)
    true = distances.distance.copy()
    spoilt, measure = collision.contact.copy(), collision.contact
    spoilt[0], spoilt[3, 3:6] = np.nan, spoilt[3, 6:]
    collision.contact, again = spoilt, collision.remeasure

    def remeasure() -> None:
        again()
        collision.contact = measure
        spoilt[:] = measure

    collision.remeasure = remeasure
    distances.update(at)
    np.testing.assert_allclose(distances.distance, true, atol=1e-9)
