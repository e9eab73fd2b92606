"""The certificate accepts what is optimal, and catches each lie."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.hierarchy.certificate import RESIDUALS, certify
from taskopt.hierarchy.multipliers import certify_velocity
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.active_set.resolver import ActiveSet
from tests.helpers.oracles import random_hierarchy

SEEDS = st.integers(0, 2**32 - 1)
UNIT = Hierarchy([Level([[1.0]], [0.0])], box=([-np.inf], [1.0]))  # min ½x² s.t. x ≤ 1


@pytest.mark.parametrize(
    ("residual", "x", "y"),
    [
        ("stationarity", 0.5, 0.0),
        ("primal", 2.0, -2.0),
        ("dual", 1.0, -1.0),
        ("complementarity", 0.5, 0.5),
    ],
)
def test_each_residual_catches_its_own_lie(residual, x, y):
    """Minimise ½x² subject to x ≤ 1: the optimum is x = 0 with y = 0, and nothing else passes."""
    multipliers = np.array([[y, 0.0], [0.0, -x]])
    residuals = certify(UNIT, np.array([x]), multipliers).residuals[0]
    assert residuals[RESIDUALS.index(residual)] > 0.1


def test_the_optimum_passes():
    """x = 0 with no multiplier has no residual at all."""
    assert certify(UNIT, np.zeros(1), np.zeros((2, 2))).worst == 0.0


@given(SEEDS)
@settings(deadline=None, max_examples=100)
def test_any_other_point_is_refused(seed):
    """Moved by 1e-3 in any direction, an optimum is no longer proven by its multipliers."""
    hierarchy = random_hierarchy(seed)
    resolution, _ = ActiveSet()(hierarchy)
    assert resolution.certified()
    direction = np.random.default_rng(seed).standard_normal(hierarchy.n)
    moved = resolution.x + 1e-3 * direction / np.linalg.norm(direction)
    assert not certify(hierarchy, moved, resolution.multipliers).proves()


@given(SEEDS)
@settings(deadline=None, max_examples=100)
def test_a_wrong_sign_of_any_multiplier_is_caught(seed):
    """Each multiplier that matters, turned round at the level where it first counts, is refused."""
    hierarchy = random_hierarchy(seed)
    resolution, _ = ActiveSet()(hierarchy)
    problem = resolution.problem
    equal = np.concatenate([problem.box_lower == problem.box_upper, problem.lower == problem.upper])
    for column in np.flatnonzero((resolution.state != 0) & ~equal):
        prices = resolution.multipliers[:, column]
        level = int(np.argmax(np.abs(prices) > 1e-6))
        own = problem.layout.offsets[level + 1] + problem.n <= column
        if abs(prices[level]) > 1e-6 and not own:
            wrong = resolution.multipliers.copy()
            wrong[level, column] *= -1.0
            assert not certify(hierarchy, resolution.x, wrong).proves()


def test_a_row_that_was_needed_by_an_earlier_level_may_pull_either_way_later():
    """x ≤ 1 stops level 1 (x = 2); level 2 (x = 0) then pushes the other way, and that is optimal."""
    hierarchy = Hierarchy([Level([[1.0]], [2.0]), Level([[1.0]], [0.0])], box=([-5.0], [1.0]))
    x = np.array([1.0])
    multipliers = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0]])
    assert certify(hierarchy, x, multipliers).proves()


def test_levels_in_the_wrong_order_are_refused():
    """The optimum of the swapped hierarchy is not proven for this one by any sign of multipliers."""
    first, second = Level([[1.0, 0.0]], [1.0]), Level([[1.0, 0.0]], [0.0])
    answer, _ = ActiveSet()(Hierarchy([second, first]))
    assert not certify(Hierarchy([first, second]), answer.x, answer.multipliers).proves()


def test_multipliers_that_cancel_prove_nothing():
    """Two equal rows with prices ±1e12 are stationary whatever x is; level 3 still wants x₁ = 1."""
    same = Level([[1.0, 0.0]], [0.0])
    hierarchy = Hierarchy([same, same, Level([[0.0, 1.0]], [1.0])])
    multipliers = np.zeros((4, 5))
    multipliers[2:, 2], multipliers[2:, 3] = 1e12, -1e12
    multipliers[3, 4] = -0.5
    certificate = certify(hierarchy, np.array([0.0, 0.5]), multipliers)
    assert not certificate.proves()
    assert certificate.worst_name == "stationarity of level 3"


@pytest.mark.parametrize("unit", [1e-8, 1e-5, 1.0, 1e5])
def test_a_lie_is_one_in_any_unit(unit):
    """Rows in other units make gradients small or large; x₀ = 0.2 where 1 is wanted is wrong in all."""
    hierarchy = Hierarchy([Level([[unit, 0.0]], [unit]), Level([[0.0, 1.0]], [1.0])])
    assert not certify_velocity(hierarchy, [0.2, 1.0]).proves()
    assert certify_velocity(hierarchy, [1.0, 1.0]).proves()


def test_not_a_number_is_never_a_proof():
    """NaN has an infinite residual."""
    assert certify(UNIT, np.array([np.nan]), np.zeros((2, 2))).worst == np.inf
