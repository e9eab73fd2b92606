"""The regret of a level: nothing for the optimum, what was given up for anything else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt import Hierarchy, Level
from taskopt.errors import Infeasible, InvalidValue
from taskopt.resolver.registry import resolver
from taskopt.resolver.regret import regret
from tests.helpers.oracles import lexicographic_optimum, random_hierarchy

SEEDS = st.integers(0, 2**32 - 1)


@pytest.mark.slow
@given(SEEDS)
def test_the_exact_optimum_leaks_nothing(seed):
    """ℓ = 0 at the optimum in rational arithmetic, to what a square root makes of rounding."""
    hierarchy = random_hierarchy(seed)
    np.testing.assert_allclose(regret(hierarchy, lexicographic_optimum(hierarchy)), 0.0, atol=1e-9)


@pytest.mark.slow
@given(SEEDS)
def test_the_first_level_of_a_point_within_the_limits_never_leaks_less_than_nothing(seed):
    """Nothing inside the limits meets level 1 better than its optimum; what moves off leaks somewhere."""
    hierarchy = random_hierarchy(seed)
    best, rng = lexicographic_optimum(hierarchy), np.random.default_rng(seed)
    hard = hierarchy.limits
    inside = Hierarchy(
        [Level(np.eye(hierarchy.n), best + rng.normal(size=hierarchy.n))],
        box=(hierarchy.box_lower, hierarchy.box_upper),
        limits=Level(hard.A, lower=hard.lower, upper=hard.upper) if len(hard.lower) else None,
    )
    other = lexicographic_optimum(inside)
    assert regret(hierarchy, other)[0] >= -1e-9


def test_weights_that_are_not_infinite_have_a_regret():
    """x = 1 above, x = 0 beside it with weight ε: x = 1/(1 + ε), so level 1 leaks ε/(1 + ε)."""
    hierarchy = Hierarchy([Level([[1.0]], [1.0]), Level([[1.0]], [0.0])])
    for share in (1e-2, 1e-4):
        x = 1.0 / (1.0 + share)
        np.testing.assert_allclose(regret(hierarchy, [x]), [share * x, -share * x], rtol=1e-9)
    assert np.abs(regret(hierarchy, resolver("hqp/daqp")(hierarchy)[0].x)).max() < 1e-9


def test_weights_count_as_they_do_in_the_cost():
    """‖d‖_w = √w |d| for one row of weight w."""
    hierarchy = Hierarchy([Level([[2.0]], [1.0], weight=9.0)])
    np.testing.assert_allclose(regret(hierarchy, [1.0]), [3.0])


def test_what_has_no_optimum_has_no_regret():
    """Contradicting limits are named; an x of the wrong size or with NaN is refused."""
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]), unknowns=["elbow"])
    for x in ([1.0, 2.0], [np.nan]):
        with pytest.raises(InvalidValue, match="x"):
            regret(hierarchy, x)
    hierarchy.box_lower[0] = 2.0
    with pytest.raises(Infeasible, match="box/elbow"):
        regret(hierarchy, [0.0])
