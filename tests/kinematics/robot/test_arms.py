"""The arms of the textbook against direct kinematics written by hand, for dimensions unlike the defaults."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from taskopt import (
    Configuration,
    InvalidValue,
    Robot,
    anthropomorphic_arm,
    anthropomorphic_with_wrist,
    cylindrical_arm,
    four_bar,
    parallelogram_arm,
    planar_arm,
    scara,
    seven_joint_arm,
    spherical_arm,
    spherical_wrist,
    stanford_manipulator,
)
from taskopt.kinematics.robot.arms import ARMS

Pose = tuple[np.ndarray, np.ndarray]  # R (3, 3) and p (3,) [m]
QUARTERS = (0.0, np.pi / 2, np.pi, -np.pi / 2)  # degenerate values of the joints


def turn(axis: str, angle: float) -> np.ndarray:
    """Elementary rotation about x, y or z, with the entries of (2.6)–(2.8) of the textbook."""
    c, s = np.cos(angle), np.sin(angle)
    entries = {
        "x": [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]],
        "y": [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]],
        "z": [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
    }
    return np.array(entries[axis])


def wrist(q: np.ndarray, d6: float) -> Pose:
    """(2.67): the joints are the ZYZ angles, and the tip is d₆ along the approach axis."""
    R = turn("z", q[0]) @ turn("y", q[1]) @ turn("z", q[2])
    return R, d6 * R[:, 2]


def spherical(q: np.ndarray, d2: float) -> Pose:
    """(2.65): the rod of length d₃ is turned by ϑ₁ about z and by ϑ₂ about y, beside the offset d₂."""
    s1, s2 = np.sin(q[:2])
    c1, c2 = np.cos(q[:2])
    R = np.array([[c1 * c2, -s1, c1 * s2], [s1 * c2, c1, s1 * s2], [-s2, 0.0, c2]])
    return R, np.array([c1 * s2 * q[2] - s1 * d2, s1 * s2 * q[2] + c1 * d2, c2 * q[2]])


def anthropomorphic(q: np.ndarray, a2: float, a3: float) -> Pose:
    """(2.66): two links in a vertical plane, which ϑ₁ turns."""
    s1, s2, s23 = np.sin([q[0], q[1], q[1] + q[2]])
    c1, c2, c23 = np.cos([q[0], q[1], q[1] + q[2]])
    R = np.array([[c1 * c23, -c1 * s23, s1], [s1 * c23, -s1 * s23, -c1], [s23, c23, 0.0]])
    return R, np.array([c1 * (a2 * c2 + a3 * c23), s1 * (a2 * c2 + a3 * c23), a2 * s2 + a3 * s23])


def anthropomorphic_wrist(q: np.ndarray, a2: float, d4: float, d6: float) -> Pose:
    """(2.70): the wrist hangs on a frame whose z axis lies along the forearm."""
    s1, s2, s23 = np.sin([q[0], q[1], q[1] + q[2]])
    c1, c2, c23 = np.cos([q[0], q[1], q[1] + q[2]])
    R3 = np.array([[c1 * c23, s1, c1 * s23], [s1 * c23, -c1, s1 * s23], [s23, 0.0, -c23]])
    R, end = wrist(q[3:], d6)
    elbow = np.array([a2 * c1 * c2, a2 * s1 * c2, a2 * s2])
    return R3 @ R, elbow + R3 @ (np.array([0.0, 0.0, d4]) + end)


def stanford(q: np.ndarray, d2: float, d6: float) -> Pose:
    """(2.68): the wrist at the end of the rod of the spherical arm."""
    (R3, p3), (R, end) = spherical(q, d2), wrist(q[3:], d6)
    return R3 @ R, p3 + R3 @ end


def seven_joints(q: np.ndarray, d3: float, d5: float, d7: float) -> Pose:
    """Upper arm, forearm and hand along their z axes; joints turn about z, and every second one about ±y."""
    up = np.array([0.0, 0.0, 1.0])
    shoulder = turn("z", q[0]) @ turn("y", q[1])
    elbow = shoulder @ turn("z", q[2]) @ turn("y", q[3])
    hand = elbow @ turn("z", q[4]) @ turn("y", q[5]) @ turn("z", q[6])
    return hand, d3 * shoulder @ up + d5 * elbow @ up + d7 * hand @ up


def cylindrical(q: np.ndarray) -> Pose:
    """A column turned by ϑ₁; d₂ up, d₃ outwards along the y axis of the column, which is z of the tip."""
    out = turn("z", q[0]) @ [0.0, 1.0, 0.0]
    R = np.column_stack([turn("z", q[0]) @ [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], out])
    return R, np.array([0.0, 0.0, q[1]]) + q[2] * out


def scara_pose(q: np.ndarray, a1: float, a2: float, height: float) -> Pose:
    """Two links at a height, a quill that adds d₃ to it, and the sum of the three angles about z."""
    x, y = a1 * np.array([np.cos(q[0]), np.sin(q[0])]) + a2 * np.array(
        [np.cos(q[0] + q[1]), np.sin(q[0] + q[1])]
    )
    return turn("z", q[0] + q[1] + q[3]), np.array([x, y, height + q[2]])


def planar(q: np.ndarray, lengths: tuple[float, ...]) -> Pose:
    """(2.83): links in the plane, each at the sum of the angles up to it."""
    tip = np.exp(1j * np.cumsum(q)) @ lengths
    return turn("z", float(q.sum())), np.array([tip.real, tip.imag, 0.0])


BUILDERS: dict[str, Callable[..., Robot]] = {
    "four_bar": four_bar,
    "planar2": partial(planar_arm, (0.5, 0.5)),
    "planar3": planar_arm,
    "parallelogram": parallelogram_arm,
    "spherical": spherical_arm,
    "cylindrical": cylindrical_arm,
    "scara": scara,
    "anthropomorphic": anthropomorphic_arm,
    "spherical_wrist": spherical_wrist,
    "stanford": stanford_manipulator,
    "anthropomorphic_with_wrist": anthropomorphic_with_wrist,
    "seven_joint_arm": seven_joint_arm,
}

CASES: dict[str, tuple[Robot, Callable[[np.ndarray], Pose]]] = {
    "planar": (planar_arm((0.7, 0.2, 0.4, 0.3)), lambda q: planar(q, (0.7, 0.2, 0.4, 0.3))),
    "spherical": (spherical_arm(d2=0.3), lambda q: spherical(q, 0.3)),
    "cylindrical": (cylindrical_arm(), cylindrical),
    "scara": (scara(a1=0.6, a2=0.35, height=0.9), lambda q: scara_pose(q, 0.6, 0.35, 0.9)),
    "anthropomorphic": (anthropomorphic_arm(a2=0.6, a3=0.45), lambda q: anthropomorphic(q, 0.6, 0.45)),
    "spherical_wrist": (spherical_wrist(d6=0.2), lambda q: wrist(q, 0.2)),
    "stanford": (stanford_manipulator(d2=0.3, d6=0.15), lambda q: stanford(q, 0.3, 0.15)),
    "anthropomorphic_with_wrist": (
        anthropomorphic_with_wrist(a2=0.6, d4=0.45, d6=0.15),
        lambda q: anthropomorphic_wrist(q, 0.6, 0.45, 0.15),
    ),
    "seven_joint_arm": (
        seven_joint_arm(d3=0.45, d5=0.35, d7=0.15),
        lambda q: seven_joints(q, 0.45, 0.35, 0.15),
    ),
}


@pytest.mark.parametrize("name", sorted(CASES))
def test_the_tip_is_where_the_textbook_puts_it(name: str) -> None:
    """R and p of Sect. 2.9 to 1e-12 at 200 random postures, and at 50 whose joints are multiples of π/2."""
    of, expected = CASES[name]
    rng, at = np.random.default_rng(0), Configuration(of, np.zeros(of.nq))
    postures = [*rng.uniform(-np.pi, np.pi, size=(200, of.nq)), *rng.choice(QUARTERS, size=(50, of.nq))]
    for q in postures:
        at.update(q)
        R, p = expected(q)
        np.testing.assert_allclose(at.pose("tip")[:3, :3], R, rtol=0, atol=1e-12)
        np.testing.assert_allclose(at.pose("tip")[:3, 3], p, rtol=0, atol=1e-12)


def test_the_parallelogram_closes_where_opposite_links_are_parallel() -> None:
    """With ϑ₂' = ϑ₁'' − ϑ₁' and ϑ₃' = π − ϑ₂' the loop is closed, and the tip is that of (2.64)."""
    a1, a2, a4 = 0.25, 0.6, 0.4
    of = parallelogram_arm(a1=a1, a2=a2, a4=a4)
    for first, last in np.random.default_rng(1).uniform(-np.pi, np.pi, size=(200, 2)):
        at = Configuration(of, [first, last - first, np.pi - last + first, last])
        np.testing.assert_allclose(at.pose("loop_a")[:3, 3], at.pose("loop_b")[:3, 3], rtol=0, atol=1e-14)
        tip = a2 * np.exp(1j * last) - a4 * np.exp(1j * first)
        np.testing.assert_allclose(at.pose("tip")[:3, 3], [tip.real, tip.imag, 0.0], rtol=0, atol=1e-14)
    open_loop = Configuration(of, [0.3, 0.4, 0.5, 0.6])
    ends = np.exp(1j * np.array([0.3, 0.7, 1.2])) @ [a1, a2, a1], a2 * np.exp(0.6j)
    for frame, end in zip(("loop_a", "loop_b"), ends, strict=True):
        np.testing.assert_allclose(open_loop.pose(frame)[:3, 3], [end.real, end.imag, 0.0], atol=1e-14)


def test_the_closed_posture_of_the_parallelogram_is_closed() -> None:
    """The frames at which the loop was cut meet there, for any dimensions."""
    of = parallelogram_arm(a1=0.3, a2=0.7, a4=0.1)
    at = Configuration(of, of.posture("closed"))
    np.testing.assert_allclose(at.pose("loop_a")[:3, 3], at.pose("loop_b")[:3, 3], rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", sorted(ARMS))
def test_an_arm_by_name_is_free_and_every_joint_carries_a_capsule(name: str) -> None:
    """No limits unless they are given, and at least one shape of the default radius on each joint."""
    of = Robot.load(name)
    assert of.name == name
    assert np.isneginf(of.position_lower).all()
    assert np.isposinf([of.position_upper, of.velocity_limit]).all()
    carriers = {shape.parentJoint for shape in of.geometry.geometryObjects}
    assert carriers == set(range(1, of.nq + 1))
    assert len({shape.geometry.radius for shape in of.geometry.geometryObjects}) == 1


@pytest.mark.parametrize("name", sorted(ARMS))
def test_limits_are_taken_for_all_joints_or_one_for_each(name: str) -> None:
    """Positions and velocities arrive at the joints in their order; another number of them is refused."""
    n, make = Robot.load(name).nq, BUILDERS[name]
    each = 1.0 + np.arange(n)
    of = make(lower=-each, upper=2.0 * each, velocity=3.0, radius=0.02)
    np.testing.assert_array_equal(of.position_lower, -each)
    np.testing.assert_array_equal(of.position_upper, 2.0 * each)
    np.testing.assert_array_equal(of.velocity_limit, np.full(n, 3.0))
    assert {shape.geometry.radius for shape in of.geometry.geometryObjects} == {0.02}
    with pytest.raises(InvalidValue, match=f"upper must have shape {n}, got {n + 1}"):
        make(upper=[*each, 1.0])


DEFAULTS: dict[str, Callable[[np.ndarray], Pose]] = {
    "planar2": lambda q: planar(q, (0.5, 0.5)),
    "planar3": lambda q: planar(q, (0.5, 0.5, 0.5)),
    "spherical": lambda q: spherical(q, 0.2),
    "cylindrical": cylindrical,
    "scara": lambda q: scara_pose(q, 0.5, 0.5, 1.0),
    "anthropomorphic": lambda q: anthropomorphic(q, 0.5, 0.5),
    "spherical_wrist": lambda q: wrist(q, 0.1),
    "stanford": lambda q: stanford(q, 0.2, 0.1),
    "anthropomorphic_with_wrist": lambda q: anthropomorphic_wrist(q, 0.5, 0.5, 0.1),
    "seven_joint_arm": lambda q: seven_joints(q, 0.4, 0.4, 0.1),
}


@pytest.mark.parametrize("name", sorted(DEFAULTS))
def test_an_arm_by_name_has_the_lengths_that_its_function_shows(name: str) -> None:
    """Robots by name are those of the functions without arguments, so that recorded runs keep their arm."""
    of = Robot.load(name)
    q = 0.3 + 0.2 * np.arange(of.nq)
    np.testing.assert_allclose(Configuration(of, q).pose("tip")[:3, 3], DEFAULTS[name](q)[1], atol=1e-12)


def test_the_parallelogram_by_name() -> None:
    """Links of 0.2 m and 0.5 m, and the tip 0.5 m beyond the point where the loop closes."""
    at = Configuration(Robot.load("parallelogram"), [0.3, 0.5, np.pi - 0.5, 0.8])
    tip = 0.5 * np.exp(0.8j) - 0.5 * np.exp(0.3j)
    np.testing.assert_allclose(at.pose("tip")[:3, 3], [tip.real, tip.imag, 0.0], atol=1e-12)
    loop = 0.5 * np.exp(0.8j)
    np.testing.assert_allclose(at.pose("loop_a")[:3, 3], [loop.real, loop.imag, 0.0], atol=1e-12)
    inner = 0.2 * np.exp(0.3j)
    np.testing.assert_allclose(at.pose("link1'")[:3, 3], [inner.real, inner.imag, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "reach"), [("spherical", -0.5), ("cylindrical", -0.5), ("stanford", -0.5), ("scara", 1.0)]
)
def test_a_prismatic_joint_slides_a_rod(name: str, reach: float) -> None:
    """The rod is one capsule that ends at the new frame and leaves it along z, away from what it carries."""
    of = Robot.load(name)
    slide = 3  # the third joint of all four
    (rod,) = [shape for shape in of.geometry.geometryObjects if shape.parentJoint == slide]
    half = np.array([0.0, 0.0, rod.geometry.halfLength])
    ends = [rod.placement.act(end)[2] for end in (half, -half)]
    np.testing.assert_allclose(sorted(ends), sorted([0.0, reach]), atol=1e-14)


def test_the_default_radius_is_a_share_of_the_longest_length() -> None:
    """6 % of it, and 3 cm for a wrist without any length."""
    radius = [shape.geometry.radius for shape in planar_arm((0.2, 0.4)).geometry.geometryObjects]
    np.testing.assert_allclose(radius, 0.024, atol=1e-15)
    radius = [shape.geometry.radius for shape in spherical_wrist(d6=0.0).geometry.geometryObjects]
    np.testing.assert_allclose(radius, 0.03, atol=1e-15)
    radius = [shape.geometry.radius for shape in scara(height=2.0).geometry.geometryObjects]
    np.testing.assert_allclose(radius, 0.12, atol=1e-15)
