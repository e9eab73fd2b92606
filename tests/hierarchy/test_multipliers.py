"""Anybody's x can be certified, and is refused where it is wrong."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.errors import InvalidValue
from taskopt.hierarchy.certificate import certify
from taskopt.hierarchy.multipliers import certify_velocity, find_multipliers
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.tolerances import AT_BOUND, KKT_MET
from tests.helpers.oracles import KINDS, lexicographic_optimum, random_hierarchy

SEEDS = st.integers(0, 2**32 - 1)


@pytest.mark.slow
@given(SEEDS)
def test_the_exact_optimum_is_proven_from_x_alone(seed: int) -> None:
    """Multipliers exist at a lexicographic optimum, and are found."""
    hierarchy = random_hierarchy(seed)
    assert certify_velocity(hierarchy, lexicographic_optimum(hierarchy)).worst < 1e-11


@pytest.mark.slow
@given(SEEDS)
def test_no_multipliers_can_be_found_for_a_wrong_x(seed: int) -> None:
    """1e-4 away from the optimum there is no proof to be had."""
    hierarchy = random_hierarchy(seed)
    away = 1e-4 * np.random.default_rng(seed).normal(size=hierarchy.n)
    assert not certify_velocity(hierarchy, lexicographic_optimum(hierarchy) + away).kkt_met()


@pytest.mark.parametrize("kind", KINDS)
def test_a_flipped_multiplier_of_a_limit_is_refused(kind: str) -> None:
    """Turning the sign of what a bound costs breaks stationarity or sign, at its level."""
    flipped = 0
    for seed in range(40):
        hierarchy = random_hierarchy(seed, kind)
        x = lexicographic_optimum(hierarchy)
        y = find_multipliers(hierarchy, x)
        level, column = np.unravel_index(np.argmax(np.abs(y)), y.shape)
        if abs(y[level, column]) > 1e-3:
            y[level, column] *= -1.0
            flipped += 1
            assert not certify(hierarchy, x, y).kkt_met()
    assert flipped > 10


def test_the_multiplier_is_the_derivative_of_the_cost() -> None:
    """Moving the bound that x ≤ 1 sets by 1e-6 changes the cost of level 1 by −y."""
    costs = []
    for limit in (1.0, 1.0 + 1e-6):
        hierarchy = Hierarchy([Level([[2.0]], [6.0], weight=3.0)], box=([-5.0], [limit]))
        costs.append(hierarchy.levels[0].cost(np.array([limit])))
    hierarchy = Hierarchy([Level([[2.0]], [6.0], weight=3.0)], box=([-5.0], [1.0]))
    multiplier = find_multipliers(hierarchy, np.array([1.0]))[0, 0]
    assert multiplier == pytest.approx(-(costs[1] - costs[0]) / 1e-6, rel=1e-5)


def test_rows_that_agree_but_for_noise_take_no_huge_multipliers() -> None:
    """Dependent to 1e-13, they could fit any gradient, by multipliers of 1e13."""
    rng = np.random.default_rng(0)
    for _ in range(40):
        row = rng.normal(size=4)
        pair = [Level([row], [1.0]), Level([row + 1e-13 * rng.normal(size=4)], [1.0])]
        hierarchy = Hierarchy([*pair, Level(np.eye(4), rng.normal(size=4))])
        x = row / (row @ row)
        lie = x + 0.1 * np.linalg.svd([row])[2][-1]
        assert np.abs(find_multipliers(hierarchy, lie)).max() < 1e3
        assert not certify_velocity(hierarchy, lie).kkt_met()


def test_only_the_bound_that_is_met_has_a_price() -> None:
    """x ≤ ½ + 5e-8 beside x ≤ ½: the first could take the multiplier, and the certificate refuses it."""
    assert AT_BOUND <= KKT_MET
    near = Hierarchy([Level([[1.0]], [2.0])], box=([-1.0], [0.5 + 5e-8]), limits=Level([[1.0]], upper=[0.5]))
    y = find_multipliers(near, np.array([0.5]))
    np.testing.assert_allclose(y[0, :2], [0.0, 1.5], atol=1e-12)
    assert certify_velocity(near, [0.5]).kkt_met()
    y[:, [0, 1]] = y[:, [1, 0]]
    assert not certify(near, np.array([0.5]), y).kkt_met()


def test_arrays_that_are_no_velocity_are_refused() -> None:
    """A wrong size and NaN, each by name."""
    hierarchy = Hierarchy([Level([[1.0, 0.0]], [1.0])])
    with pytest.raises(InvalidValue, match="x must have shape 2, got 3"):
        certify_velocity(hierarchy, np.zeros(3))
    with pytest.raises(InvalidValue, match="x has NaN"):
        certify_velocity(hierarchy, [np.nan, 0.0])


def test_a_violated_row_takes_either_sign() -> None:
    """x ≥ 1 violates level 1 by 1e-7; level 2 (x = 5) must keep that, and only the violated row holds it."""
    levels = [Level([[1.0]], upper=[1.0 - 1e-7]), Level([[1.0]], [5.0])]
    hierarchy = Hierarchy(levels, box=([1.0], [9.0]))
    assert find_multipliers(hierarchy, np.ones(1))[1, 1] == pytest.approx(4.0)
    assert certify_velocity(hierarchy, [1.0]).kkt_met()


def test_noise_of_a_solver_is_no_violation() -> None:
    """x₀ ≤ x₁ is missed by 1e-10; were its sign free, the fit would find a multiplier of the wrong sign."""
    levels = [Level([[1.0, -1.0]], upper=[0.0]), Level(np.eye(2), [2.0, 3.0])]
    hierarchy = Hierarchy(levels, box=([-9.0, -9.0], [1.0, 1.0]))
    assert certify_velocity(hierarchy, [1.0, 1.0 - 1e-10]).kkt_met()


@pytest.mark.parametrize("distance", [1e-9, -1e-9])
def test_a_bound_that_a_solver_meets_to_1e_9_takes_its_multiplier(distance: float) -> None:
    """x ≤ 1 stops x = 3, with the multiplier 2."""
    hierarchy = Hierarchy([Level([[1.0]], [3.0])], box=([-5.0], [1.0]))
    assert find_multipliers(hierarchy, np.array([1.0 + distance]))[0, 0] == pytest.approx(2.0)
    assert certify_velocity(hierarchy, [1.0 + distance]).kkt_met()


def test_small_units_take_small_multipliers() -> None:
    """1e-6 x = 2e-6 inside x ≤ 1 has the gradient −1e-12, and x = 1 is its optimum all the same."""
    hierarchy = Hierarchy([Level([[1e-6]], [2e-6])], box=([-5.0], [1.0]))
    assert find_multipliers(hierarchy, np.ones(1))[0, 0] == pytest.approx(1e-12)
    assert certify_velocity(hierarchy, [1.0]).kkt_met()


def test_rounding_takes_no_multipliers() -> None:
    """A gradient of 1e-14 beside terms of 1 is none."""
    hierarchy = Hierarchy([Level([[1.0]], [1.0 + 1e-14])], box=([-5.0], [1.0]))
    assert not find_multipliers(hierarchy, np.ones(1))[0].any()


@pytest.mark.parametrize("angle", [1e-2, 1e-5, 1e-7])
def test_rows_near_a_singularity_take_large_multipliers(angle: float) -> None:
    """x₀ = 0 and x₀ + angle x₁ = 0 hold x₁ = 1 back with the multipliers ∓1/angle."""
    levels = [Level([[1.0, 0.0]], [0.0]), Level([[1.0, angle]], [0.0]), Level([[0.0, 1.0]], [1.0])]
    y = find_multipliers(Hierarchy(levels), np.zeros(2))
    np.testing.assert_allclose(y[2, 2:4] * angle, [-1.0, 1.0], rtol=1e-6)


def test_a_gradient_of_equalities_and_bounds_is_shared() -> None:
    """x₀ + x₁ = 0 and x₀ ≤ 1e-9: level 2 (x₁ = −1) is held back by both, however close x stands to zero."""
    levels = [Level([[1.0, 1.0]], [0.0]), Level([[0.0, 1.0]], [-1.0])]
    hierarchy = Hierarchy(levels, box=([-9.0, -9.0], [1e-9, 9.0]))
    y = find_multipliers(hierarchy, np.array([1e-9, -1e-9]))
    np.testing.assert_allclose(y[1, [0, 2]], [1.0, -1.0], rtol=1e-6)


def test_small_multipliers_of_bounds_are_fitted_beside_large_ones_of_equalities() -> None:
    """Hard x₀ = 0 takes 1 of the gradient, and x₁ ≤ 0 the 1e-10 that are left."""
    level = Level(np.eye(2), [1.0, 1e-10])
    hierarchy = Hierarchy([level], box=([-9.0, -9.0], [9.0, 0.0]), limits=Level([[1.0, 0.0]], [0.0]))
    np.testing.assert_allclose(find_multipliers(hierarchy, np.zeros(2))[0, [1, 2]], [1e-10, 1.0], rtol=1e-9)


def test_rounding_that_equalities_leave_takes_no_multipliers_of_bounds() -> None:
    """A hard equality takes the whole gradient, so that bounds that are met take nothing, to the last bit."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        row = rng.normal(size=3)
        hierarchy = Hierarchy([Level([row], [1.0])], box=([0.0] * 3, [9.0] * 3), limits=Level([row], [0.0]))
        assert not find_multipliers(hierarchy, np.zeros(3))[0, :3].any()


