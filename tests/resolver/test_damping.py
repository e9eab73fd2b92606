"""Damping policies: how much, where it starts, and that it touches nothing but the inverse."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.damping import (
    NONE,
    POLICIES,
    Chiaverini,
    ConstantDamping,
    Damping,
    NakamuraHanafusa,
    NumericalFiltering,
    Sugihara,
)
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.rank import RankRule
from taskopt.resolver.closed_form import damped_inverse, pseudo_inverse
from taskopt.resolver.closed_form_resolvers import DampedLeastSquares
from taskopt.resolver.hqp import HierarchicalQP
from tests.helpers.spectrum import jacobian

SEEDS = st.integers(0, 2**32 - 1)
FADING = [NakamuraHanafusa(0.1, 0.05), Chiaverini(0.1, 0.05), NumericalFiltering(0.1, 0.05)]


def name(policy: Damping) -> str:
    return policy.name


@given(SEEDS, st.floats(1e-4, 1.0))
def test_a_policy_gives_the_inverse_of_the_chapter_with_its_own_k(seed: int, smallest: float) -> None:
    """q̇ = Jᵀ (J Jᵀ + k² I)⁻¹ v (3.59) with the k² that is reported, k squared."""
    J, v = jacobian(seed, smallest), np.random.default_rng(seed).normal(size=6)
    for policy in (ConstantDamping(0.2), NakamuraHanafusa(0.1, 0.5), Chiaverini(0.1, 0.05), Sugihara(2.0)):
        resolution, _ = DampedLeastSquares(policy)(Hierarchy([Level(J, v)]))
        assert resolution.review is not None
        squared = resolution.review.levels[1].damping
        np.testing.assert_allclose(
            resolution.x, damped_inverse(J, np.sqrt(squared)) @ v, rtol=1e-8, atol=1e-12
        )


def test_the_factors_are_those_of_the_papers() -> None:
    """By hand at σ = (2, 0.5, 0.1), b = (1, 2, 2)."""
    sigma, b = np.array([2.0, 0.5, 0.1]), np.array([1.0, 2.0, 2.0])
    for policy, expected in (
        (ConstantDamping(0.3), [0.09] * 3),
        (NakamuraHanafusa(0.3, 0.4), [0.09 * (1.0 - 0.1 / 0.4) ** 2] * 3),
        (Chiaverini(0.3, 0.2), [0.09 * (1.0 - 0.25)] * 3),
        (NumericalFiltering(0.3, 0.2), [0.0, 0.0, 0.09 * (1.0 - 0.25)]),
        (Sugihara(gain=3.0, bias=0.01), [0.5 * 9.0 / 9.0 + 0.01] * 3),
        (NONE, [0.0] * 3),
    ):
        np.testing.assert_allclose(policy(sigma, b), expected, rtol=1e-14)


@pytest.mark.parametrize("policy", FADING, ids=name)
def test_far_from_a_singularity_there_is_no_damping(policy: Damping) -> None:
    """The answer is that of the pseudo-inverse, bit by bit of k² = 0."""
    J = jacobian(3, smallest=0.5)
    v = np.random.default_rng(3).normal(size=6)
    resolution, _ = DampedLeastSquares(policy)(Hierarchy([Level(J, v)]))
    np.testing.assert_allclose(resolution.x, pseudo_inverse(J) @ v, rtol=1e-11)
    assert resolution.review is not None
    assert resolution.review.causes == ()


def largest_step(policy: Damping, ticks: int) -> float:
    """The largest change of q̇ from one of `ticks` places to the next, σ_min falling from 0.1 to 0."""
    J, v = jacobian(5, smallest=1.0), np.random.default_rng(5).normal(size=6)
    U, _, Vt = np.linalg.svd(J, full_matrices=False)
    path = []
    for smallest in np.linspace(0.1, 0.0, ticks):
        rows = (U * np.array([1.0] * 5 + [smallest])) @ Vt
        path.append(DampedLeastSquares(policy)(Hierarchy([Level(rows, v)]))[0].x)
    assert np.abs(path).max() < 60.0
    return float(np.abs(np.diff(path, axis=0)).max())


@pytest.mark.slow
@pytest.mark.parametrize("policy", FADING, ids=name)
def test_damping_sets_in_without_a_jump_and_bounds_the_velocity(policy: Damping) -> None:
    """Half the step, half the change of q̇; a policy that is switched on at a threshold is caught."""
    assert largest_step(policy, 801) < 0.6 * largest_step(policy, 401)

    class Switched(ConstantDamping):
        def __call__(self, sigma: Array, b: Array) -> Array:
            return np.full_like(sigma, 0.01 if sigma.min() < 0.05 else 0.0)

    assert largest_step(Switched(), 801) > 0.9 * largest_step(Switched(), 401)


@pytest.mark.parametrize("policy", POLICIES, ids=name)
@pytest.mark.parametrize("rounding", [0.0, 1e-17])
def test_a_row_that_nothing_moves_is_no_singularity(policy: Damping, rounding: float) -> None:
    """Beside a row of zeros, whatever it asks for, the others have the damping that they have alone."""
    rng = np.random.default_rng(8)
    J, v = jacobian(8, smallest=0.02), rng.normal(size=6)
    alone = DampedLeastSquares(policy)(Hierarchy([Level(J, v)]))[0]
    beside = Level(np.vstack([rounding * rng.normal(size=(1, 7)), J]), np.r_[3.0, v])
    both = DampedLeastSquares(policy)(Hierarchy([beside]))[0]
    np.testing.assert_allclose(both.x, alone.x, rtol=1e-10, atol=1e-13)
    assert alone.review is not None
    assert both.review is not None
    assert alone.review.levels[1].damping > 0.0
    assert both.review.levels[1].damping == pytest.approx(alone.review.levels[1].damping, rel=1e-10)


def test_a_finer_rule_keeps_shorter_rows() -> None:
    """Rows that a rule of one's own counts are damped, too, however short they are."""
    J = np.diag([1.0, 1e-13])
    resolver = DampedLeastSquares(Chiaverini(), rule=RankRule(1e-15, 1e-14))
    assert np.abs(resolver(Hierarchy([Level(J, [1.0, 1.0])]))[0].x).max() < 1.0
    assert DampedLeastSquares(Chiaverini())(Hierarchy([Level(J, [1.0, 1.0])]))[0].x[0] == 1.0


