"""Compiled task priority against the same recursion in NumPy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.arrays import Array
from taskopt.hierarchy.damping import NONE, POLICIES, ConstantDamping, Damping
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.rank import RULE, RankRule
from taskopt.resolver.descent import accounts_of, descend_hierarchy
from tests.helpers.numpy_descent import numpy_descent

SEEDS = st.integers(0, 2**32 - 1)
DAMPINGS: tuple[Damping, ...] = (NONE, ConstantDamping(1e-4), *POLICIES)


def drawn(seed: int) -> Hierarchy:
    """Up to three levels of equalities of any rank, hard ones, fixed unknowns, weights and any norm."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 9))
    levels = []
    for _ in range(int(rng.integers(1, 4))):
        m = int(rng.integers(1, 11))
        A = rng.normal(size=(m, n))
        if rng.random() < 0.4:  # rows that depend on each other, exactly or almost
            noise = 10.0 ** rng.integers(-8, -2) if rng.random() < 0.5 else 0.0
            A[-1] = A[0] + noise * rng.normal(size=n)
        if levels and rng.random() < 0.4:  # a row that the level before decided already
            A[0] = levels[0].A[0]
        if rng.random() < 0.1:
            A[:] = 0.0
        levels.append(Level(A, rng.normal(size=m), weight=10.0 ** rng.uniform(-3, 3, m)))
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    if rng.random() < 0.3:
        lower[0] = upper[0] = rng.normal()
    hard = Level(rng.normal(size=(1, n)), rng.normal(size=1)) if rng.random() < 0.3 else None
    L = rng.normal(size=(n, n)) + 3.0 * np.eye(n)
    norm = (None, rng.uniform(0.1, 10.0, n), L.T @ L)[int(rng.integers(3))]
    return Hierarchy(levels, box=(lower, upper), limits=hard, norm=norm)


def compiled(hierarchy: Hierarchy, damping: Damping, rule: RankRule = RULE, before=()) -> tuple[Array, tuple]:
    """x and ranks."""
    x = np.empty(hierarchy.n)
    ranks = descend_hierarchy(hierarchy, damping, rule, before, x)
    return x, ranks


def same(hierarchy: Hierarchy, damping: Damping, rule: RankRule = RULE, before=()) -> bool:
    """Whether x and ranks are those of NumPy, up to what the least singular value makes of rounding."""
    x, ranks = compiled(hierarchy, damping, rule, before)
    expected, expected_ranks, least = numpy_descent(hierarchy, damping, rule, before)
    close = np.abs(x - expected).max() <= 1e-12 / least**2 * max(1.0, np.abs(expected).max())
    return list(ranks) == expected_ranks and bool(close)


@given(SEEDS, st.sampled_from(DAMPINGS))
def test_the_compiled_closed_form_is_that_of_numpy(seed: int, damping: Damping) -> None:
    """Any ranks, weights, hard equalities, norms and damping policies."""
    assert same(drawn(seed), damping)


@given(SEEDS)
def test_ranks_have_the_hysteresis_of_the_rule(seed: int) -> None:
    """With ranks of a last tick, and thresholds between which singular values lie."""
    hierarchy = drawn(seed)
    rng = np.random.default_rng(seed + 1)
    before = tuple(rng.integers(0, 5, hierarchy.layout.level_count + 1).tolist())
    assert same(hierarchy, NONE, RankRule(1e-3, 0.5), before)


@pytest.mark.slow
@given(SEEDS, st.sampled_from(DAMPINGS))
def test_the_accounts_have_the_ranks_that_the_answer_was_found_with(seed: int, damping: Damping) -> None:
    """The accounts come from singular values, the ranks of the answer mostly without any."""
    hierarchy = drawn(seed)
    accounts = accounts_of(hierarchy, damping, RULE, ())
    assert tuple(account.rank for account in accounts) == compiled(hierarchy, damping)[1]


@pytest.mark.parametrize("lie", ["rank", "damping", "order"])
def test_planted_fault_another_recursion(lie: str) -> None:
    """A threshold of its own, a k that is not squared, and levels in the other order are noticed."""
    caught = 0
    for seed in range(40):
        hierarchy = drawn(seed)
        if lie == "rank":
            x, ranks = compiled(hierarchy, NONE, RankRule(0.2, 0.2))
            expected, expected_ranks, _ = numpy_descent(hierarchy)
            caught += list(ranks) != expected_ranks and bool(np.abs(x - expected).max() > 1e-6)
        elif lie == "damping":
            x = compiled(hierarchy, ConstantDamping(0.1**0.5))[0]
            caught += bool(np.abs(x - numpy_descent(hierarchy, ConstantDamping(0.1))[0]).max() > 1e-6)
        else:
            turned = [Level(level.A, level.upper, weight=level.weight) for level in hierarchy.levels[::-1]]
            x = compiled(Hierarchy(turned, norm=hierarchy.norm), NONE)[0]
            caught += bool(np.abs(x - numpy_descent(hierarchy)[0]).max() > 1e-6)
    assert caught > 10
