"""The drop rule of the search, and what its second part leaves behind."""

import numpy as np

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.status import Status
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.active_set.search import search
from taskopt.resolver.active_set.workspace import Outcome
from taskopt.resolver.base import Memory


def test_a_bound_that_an_earlier_level_needs_is_not_dropped_for_a_later_one() -> None:
    """x₁ = 2 above x₁ = 0 with x₁ ≤ 1: the bound has the right sign at level 1, the wrong one at level 2.

    The first working set violates the bound, and the second one is the final one: two factorisations.
    """
    hierarchy = Hierarchy([Level([[1.0]], [2.0]), Level([[1.0]], [0.0])], box=([-1.0], [1.0]))
    resolution, _ = ActiveSet(fast_path=False)(hierarchy)
    assert resolution.status is Status.SOLVED
    np.testing.assert_array_equal(resolution.x, [1.0])
    assert resolution.iterations == 2


def test_the_second_search_ends_on_the_bounds_as_declared() -> None:
    """x = (2, 2) with x₁ + x₂ ≤ 1, one factorisation for the guess: the perturbation is out of the answer."""
    hierarchy = Hierarchy([Level(np.eye(2), [2.0, 2.0])], limits=Level([[1.0, 1.0]], upper=[1.0]))
    x, state = np.zeros(2), np.zeros(5, np.int8)
    multipliers = np.zeros((2, 5))
    outcome, *_ = search(hierarchy.rows, state, x, multipliers, np.int64(1), 100, 0.0)
    assert outcome == Outcome.SOLVED
    np.testing.assert_allclose(x, [0.5, 0.5], rtol=0, atol=1e-13)


def test_a_wrong_sign_of_one_part_in_ten_billion_is_seen() -> None:
    """x₁ = 1 and x₁ + 1e-5 x₂ = 1 + 1e-10 are met at x₂ = 1e-5; the guess holds x₂ at its bound 0.

    There, residuals are 1e-10 of what they are the differences of, and rounding is 1e-16 of it.
    """
    hierarchy = Hierarchy(
        [Level([[1.0, 0.0], [1.0, 1e-5]], [1.0, 1.0 + 1e-10])], box=([-9.0, 0.0], [9.0, 9.0])
    )
    guess = Memory(np.array([0, -1, 0, 0], dtype=np.int8))
    resolution, _ = ActiveSet(fast_path=False)(hierarchy, guess)
    np.testing.assert_allclose(resolution.x, [1.0, 1e-5], rtol=0, atol=1e-9)