def test_a_violated_hard_row_keeps_its_sign() -> None:
    """x ≤ 1 is met to the accuracy of a solver (5e-9) and cannot pull x = 0 away from zero."""
    for limit in ({"box": ([-9.0], [1.0])}, {"limits": Level([[1.0]], upper=[1.0])}):
        hierarchy = Hierarchy([Level([[1.0]], [0.0])], **limit)
        assert not find_multipliers(hierarchy, np.array([1.0 + 5e-9]))[0].any()


@pytest.mark.parametrize("size", [1.0, 1e4])
def test_bounds_and_violations_are_relative_to_the_largest_term(size: float) -> None:
    """In µm as in m: a bound met to 1e-9 takes its multiplier, a row missed by 1e-10 stays one-sided."""
    bounded = Hierarchy([Level([[1.0]], [3.0 * size])], box=([-5.0 * size], [size]))
    assert certify_velocity(bounded, [size * (1.0 - 1e-9)]).kkt_met()
    levels = [Level([[1.0, -1.0]], upper=[0.0]), Level(np.eye(2), [2.0 * size, 3.0 * size])]
    hierarchy = Hierarchy(levels, box=([-9.0 * size] * 2, [size] * 2))
    assert certify_velocity(hierarchy, [size, size * (1.0 - 1e-10)]).kkt_met()
