"""Gradients against central differences, values against formulas, and how objectives combine."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.arrays import Array
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective import JointRange, Manipulability, Objective, UserFunction
from taskopt.kinematics.robot import planar_arm
from tests.helpers.differences import derivative
from tests.helpers.robots import FRAMES, random_configuration, robot

SEEDS = st.integers(0, 2**32 - 1)


@dataclass(frozen=True)
class Sines(Objective):
    """½(s₂² + s₃²), the text's own measure for the planar arm (Sect. 3.7.5)."""

    def value(self, at: Configuration) -> float:
        return 0.5 * float(np.sin(at.q[1]) ** 2 + np.sin(at.q[2]) ** 2)

    def gradient(self, at: Configuration) -> Array:
        return np.array([0.0, *(np.sin(at.q[1:3]) * np.cos(at.q[1:3]))])


def assert_gradient(objective: Objective, at: Configuration) -> None:
    """To 1e-7 of the largest slope: the limit is what a central difference of this step can see."""
    numeric = derivative(objective.value, at)
    scale = np.abs(numeric).max()
    np.testing.assert_allclose(objective.gradient(at), numeric, rtol=0, atol=1e-7 * scale)


@pytest.mark.slow
@pytest.mark.parametrize("axes", ["xy", "xyz", "xyz rpy", "xy y", "z r"])
@pytest.mark.parametrize("name", FRAMES)
def test_the_gradient_of_manipulability_is_its_derivative(name, axes):
    """∂w/∂q = w tr(∂J Jᵀ (J Jᵀ)⁻¹) wherever w > 0, for all rows and for some."""
    if name == "planar" and axes != "xy":
        axes = "xy y" if axes == "xyz" else "xy"
    for seed in range(3):
        assert_gradient(Manipulability(FRAMES[name], axes), random_configuration(name, seed))


@pytest.mark.equation("3.56")
@pytest.mark.parametrize("name", FRAMES)
def test_manipulability_is_the_root_of_the_determinant(name):
    """w = √det(J Jᵀ) (3.56), by NumPy's determinant."""
    axes, rows = ("xy", [0, 1]) if name == "planar" else ("xyz rpy", range(6))
    for seed in range(5):
        at = random_configuration(name, seed)
        J = at.jacobian(FRAMES[name])[list(rows)]
        w = Manipulability(FRAMES[name], axes).value(at)
        np.testing.assert_allclose(w, np.sqrt(np.linalg.det(J @ J.T)), rtol=1e-9)


def test_manipulability_of_two_links_is_the_textbooks():
    """w = a₁ a₂ |sin ϑ₂| (Example 3.5), with gradient along ϑ₂ only."""
    arm = planar_arm((0.7, 0.4))
    for bend in (0.3, 1.2, -2.5):
        at = Configuration(arm, [0.4, bend])
        assert Manipulability("tip", "xy").value(at) == pytest.approx(0.28 * abs(np.sin(bend)), rel=1e-13)
        slope = 0.28 * np.cos(bend) * np.sign(np.sin(bend))
        np.testing.assert_allclose(Manipulability("tip", "xy").gradient(at), [0.0, slope], rtol=0, atol=1e-14)


@pytest.mark.parametrize("bend", [1e-3, 1e-6, 1e-9, 1e-12])
def test_near_a_singularity_the_gradient_stays_exact(bend):
    """The slope of a₁ a₂ |sin ϑ₂| keeps its digits as w goes to zero, where (J Jᵀ)⁻¹ has lost them."""
    at = Configuration(planar_arm((0.7, 0.4)), [0.4, bend])
    np.testing.assert_allclose(
        Manipulability("tip", "xy").gradient(at), [0.0, 0.28 * np.cos(bend)], rtol=0, atol=1e-12
    )
    J = at.jacobian("tip")[:2]
    if bend <= 1e-6:
        assert np.abs(J @ J.T @ np.linalg.inv(J @ J.T) - np.eye(2)).max() > 1e-6


