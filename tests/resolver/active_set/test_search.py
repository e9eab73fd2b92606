"""The search where rounding would decide: multipliers near zero, bounds that tie, rows that are tiny."""

import numpy as np
import pytest

from taskopt import Hierarchy, Level
from taskopt.hierarchy.status import Status
from taskopt.resolver.active_set.resolver import ActiveSet


@pytest.mark.parametrize("slope", [1e-3, 1e-6, 1e-9])
def test_a_price_however_small_comes_before_the_levels_below(slope):
    """Level 1 wants x + slope · y = 2 with x, y ≤ 1: y is at its bound, though level 2 wants y = −1."""
    levels = [Level([[1.0, slope]], [2.0]), Level([[0.0, 1.0]], [-1.0])]
    hierarchy = Hierarchy(levels, box=([-1.0, -1.0], [1.0, 1.0]))
    resolution = ActiveSet(fast_path=False)(hierarchy)[0]
    np.testing.assert_array_equal(resolution.x, [1.0, 1.0])
    assert resolution.claimed
    assert resolution.kkt_met()


def test_a_slope_below_the_rank_tolerance_is_none():
    """At 1e-12 the row does not know y, and level 2 gets what it wants."""
    levels = [Level([[1.0, 1e-12]], [2.0]), Level([[0.0, 1.0]], [-0.5])]
    resolution = ActiveSet(fast_path=False)(Hierarchy(levels, box=([-1.0, -1.0], [1.0, 1.0])))[0]
    np.testing.assert_allclose(resolution.x, [1.0, -0.5], atol=1e-12)


@pytest.mark.parametrize("size", [1e-4, 1.0])
def test_a_cone_of_many_limits_through_one_point_is_walked(size):
    """150 hard rows a · x ≥ 0 in 9 unknowns, tiny or not, all tie at x = 0: solved and certified."""
    for seed in range(25):
        rng = np.random.default_rng(seed)
        normals = rng.normal(size=(150, 9)) * 10.0 ** rng.uniform(-1, 1, (150, 1)) * size
        normals[:, 0] = np.abs(normals[:, 0]) + (0.5 * size if seed % 2 else 0.0)
        levels = [Level(rng.normal(size=(m, 9)), 10.0 * rng.normal(size=m)) for m in (3, 4, 5)]
        limits = Level(normals, lower=np.zeros(150))
        hierarchy = Hierarchy(levels, box=(-np.ones(9), np.ones(9)), limits=limits)
        resolution = ActiveSet()(hierarchy)[0]
        assert resolution.status is Status.SOLVED, seed
        assert resolution.kkt_met(), seed


def test_limits_that_rest_keeps_are_never_called_contradictory():
    """Pairs of rows that differ by 1e-5 and both hold at x = 0, beside targets far away."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        a = rng.normal(size=(4, 5))
        rows = np.vstack([a, -a + 1e-5 * rng.normal(size=(4, 5))])
        levels = [Level(rng.normal(size=(3, 5)), 100.0 * rng.normal(size=3)) for _ in range(2)]
        hierarchy = Hierarchy(levels, box=(-np.ones(5), np.ones(5)), limits=Level(rows, lower=np.zeros(8)))
        resolution = ActiveSet()(hierarchy)[0]
        assert resolution.status is not Status.INFEASIBLE, seed
        assert resolution.kkt_met(), seed
