"""Denavit–Hartenberg arms against formulas written by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.errors import InvalidValue
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.pose import exp6, homogeneous
from taskopt.kinematics.robot import DHRow, Robot, planar_arm

ANGLES = st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3)


def dh(a: float, alpha: float, d: float, theta: float) -> np.ndarray:
    """(2.52), as the product of its four motions."""

    def turn(axis: int, angle: float) -> np.ndarray:
        return exp6(np.eye(6)[3 + axis] * angle)

    def shift(axis: int, length: float) -> np.ndarray:
        return exp6(np.eye(6)[axis] * length)

    return turn(2, theta) @ shift(2, d) @ shift(0, a) @ turn(0, alpha)


@pytest.mark.slow
@given(q=ANGLES)
def test_the_planar_arm_is_the_textbooks(q):
    """(2.83): x = Σ aᵢ cos(ϑ₁ + … + ϑᵢ), y with the sine, orientation ϑ₁ + ϑ₂ + ϑ₃; Jacobian (3.35)."""
    a, sums = np.array([0.5, 0.3, 0.2]), np.cumsum(q)
    at = Configuration(planar_arm(a), q)
    T, J = at.pose("tip"), at.jacobian("tip")
    np.testing.assert_allclose(T[:3, 3], [a @ np.cos(sums), a @ np.sin(sums), 0.0], rtol=0, atol=1e-14)
    np.testing.assert_allclose(T[:3, 0], [np.cos(sums[2]), np.sin(sums[2]), 0.0], rtol=0, atol=1e-14)
    expected = [
        [-(a * np.sin(sums))[i:].sum() for i in range(3)],
        [(a * np.cos(sums))[i:].sum() for i in range(3)],
    ]
    np.testing.assert_allclose(J[:2], expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(J[2:], np.vstack([np.zeros((3, 3)), np.ones(3)]), rtol=0, atol=1e-15)


@pytest.mark.slow
@pytest.mark.equation("3.31", "3.32", "3.33")
@given(seed=st.integers(0, 2**32 - 1))
def test_any_rows_give_the_product_of_their_matrices(seed):
    """T = base A₁ A₂ … tool, frame link i after i of them, for revolute and prismatic joints in any order."""
    rng = np.random.default_rng(seed)
    rows = [
        DHRow(*rng.uniform(-1.5, 1.5, 4), joint=rng.choice(["revolute", "prismatic"]))
        for _ in range(rng.integers(1, 6))
    ]
    base, tool = exp6(rng.normal(size=6)), exp6(rng.normal(size=6))
    q = rng.uniform(-2, 2, len(rows))
    at = Configuration(Robot.from_dh(rows, base=base, tool=tool), q)
    T = base
    for i, (row, q_i) in enumerate(zip(rows, q, strict=True), start=1):
        turns = row.joint == "revolute"
        T = T @ dh(row.a, row.alpha, row.d + (0 if turns else q_i), row.theta + (q_i if turns else 0))
        np.testing.assert_allclose(at.pose(f"link{i}"), T, rtol=0, atol=1e-12)
    np.testing.assert_allclose(at.pose("tip"), T @ tool, rtol=0, atol=1e-12)


def test_capsules_run_from_joint_to_joint():
    """Each link of the planar arm is one capsule of its length, whose ends are the joints."""
    arm = planar_arm((0.5, 0.3), radius=0.02)
    assert [shape.name for shape in arm.geometry.geometryObjects] == ["link1_0", "link2_0"]
    for shape, length in zip(arm.visual.geometryObjects, (0.5, 0.3), strict=True):
        assert shape.geometry.radius == 0.02
        assert 2 * shape.geometry.halfLength == pytest.approx(length, abs=1e-15)
        end = shape.placement.homogeneous @ [0, 0, shape.geometry.halfLength, 1]
        start = shape.placement.homogeneous @ [0, 0, -shape.geometry.halfLength, 1]
        np.testing.assert_allclose([start[:3], end[:3]], [[0, 0, 0], [length, 0, 0]], rtol=0, atol=1e-15)


def test_an_offset_and_a_length_give_two_capsules_and_a_wrist_a_ball():
    """A link follows d along z, then a along x; where both are zero a ball shows the joint."""
    arm = Robot.from_dh([DHRow(0.3, 1.0, 0.4, 0.0), DHRow(0.0, 0.5, 0.0, 0.0)])
    shapes = {shape.name: 2 * shape.geometry.halfLength for shape in arm.geometry.geometryObjects}
    assert shapes == pytest.approx({"link1_0": 0.4, "link1_1": 0.3, "link2_0": 0.0})


def test_limits_are_those_of_the_rows():
    """Without any: infinite, for positions and velocities; planar_arm takes one for all, or one a joint."""
    free = planar_arm()
    assert np.isinf([free.position_lower, free.position_upper, free.velocity_limit]).all()
    bounded = planar_arm(lower=-1, upper=[1, 2, np.inf], velocity=3.0)
    np.testing.assert_array_equal(bounded.position_lower, [-1, -1, -1])
    np.testing.assert_array_equal(bounded.position_upper, [1, 2, np.inf])
    np.testing.assert_array_equal(bounded.velocity_limit, [3, 3, 3])


def test_a_prismatic_joint_is_in_metres():
    """Units follow the joint's type."""
    arm = Robot.from_dh([DHRow(0.1, 0.0, 0.0, 0.0), DHRow(0.0, 0.0, 0.1, 0.0, joint="prismatic")])
    assert arm.coordinate_units == ("rad", "m")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: DHRow(np.nan, 0, 0, 0), "a of a Denavit–Hartenberg row has NaN"),
        (lambda: DHRow("x", 0, 0, 0), "a of a Denavit–Hartenberg row must be numbers"),
        (lambda: DHRow(1, 0, 0, 0, joint="screw"), "'revolute' or 'prismatic', got 'screw'"),
        (lambda: DHRow(1, 0, 0, 0, lower=1, upper=0), "lower must be ≤ upper"),
        (lambda: DHRow(1, 0, 0, 0, velocity=0), "velocity must be > 0"),
        (lambda: Robot.from_dh([]), "at least one"),
        (lambda: planar_arm(lower=[1, 2]), "lower must have shape 3, got 2"),
        (lambda: planar_arm(radius=-1), "radius must be > 0"),
        (lambda: Robot.from_dh([DHRow(1, 0, 0, 0)], base=2 * np.eye(4)), "base is not a rotation"),
    ],
)
def test_bad_rows_are_named(make, said):
    """What is wrong, what was got."""
    with pytest.raises(InvalidValue, match=said):
        make()


def test_the_base_places_the_whole_arm():
    """A planar arm stood upright moves in the x-z plane."""
    upright = homogeneous([[1, 0, 0], [0, 0, -1], [0, 1, 0]], [0, 0, 0])
    arm = Robot.from_dh([DHRow(0.5, 0, 0, 0)], base=upright)
    np.testing.assert_allclose(
        Configuration(arm, [np.pi / 2]).pose("tip")[:3, 3], [0, 0, 0.5], rtol=0, atol=1e-15
    )