@pytest.mark.parametrize("q", [[0.0, 0.0], [0.4, 0.0], [0.4, np.pi]])
def test_in_a_singularity_the_gradient_is_a_slope_to_one_side(q):
    """At w = 0 the gradient is finite, and climbing along it raises w at the rate that it says."""
    arm = planar_arm((0.7, 0.4))
    at, w = Configuration(arm, q), Manipulability("tip", "xy")
    g = w.gradient(at)
    assert w.value(at) < 1e-15
    assert np.linalg.norm(g) == pytest.approx(0.28, rel=1e-9)
    ahead = w.value(Configuration(arm, at.q + 1e-6 * g))
    assert ahead == pytest.approx(1e-6 * g @ g, rel=1e-6)


def test_where_two_singular_values_vanish_the_gradient_is_zero():
    """w is of second order there, as for position and yaw of two coinciding, stretched joints."""
    arm = planar_arm((0.5, 0.0, 0.0))
    at = Configuration(arm, [0.3, 0.2, 0.1])
    np.testing.assert_allclose(Manipulability("tip", "xy y").gradient(at), 0.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("length", [0.0, 1e-320, 1e-300, 1e-162, 1e-154, 1e-100, 1e-16, 1e-3])
def test_rows_that_are_almost_parallel_have_the_gradient_of_the_closed_form(length):
    """w = a₁ a₂ |sin ϑ₂| for position and yaw, down to lengths a₂ whose squares underflow.

    The three rows of J become parallel to each other as a₂ goes to zero; their cosines are found from squares
    that underflow, and the angle between them from a quotient whose square overflows.
    """
    arm = planar_arm((0.5, length, 0.0))
    for q in ([0.3, 0.2, 0.1], [0.4, 1.1, 0.7], [-1.0, 2.0, 0.3]):
        slope = 0.5 * length * np.cos(q[1]) * np.sign(np.sin(q[1]))
        gradient = Manipulability("tip", "xy y").gradient(Configuration(arm, q))
        np.testing.assert_allclose(gradient, [0.0, slope, 0.0], rtol=0, atol=1e-14)


def test_more_axes_than_joints_is_refused():
    """A manipulability that is zero everywhere says so, with the way out."""
    with pytest.raises(InvalidValue, match=r"only 3 joint\(s\) move it; choose fewer axes"):
        Manipulability("tip").value(random_configuration("planar3", 0))


@pytest.mark.slow
@pytest.mark.parametrize("name", FRAMES)
def test_the_gradient_of_joint_range_is_its_derivative(name):
    """(3.57) by differences, wheels and floating base left out; the planar arm gets its limits by hand."""
    for seed in range(3):
        at = random_configuration(name, seed)
        if name == "planar":
            assert_gradient(JointRange(lower=[-6.0, -1.5, -4.0], upper=[6.0, 1.5, -1.0]), at)
            continue
        assert_gradient(JointRange(), at)
        assert (JointRange().gradient(at)[at.robot.position_index < 0] == 0.0).all()


@pytest.mark.equation("3.57")
def test_joint_range_is_the_formula_of_the_text():
    """The limits of Sect. 3.7.5, the wide range of the first joint included in n = 3."""
    lower = np.array([-2 * np.pi, -np.pi / 2, -3 * np.pi / 2])
    upper = np.array([2 * np.pi, np.pi / 2, -np.pi / 2])
    q = np.array([0.7, -0.3, -1.9])
    at = Configuration(planar_arm(), q)
    middle, width = 0.5 * (lower + upper), upper - lower
    w = JointRange(lower=lower, upper=upper)
    assert w.value(at) == pytest.approx(-1 / 6 * (((q - middle) / width) ** 2).sum(), rel=1e-14)
    np.testing.assert_allclose(w.gradient(at), -(q - middle) / (3 * width**2), rtol=1e-14)


def test_joints_without_a_range_do_not_count():
    """n is the number of joints that have both limits; a range that is locked does not count either."""
    at = Configuration(planar_arm(lower=[-1, -np.inf, 0.2], upper=[2, 1, 0.2]), [0.1, 0.9, 0.2])
    assert JointRange().value(at) == pytest.approx(-0.5 * ((0.1 - 0.5) / 3) ** 2, rel=1e-14)
    assert JointRange(lower=-1).value(at) == JointRange(["joint1", "joint2", "joint3"], lower=-1.0).value(at)


def test_joint_range_over_named_joints_moves_only_these():
    """joints= chooses by name."""
    at = random_configuration("panda", 1)
    gradient = JointRange(["panda_joint2", "panda_joint4"]).gradient(at)
    assert set(np.flatnonzero(gradient)) == {1, 3}


@pytest.mark.parametrize(
    ("objective", "error", "said"),
    [
        (JointRange(), InvalidValue, "no joint of planar3 has limits on both sides"),
        (JointRange(["joint7"]), UnknownName, "did you mean joint"),
        (JointRange(lower=1, upper=-1), InvalidValue, "lower 1 > upper -1 for joint1"),
        (JointRange(lower=[0, 1], upper=3), InvalidValue, "2 numbers for 3 joints"),
    ],
)
def test_joint_range_names_what_is_wrong(objective, error, said):
    """No limits at all, an unknown joint, crossed limits, a wrong count."""
    with pytest.raises(error, match=said):
        objective.value(random_configuration("planar3", 0))


def test_a_wheel_has_no_range():
    """A continuous joint that is asked for by name is refused by name."""
    with pytest.raises(InvalidValue, match="wheel_left_joint is a joint without range"):
        JointRange(["wheel_left_joint"]).value(random_configuration("tiago", 0))


@pytest.mark.parametrize("name", FRAMES)
def test_a_function_without_gradient_is_differentiated_on_the_manifold(name):
    """The numerical gradient is that of the exact one to ten digits, and a warning says that it is used."""
    exact = Manipulability(FRAMES[name], "xy")
    with pytest.warns(UserWarning, match="differentiated numerically"):
        numeric = UserFunction(exact.value)
    at = random_configuration(name, 2)
    np.testing.assert_allclose(
        numeric.gradient(at), exact.gradient(at), rtol=0, atol=1e-9 * (1 + exact.value(at))
    )


@pytest.mark.parametrize(
    ("function", "derivative_of", "said"),
    [
        (lambda at: np.nan, lambda at: at.q, "value of objective '<lambda>' has NaN"),
        (lambda at: at.q, lambda at: at.q, "a single number|must have shape"),
        (lambda at: 0.0, lambda at: at.q[:2], "gradient of objective"),
    ],
)
def test_what_a_user_function_returns_is_checked(function, derivative_of, said):
    """NaN, an array for a value, a gradient of the wrong length."""
    at = random_configuration("planar3", 0)
    objective = UserFunction(function, derivative_of)
    with pytest.raises(InvalidValue, match=said):
        (objective.value(at), objective.gradient(at))


@given(a=st.floats(-5, 5), b=st.floats(-5, 5), seed=SEEDS)
@settings(max_examples=20)
def test_objectives_add_and_scale(a, b, seed):
    """Value and gradient of a·w₁ + b·w₂ − w₁ are linear in both, and are each other's derivative."""
    at = random_configuration("planar3", seed)
    first, second = Sines(), Manipulability("tip", "xy")
    combined = a * first + second * b - first
    expected = (a - 1) * first.value(at) + b * second.value(at)
    assert combined.value(at) == pytest.approx(expected, abs=1e-12)
    np.testing.assert_allclose(
        combined.gradient(at), (a - 1) * first.gradient(at) + b * second.gradient(at), rtol=0, atol=1e-12
    )
    assert (np.float64(a) * first).terms == (a * first).terms
    assert sum([first, second]).value(at) == first.value(at) + second.value(at)


def test_a_wrong_gradient_is_caught():
    """The check that all objectives pass refuses one whose gradient is off by a factor of 1.000001."""

    class Wrong(Sines):
        def gradient(self, at: Configuration) -> Array:
            return 1.000001 * super().gradient(at)

    at = random_configuration("planar3", 3)
    assert_gradient(Sines(), at)
    with pytest.raises(AssertionError):
        assert_gradient(Wrong(), at)


def test_objectives_combine_with_numbers_and_objectives_only():
    """A factor that is not finite, or an addend that is no objective, is refused."""
    with pytest.raises(InvalidValue, match="factor"):
        np.inf * Sines()
    with pytest.raises(TypeError):
        Sines() + 1.0
    with pytest.raises(TypeError):
        Sines() * Sines()


def test_robots_of_the_differences_are_of_four_kinds():
    """Fixed, redundant, with endless joints, and floating: nq − nv is 0, 0, 2 and 1."""
    assert [robot(name).nq - robot(name).nv for name in FRAMES] == [0, 0, 2, 1]