def test_a_product_over_fewer_directions_than_rows_is_that_of_the_directions() -> None:
    """Three rows in two unknowns: w = √det(Jᵀ J), by hand for columns at right angles."""
    J = np.array([[0.3, 0.0], [0.0, 0.4], [0.4, 0.0]])  # singular values 0.5 and 0.4
    answer = DampedLeastSquares(NakamuraHanafusa(k0=0.1, w0=0.4))(Hierarchy([Level(J, np.ones(3))]))[0]
    assert answer.review is not None
    assert answer.review.levels[1].damping == pytest.approx(0.01 * (1.0 - 0.2 / 0.4) ** 2)


def test_filtering_leaves_the_other_directions_exact() -> None:
    """Only the component along the vanishing singular vector is missed (Maciejewski and Klein 1988)."""
    J, v = jacobian(7, smallest=1e-3), np.random.default_rng(7).normal(size=6)
    U, sigma, _ = np.linalg.svd(J)
    policy = NumericalFiltering(k_max=0.05, epsilon=0.5 * (sigma[4] + sigma[5]))
    missed = U.T @ (v - J @ DampedLeastSquares(policy)(Hierarchy([Level(J, v)]))[0].x)
    assert np.abs(missed[:5]).max() < 1e-12
    assert abs(missed[5]) > 0.1


@pytest.mark.parametrize("policy", POLICIES, ids=name)
def test_no_policy_reaches_the_projector(policy: Damping) -> None:
    """What the hand does is the same with and without a second level, though it is damped."""
    J, rng = jacobian(1, smallest=1e-3), np.random.default_rng(1)
    hand = Level(J, rng.normal(size=6))
    alone, both = Hierarchy([hand]), Hierarchy([hand, Level(np.eye(7), rng.normal(size=7))])
    damped = DampedLeastSquares(policy)
    np.testing.assert_allclose(J @ damped(both)[0].x, J @ damped(alone)[0].x, atol=1e-12)


@given(SEEDS)
def test_a_constant_k_is_a_task_that_stands_still(seed: int) -> None:
    """(3.59) is the QP ½‖v − J q̇‖² + ½ k² ‖q̇‖²: rows of weight k² beside the task, for any solver."""
    J, v = jacobian(seed, 1e-4), np.random.default_rng(seed).normal(size=6)
    damped = DampedLeastSquares(ConstantDamping(0.05))(Hierarchy([Level(J, v)]))[0].x
    beside = np.concatenate([np.ones(6), np.full(7, 0.05**2)])
    rows = Level(np.vstack([J, np.eye(7)]), np.concatenate([v, np.zeros(7)]), weight=beside)
    np.testing.assert_allclose(HierarchicalQP("daqp")(Hierarchy([rows]))[0].x, damped, rtol=1e-10, atol=1e-11)


def test_damping_is_the_cause_that_is_named() -> None:
    """What keeps dls from the pseudo-inverse is its damping, with level and k²."""
    J = jacobian(4, smallest=1e-2)
    resolution, _ = DampedLeastSquares()(Hierarchy([Level(J, np.ones(6), name="hand")]))
    assert resolution.review is not None
    assert [cause.kind for cause in resolution.review.causes] == ["damping"]
    assert "because of damping of level 1, k² = 0.0025" in resolution.explain()


@pytest.mark.parametrize(
    "wrong", [(ConstantDamping, 0.0), (NakamuraHanafusa, -1.0), (Chiaverini, np.nan), (Sugihara, 0.0)]
)
def test_parameters_must_be_positive(wrong: tuple[type, float]) -> None:
    """Zero, negative or NaN is refused by name."""
    with pytest.raises(InvalidValue, match=r"k|w0|bias|gain"):
        wrong[0](wrong[1])
