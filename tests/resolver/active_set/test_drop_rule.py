"""The drop rule of the search: the first level with a multiplier decides for all levels after it."""

import numpy as np

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.status import Status
from taskopt.resolver.active_set.resolver import ActiveSet


def test_a_bound_that_an_earlier_level_needs_is_not_dropped_for_a_later_one() -> None:
    """x₁ = 2 above x₁ = 0 with x₁ ≤ 1: the bound has the right sign at level 1, the wrong one at level 2.

    The first working set violates the bound, and the second one is the final one: two factorisations.
    """
    hierarchy = Hierarchy([Level([[1.0]], [2.0]), Level([[1.0]], [0.0])], box=([-1.0], [1.0]))
    resolution, _ = ActiveSet(fast_path=False)(hierarchy)
    assert resolution.status is Status.SOLVED
    np.testing.assert_array_equal(resolution.x, [1.0])
    assert resolution.iterations == 2
