"""Rank is decided in one place, with hysteresis, and is reported."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.rank import RankRule, equality_levels, inverse_root, root_of, row_scale
from taskopt.hierarchy.tolerances import LOST
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory
from taskopt.resolver.closed_form_resolvers import PseudoInverse
from taskopt.resolver.hqp import HierarchicalQP
from tests.helpers.spectrum import with_singular_values

RULE = RankRule(lost=1e-3, regained=2e-3)
SIGMA = np.array([1.0, 0.9, 0.8, 0.7, 0.6])


def hand(smallest: float) -> Hierarchy:
    """Six rows, the last direction as weak as given; rows are of unit size."""
    J = with_singular_values(3, np.append(SIGMA, smallest))
    return Hierarchy([Level(J, np.ones(6), name="hand"), Level(np.eye(7), np.zeros(7))])


def scale() -> float:
    """The size that thresholds are relative to: the largest row norm, at least the weight's root."""
    return max(1.0, float(np.linalg.norm(hand(0.0).levels[0].A, axis=1).max()))


@pytest.mark.parametrize("resolver", [PseudoInverse(RULE), HierarchicalQP("daqp", rule=RULE)])
def test_between_the_thresholds_the_rank_stays_what_it_was(resolver: PseudoInverse | HierarchicalQP) -> None:
    """Down through 2e-3 to below 1e-3 and up again: lost at the lower threshold, back at the upper one."""
    memory, ranks = None, []
    for factor in (4.0, 1.5, 0.5, 1.5, 2.5, 1.5):
        _, memory = resolver(hand(1e-3 * factor * scale()), memory)
        ranks.append(memory.ranks[1])
    assert ranks == [6, 6, 5, 5, 6, 6]


def test_a_tick_resolved_again_from_its_memory_decides_the_same() -> None:
    """The rank is in the memory, a plain value, so that a replay is exact."""
    between = hand(1.5e-3 * scale())
    resolver = PseudoInverse(RULE)
    lost = Memory(np.zeros(20, dtype=np.int8), (0, 5, 2))
    cold, warm = resolver(between)[0], resolver(between, lost)[0]
    assert np.abs(cold.x).max() > 10.0 * np.abs(warm.x).max()
    np.testing.assert_array_equal(resolver(between, lost)[0].x, warm.x)


def test_a_rank_that_was_decided_otherwise_is_a_cause() -> None:
    """Apart from the closed form, which keeps the direction: by rank, and not by a limit or the solver."""
    resolution, _ = PseudoInverse(RULE)(hand(5e-4))
    assert resolution.review is not None
    assert next(map(str, resolution.review.causes)) == "rank of level 1, 5 of 6 directions"


@pytest.mark.parametrize("resolver", [PseudoInverse(), HierarchicalQP("daqp")])
def test_lost_rank_is_told_whoever_resolves(resolver: PseudoInverse | HierarchicalQP) -> None:
    """The account has the rows, the directions that were open, the rank, and the evidence on both sides."""
    resolution, _ = resolver(hand(0.0))
    assert resolution.review is not None
    account = resolution.review.levels[1]
    assert (account.rows, account.free, account.rank, account.lost) == (6, 7, 5, 1)
    assert account.kept == pytest.approx(0.6 / scale())
    assert account.dropped < 1e-14
    assert "Level 1: rank lost, 5 of 6 directions are decided." in resolution.explain()


def test_without_memory_the_lower_threshold_decides() -> None:
    """At σ on either side of lost · scale."""
    sigma = np.array([1.0, 3.0e-3, 1.5e-3, 0.5e-3])
    assert RULE.rank(sigma, 1.0) == 3
    assert RULE.rank(sigma, 1.0, before=2) == 2
    assert RULE.rank(sigma, 1.0, before=4) == 3
    assert RULE.rank(sigma, 1.0, before=0) == 2
    assert RULE.rank(sigma, 10.0) == 1
    assert RULE.rank(np.empty(0), 1.0) == 0


def test_the_compiled_core_goes_by_the_same_number() -> None:
    """A row with less than `LOST` left beside another is dependent, with more it is not, to both alike."""
    for left, counts in ((0.5 * LOST, False), (2.0 * LOST, True)):
        hierarchy = Hierarchy([Level([[1.0, 0.0]], [0.0]), Level([[1.0, left]], [left])])
        compiled = ActiveSet(fast_path=False)(hierarchy)[0].x
        np.testing.assert_allclose(compiled, [0.0, float(counts)], atol=1e-6)
        np.testing.assert_allclose(PseudoInverse()(hierarchy)[0].x, compiled, atol=1e-6)


