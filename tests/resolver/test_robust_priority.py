"""Singularity-robust task priority: the formula, bounded where levels are in conflict, and what it costs."""

import numpy as np
import pytest

from taskopt import Hierarchy, InvalidValue, Level, NumericalFiltering, Status
from taskopt.resolver.registry import resolve
from taskopt.resolver.robust_priority import RobustPriority
from taskopt.testing import check_resolver


def by_formula(levels: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Σ (I − S† S) J† b with NumPy's pseudo-inverse, in which S stacks the rows of the levels before."""
    n = levels[0][0].shape[1]
    x, before = np.zeros(n), np.zeros((0, n))
    for J, b in levels:
        x = x + (np.eye(n) - np.linalg.pinv(before) @ before) @ np.linalg.pinv(J) @ b
        before = np.vstack([before, J])
    return x


def drawn(seed: int, count: int = 3) -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(seed)
    return [(rng.normal(size=(2, 7)), rng.normal(size=2)) for _ in range(count)]


def test_it_is_the_formula() -> None:
    """Three levels, and the same with the first one as hard rows."""
    for seed in range(10):
        levels = drawn(seed)
        both = [Level(J, b) for J, b in levels]
        np.testing.assert_allclose(resolve(Hierarchy(both), "srtp").x, by_formula(levels), atol=1e-12)
        hard = Hierarchy(both[1:], limits=both[0])
        np.testing.assert_allclose(resolve(hard, "srtp").x, by_formula(levels), atol=1e-12)
        assert np.abs(resolve(Hierarchy(both), "pinv").x - by_formula(levels)).max() > 1e-3


def test_a_norm_is_a_change_of_unknowns() -> None:
    """With W = Lᵀ L the answer is that of J L⁻¹, multiplied by L⁻¹."""
    L = np.triu(np.random.default_rng(3).normal(size=(7, 7))) + 4.0 * np.eye(7)
    levels = drawn(5)
    answer = resolve(Hierarchy([Level(J, b) for J, b in levels], norm=L.T @ L), "srtp")
    expected = np.linalg.solve(L, by_formula([(J @ np.linalg.inv(L), b) for J, b in levels]))
    np.testing.assert_allclose(answer.x, expected, atol=1e-10)


def test_near_a_conflict_of_levels_it_stays_bounded() -> None:
    """The second row nears the first one: the pseudo-inverse goes to infinity, and this does not."""
    for gap in (1e-2, 1e-4):
        first, second = np.array([[1.0, 0.0, 0.0]]), np.array([[1.0, gap, 0.0]])
        problem = Hierarchy([Level(first, [0.0]), Level(second, [1.0])])
        x = resolve(problem, "srtp").x
        assert np.abs(x).max() < 1.0
        np.testing.assert_allclose(first @ x, 0.0, atol=1e-15)
        assert (second @ x)[0] < 0.1
        assert resolve(problem, "pinv").x[1] == pytest.approx(1.0 / gap)


def test_orthogonal_levels_are_both_met() -> None:
    """Where J₂ J₁ᵀ = 0 it is the strict optimum."""
    levels = [Level([[1.0, 1.0, 0.0]], [2.0]), Level([[1.0, -1.0, 0.0]], [4.0])]
    np.testing.assert_allclose(resolve(Hierarchy(levels), "srtp").x, [3.0, -1.0, 0.0], atol=1e-14)


def test_damping_bounds_a_level_that_is_singular_by_itself() -> None:
    """By a policy, as for `dls`; the first level is then missed."""
    J = np.array([[1.0, 0.0, 0.0], [0.0, 1e-4, 0.0]])
    problem = Hierarchy([Level(J, [1.0, 1.0])])
    assert np.abs(resolve(problem, "srtp").x).max() > 1e3
    damped = RobustPriority(NumericalFiltering(0.1, 0.1))(problem)[0].x
    assert np.abs(damped).max() < 10.0
    assert damped[0] == pytest.approx(1.0)


def test_it_keeps_the_contract_and_claims_nothing() -> None:
    """As every formula; inequalities are refused."""
    check_resolver(RobustPriority())
    with pytest.raises(InvalidValue, match="srtp is a closed form and knows no inequality"):
        resolve(Hierarchy([Level([[1.0]], lower=[0.0])]), "srtp")
    assert resolve(Hierarchy([Level([[1.0]], [1.0])]), "srtp").status is Status.FORMULA
