"""The certificate accepts what is optimal, and catches each lie."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.errors import InvalidValue
from taskopt.hierarchy.certificate import RESIDUALS, Certificate, certify
from taskopt.hierarchy.multipliers import certify_velocity
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import Verdict
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
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
    assert resolution.kkt_met()
    direction = np.random.default_rng(seed).standard_normal(hierarchy.n)
    moved = resolution.x + 1e-3 * direction / np.linalg.norm(direction)
    assert not certify(hierarchy, moved, resolution.multipliers).kkt_met()


@given(SEEDS)
@settings(deadline=None, max_examples=100)
def test_a_wrong_sign_of_any_multiplier_is_caught(seed):
    """Each multiplier that matters, turned round at the level where it first counts, is refused."""
    hierarchy = random_hierarchy(seed)
    resolution, _ = ActiveSet()(hierarchy)
    problem = resolution.problem
    equal = np.concatenate([problem.box_lower == problem.box_upper, problem.lower == problem.upper])
    for column in np.flatnonzero((resolution.state != 0) & ~equal):
        multipliers = resolution.multipliers[:, column]
        level = int(np.argmax(np.abs(multipliers) > 1e-6))
        own = problem.layout.offsets[level + 1] + problem.n <= column
        if abs(multipliers[level]) > 1e-6 and not own:
            wrong = resolution.multipliers.copy()
            wrong[level, column] *= -1.0
            assert not certify(hierarchy, resolution.x, wrong).kkt_met()


def test_a_row_that_was_needed_by_an_earlier_level_may_pull_either_way_later():
    """x ≤ 1 stops level 1 (x = 2); level 2 (x = 0) then pushes the other way, and that is optimal."""
    hierarchy = Hierarchy([Level([[1.0]], [2.0]), Level([[1.0]], [0.0])], box=([-5.0], [1.0]))
    x = np.array([1.0])
    multipliers = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0]])
    assert certify(hierarchy, x, multipliers).kkt_met()


def test_levels_in_the_wrong_order_are_refused():
    """The optimum of the swapped hierarchy is not proven for this one by any sign of multipliers."""
    first, second = Level([[1.0, 0.0]], [1.0]), Level([[1.0, 0.0]], [0.0])
    answer, _ = ActiveSet()(Hierarchy([second, first]))
    assert not certify(Hierarchy([first, second]), answer.x, answer.multipliers).kkt_met()


def test_multipliers_that_cancel_prove_nothing():
    """Two equal rows with multipliers ±1e12 are stationary whatever x is; level 3 still wants x₁ = 1."""
    same = Level([[1.0, 0.0]], [0.0])
    hierarchy = Hierarchy([same, same, Level([[0.0, 1.0]], [1.0])])
    multipliers = np.zeros((4, 5))
    multipliers[2:, 2], multipliers[2:, 3] = 1e12, -1e12
    multipliers[3, 4] = -0.5
    certificate = certify(hierarchy, np.array([0.0, 0.5]), multipliers)
    assert not certificate.kkt_met()
    assert certificate.worst_name == "stationarity of level 3"


@pytest.mark.parametrize("unit", [1e-8, 1e-5, 1.0, 1e5])
def test_a_lie_is_one_in_any_unit(unit):
    """Rows in other units make gradients small or large; x₀ = 0.2 where 1 is wanted is wrong in all."""
    hierarchy = Hierarchy([Level([[unit, 0.0]], [unit]), Level([[0.0, 1.0]], [1.0])])
    assert not certify_velocity(hierarchy, [0.2, 1.0]).kkt_met()
    assert certify_velocity(hierarchy, [1.0, 1.0]).kkt_met()


def test_not_a_number_is_never_a_proof():
    """NaN has an infinite residual."""
    assert certify(UNIT, np.array([np.nan]), np.zeros((2, 2))).worst == np.inf


@pytest.mark.parametrize(("small", "error"), [(1e-5, 0.0), (1e-11, 0.0), (1e-6, 1e-9)])
def test_a_small_multiplier_of_the_right_sign_frees_the_sign_of_its_bound(small, error):
    """x ≤ 1 stops level 1 (x = 1 + small); so its multiplier may be negative at level 2 (x = 0).

    The multiplier of level 1 may be small, and may have the error of a solver, as long as that is smaller.
    """
    hierarchy = Hierarchy([Level([[1.0]], [1.0 + small]), Level([[1.0]], [0.0])], box=([-5.0], [1.0]))
    pull = 1.0 + small - 1.0 + error  # without the error, what is left of `small` in double precision
    multipliers = np.array([[pull, 0.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    assert certify(hierarchy, np.array([1.0]), multipliers).kkt_met()


@pytest.mark.parametrize("small", [1e-5, 1e-11])
def test_a_small_violation_frees_the_sign_of_its_row(small):
    """x ≤ −small and x ≥ small share their violation at x = 0, and both keep it, whatever level 2 wants."""
    level = Level([[1.0], [1.0]], lower=[-np.inf, small], upper=[-small, np.inf])
    hierarchy = Hierarchy([level, Level([[1.0]], [3.0])])
    multipliers = np.zeros((3, 4))
    multipliers[1, 2] = 3.0  # upward, from the row that is violated at its lower bound
    assert certify(hierarchy, np.zeros(1), multipliers).kkt_met()


def lie_of_the_second_level(noise: float, limit: float) -> Certificate:
    """The certificate of x = (1, 1), where level 2 is held back by a bound that pushes the same way.

    Level 1 asks for x₀ + x₁ = 2 + limit inside x₀ + x₁ ≤ 2. Level 2 wants x₀ = 5, and x₁ could give way to
    it, but the multiplier of x₀ ≥ 1 stands in the way, which is −noise at level 1 and 4 at level 2.
    """
    row = [[1.0, 1.0]]
    levels = [Level(row, [2.0 + limit]), Level([[1.0, 0.0]], [5.0])]
    hierarchy = Hierarchy(levels, box=([1.0, -9.0], [9.0, 9.0]), limits=Level(row, upper=[2.0]))
    multipliers = np.zeros((3, 5))
    multipliers[0, 0], multipliers[0, 2] = -noise, limit
    multipliers[1, 0] = 4.0
    multipliers[2, [0, 3]] = 0.0, -1.0
    return certify(hierarchy, np.ones(2), multipliers)


def test_a_multiplier_that_vanishes_in_rounding_frees_no_sign():
    """1 − 5e-17 is 1 in double precision, so that a multiplier of 5e-17 changes no stationarity."""
    certificate = lie_of_the_second_level(noise=5e-17, limit=1.0)
    assert certificate.residuals[0].max() < 1e-16
    assert certificate.worst_name == "dual of level 2"
    assert not certificate.kkt_met()


def test_a_multiplier_no_larger_than_the_stationarity_left_over_frees_no_sign():
    """A multiplier of 1e-12 that nothing balances is itself the error of its level."""
    certificate = lie_of_the_second_level(noise=1e-12, limit=0.0)
    assert certificate.residuals[0].max() < 1e-11
    assert certificate.worst_name == "dual of level 2"
    assert not certificate.kkt_met()


def test_a_multiplier_of_the_wrong_sign_frees_no_sign():
    """x ≤ 1 pulls at level 1 by 1e-9, which passes as rounding there, and by 1 at level 2, which does not."""
    hierarchy = Hierarchy([Level([[1.0]], [1.0 - 1e-9]), Level([[1.0]], [0.0])], box=([-5.0], [1.0]))
    multipliers = np.array([[1.0 - 1e-9 - 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    certificate = certify(hierarchy, np.array([1.0]), multipliers)
    assert certificate.worst_name == "dual of level 2"


@pytest.mark.parametrize("excess", [2e-8, 1e-3, 5.0])
@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_a_violation_is_relative_to_the_largest_term_of_its_row(size, excess):
    """A hard row size (1, 1) has the largest term 2 size at x = (1, 2), and is violated by `excess` of it."""
    x = np.array([1.0, 2.0])
    limits = Level([[size, size]], upper=[size * (3.0 - 2.0 * excess)])
    certificate = certify(Hierarchy([Level(np.eye(2), x)], limits=limits), x, np.zeros((2, 5)))
    np.testing.assert_allclose(certificate.residuals[:, RESIDUALS.index("primal")], excess, rtol=1e-6)
    assert certificate.broken_limit == certificate.residuals[0, RESIDUALS.index("primal")]
    assert not certificate.kkt_met()


@pytest.mark.parametrize("x", [0.0, 0.25, -40.0])
def test_a_violation_of_a_row_with_small_terms_is_relative_to_its_norm(x):
    """A hard row 3 x ≥ 3 x + 0.3 e, and a bound x ≤ x − e, are violated by e/10 and e, over max(1, |x|)."""
    e = 1e-3
    limits = Level([[3.0]], lower=[3.0 * x + 0.3 * e])
    size = max(1.0, abs(x))
    by_row = certify(Hierarchy([Level([[1.0]], [x])], limits=limits), np.array([x]), np.zeros((2, 3)))
    assert by_row.broken_limit == pytest.approx(0.1 * e / size, rel=1e-6)
    by_box = certify(
        Hierarchy([Level([[1.0]], [x])], box=([-99.0], [x - e])), np.array([x]), np.zeros((2, 2))
    )
    assert by_box.broken_limit == pytest.approx(e / size, rel=1e-6)


def test_a_proof_is_exactly_as_good_as_the_tolerance():
    """A residual of 1e-8 is a proof, the next larger number is none."""
    residuals = np.full((1, 4), 1e-8)
    assert Certificate(residuals).kkt_met()
    assert not Certificate(np.nextafter(residuals, 1.0)).kkt_met()
    assert Certificate(residuals * 10.0).kkt_met(1e-6)


def test_a_small_product_hides_no_complementarity():
    """A multiplier of 1e-7 at a distance of 1e-7 has the product 1e-14, and the residual 1e-7."""
    hierarchy = Hierarchy([Level([[1.0]], [1.0])], box=([-5.0], [1.0]))
    certificate = certify(hierarchy, np.array([1.0 - 1e-7]), np.array([[1e-7, 0.0], [0.0, -1.0]]))
    assert certificate.worst_name == "complementarity of level 1"
    assert certificate.worst == pytest.approx(1e-7, rel=1e-6)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_signs_of_rows_are_judged_in_the_unit_of_the_level(size):
    """The hard row size x ≤ size takes −g/size at x = 1: in any unit, 1 of g = 1 has the wrong sign.

    A distance counts in the unit of x: one of 1e-3 is 1e-3, whatever the unit of the row.
    """
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], limits=Level([[size]], upper=[size]))
    multipliers = np.array([[0.0, -1.0 / size, 0.0], [0.0, 0.0, -1.0]])
    certificate = certify(hierarchy, np.ones(1), multipliers)
    assert certificate.residuals[0, RESIDUALS.index("dual")] == pytest.approx(1.0)
    away = Hierarchy([Level([[1.0]], [1.0])], limits=Level([[size]], upper=[size]))
    multipliers = np.array([[0.0, 1.0 / size, 0.0], [0.0, 0.0, -1.0]])
    certificate = certify(away, np.array([0.999]), multipliers)
    assert certificate.residuals[0, RESIDUALS.index("complementarity")] == pytest.approx(1e-3)


def test_a_multiplier_of_a_row_with_the_wrong_sign_frees_no_sign():
    """As for a bound: x ≤ 1 as a hard row pulls by 1e-9 at level 1, and by 1 at level 2."""
    levels = [Level([[1.0]], [1.0 - 1e-9]), Level([[1.0]], [0.0])]
    hierarchy = Hierarchy(levels, limits=Level([[1.0]], upper=[1.0]))
    multipliers = np.zeros((3, 4))
    multipliers[0, 1], multipliers[1:, 1] = 1.0 - 1e-9 - 1.0, -1.0
    assert certify(hierarchy, np.array([1.0]), multipliers).worst_name == "dual of level 2"


def test_stationarity_is_relative_to_the_size_of_x():
    """x₁ = 1 is missed by 1e-3 beside x₀ = 1e4: rounding of x₀ alone moves rows by its share of 1e4."""
    hierarchy = Hierarchy([Level([[0.0, 1.0]], [1.0])])
    certificate = certify(hierarchy, np.array([1e4, 1.001]), np.zeros((2, 3)))
    assert certificate.residuals[0, 0] == pytest.approx(1e-7, rel=1e-6)


def test_a_certificate_has_an_error_bound_and_a_verdict():
    """KKT residuals of 1e-7 pass beside a row of 1e4; the bound says by how much x is off."""
    hierarchy = Hierarchy([Level([[1e4, 0.0], [0.0, 1e-4]], [1e4, 1e-4])])
    x = np.array([1.0, 0.5])
    certificate = certify_velocity(hierarchy, x)
    assert certificate.kkt_met()
    assert certificate.verdict is Verdict.REFUTED
    np.testing.assert_allclose(certificate.error_bound, [0.0, 0.5], atol=1e-15)
    resolution, _ = ActiveSet()(hierarchy)
    assert resolution.proven
    assert resolution.certificate.verdict is Verdict.PROVEN
    assert (resolution.certificate.error_bound <= 1e-15).all()


def test_an_answer_that_is_no_number_is_refuted():
    """A resolution whose x is NaN has a verdict, too."""
    hierarchy = Hierarchy([Level([[1.0]], [1.0])])
    answer = np.full(hierarchy.layout.answer_size, np.nan)
    answer[-hierarchy.layout.size :] = hierarchy.buffer
    failed = Resolution(hierarchy, answer, np.zeros(2, dtype=np.int8), Status.FAILED)
    assert failed.certificate.verdict is Verdict.REFUTED
    assert failed.certificate.error_bound.tolist() == [np.inf]


def test_residuals_alone_have_no_error_bound():
    """They lack the problem; the message says where a bound is to be had."""
    with pytest.raises(InvalidValue, match="certify"):
        _ = Certificate(np.zeros((1, 4))).error_bound