@pytest.mark.parametrize(("lost", "regained"), [(0.0, 1e-3), (1e-3, 1e-4), (1e-3, 1.0), (np.nan, 1e-3)])
def test_thresholds_must_be_in_order(lost: float, regained: float) -> None:
    """0 < lost ≤ regained < 1."""
    with pytest.raises(InvalidValue, match="lost ≤ regained"):
        RankRule(lost, regained)


def test_the_size_of_rows_is_the_largest_norm_or_root_weight() -> None:
    """Rows times √w of norms 5 and 1, with √w = 2 or 7."""
    J = np.array([[3.0, 4.0], [0.0, 1.0]])
    assert row_scale(J, np.array([2.0, 1.0])) == pytest.approx(5.0)
    assert row_scale(J, np.array([2.0, 7.0])) == 7.0
    assert row_scale(np.empty((0, 2)), np.empty(0)) == 0.0


@pytest.mark.parametrize("resolver", [PseudoInverse(), HierarchicalQP("daqp")])
@pytest.mark.parametrize("unit", [1.0, 1e3, 1e6])
def test_rank_does_not_depend_on_the_unit_of_rows(
    resolver: PseudoInverse | HierarchicalQP, unit: float
) -> None:
    """Two rows that agree to 1e-12 decide one direction, and two that agree to 1e-6 two, in m or in µm."""
    for angle, rank in ((1e-12, 1), (1e-6, 2)):
        level = Level(unit * np.array([[1.0, 0.0], [1.0, angle]]), [0.0, 0.0])
        review = resolver(Hierarchy([level]))[0].review
        assert review is not None
        assert review.levels[1].rank == rank


@pytest.mark.parametrize("resolver", [PseudoInverse(), HierarchicalQP("daqp")])
@pytest.mark.parametrize("weight", [1.0, 1e4, 1e8])
def test_rank_does_not_depend_on_the_weight_of_rows(
    resolver: PseudoInverse | HierarchicalQP, weight: float
) -> None:
    """A row of zeros but for rounding (1e-12) decides nothing, however much it weighs."""
    review = resolver(Hierarchy([Level([[1e-12, 0.0]], [0.0], weight=weight)]))[0].review
    assert review is not None
    assert review.levels[1].rank == 0


def test_rank_is_lost_at_the_threshold_and_regained_above_it() -> None:
    """σ = lost · scale is lost; σ = regained · scale is not yet back; the next larger number is."""
    rule = RankRule(lost=0.25, regained=0.5)
    for scale in (1.0, 4.0):
        for sigma, before, rank in ((0.25, None, 0), (0.5, 0, 0), (0.5, 1, 1)):
            assert rule.rank(np.array([sigma * scale]), scale, before) == rank
            assert rule.rank(np.nextafter(np.array([sigma * scale]), 9.0), scale, before) == 1


def test_unknowns_with_one_value_are_hard_equalities() -> None:
    """Hard rows and fixed unknowns come first with weight 1; inequalities do not count."""
    hierarchy = Hierarchy(
        [Level(np.eye(2), [1.0, 2.0], weight=3.0), Level([[1.0, 1.0]], upper=[0.0])],
        box=([0.5, -9.0], [0.5, 9.0]),
        limits=Level([[0.0, 2.0], [1.0, 0.0]], lower=[4.0, 0.0], upper=[4.0, 1.0], weight=5.0),
    )
    hard, first, second = equality_levels(hierarchy)
    np.testing.assert_array_equal(hard[0], [[1.0, 0.0], [0.0, 2.0]])
    np.testing.assert_array_equal(hard[1], [0.5, 4.0])
    np.testing.assert_array_equal(hard[2], [1.0, 1.0])
    np.testing.assert_array_equal(first[2], [3.0, 3.0])
    assert second[0].shape == (0, 2)


@pytest.mark.parametrize("W", [np.array([4.0, 9.0]), np.array([[2.0, 0.5], [0.5, 1.0]])])
def test_the_norm_is_the_product_of_its_root(W: np.ndarray) -> None:
    """W = Lᵀ L with L upper triangular, and L⁻¹ undoes L."""
    L = root_of(W)
    np.testing.assert_allclose(L.T @ L, np.diag(W) if W.ndim == 1 else W, rtol=1e-14, atol=1e-15)
    assert L[1, 0] == 0.0
    np.testing.assert_allclose(L @ inverse_root(W), np.eye(2), atol=1e-15)


def test_the_default_rule_has_a_tenfold_hysteresis() -> None:
    """Directions are lost at 1e-10 of the rows, and back at 1e-9."""
    for sigma, before, rank in ((0.9e-10, 1, 0), (1.1e-10, 1, 1), (0.9e-9, 0, 0), (1.1e-9, 0, 1)):
        assert RankRule().rank(np.array([sigma]), 1.0, before) == rank
