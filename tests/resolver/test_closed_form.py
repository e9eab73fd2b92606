"""The formulas of Sect. 3.5 against what defines them, at generic and at singular points."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from taskopt.errors import InvalidValue
from taskopt.hierarchy.damping import NONE, ConstantDamping
from taskopt.hierarchy.multipliers import certify_velocity
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.status import Status
from taskopt.resolver.closed_form import (
    damped_inverse,
    gradient_motion,
    in_range,
    internal_motion,
    level_ratio,
    null_space_motion,
    null_space_projector,
    pseudo_inverse,
    square_inverse,
    task_priority,
    weighted_least_squares,
    weighted_pseudo_inverse,
)
from taskopt.resolver.closed_form_resolvers import DampedLeastSquares, PseudoInverse
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.registry import resolver
from tests.helpers.oracles import lexicographic_optimum, random_hierarchy
from tests.helpers.spectrum import jacobian, with_singular_values

SEEDS = st.integers(0, 2**32 - 1)


@pytest.mark.equation("3.51", "3.52")
@given(SEEDS)
def test_the_pseudo_inverse_is_the_formula_of_the_chapter(seed: int) -> None:
    """Jᵀ (J Jᵀ)⁻¹ (3.52), where J has full rank."""
    J = jacobian(seed)
    np.testing.assert_allclose(pseudo_inverse(J), J.T @ np.linalg.inv(J @ J.T), atol=1e-11)


@given(SEEDS)
def test_the_pseudo_inverse_keeps_its_four_properties_where_rank_is_lost(seed: int) -> None:
    """Penrose (1955): J J† J = J, J† J J† = J†, both products symmetric."""
    J = jacobian(seed)
    J[5] = J[0] - 2.0 * J[3]
    P = pseudo_inverse(J)
    for product, expected in ((J @ P @ J, J), (P @ J @ P, P), (J @ P, (J @ P).T), (P @ J, (P @ J).T)):
        np.testing.assert_allclose(product, expected, atol=1e-10)


@pytest.mark.equation("3.49", "3.50")
@example(1002898)  # the worst conditioned W of several thousand draws
@given(SEEDS)
def test_the_weighted_pseudo_inverse_is_the_formula_of_the_chapter(seed: int) -> None:
    """W⁻¹ Jᵀ (J W⁻¹ Jᵀ)⁻¹ (3.50), for a full W and for a diagonal one; the pseudo-inverse is refuted.

    The oracle inverts W and J W⁻¹ Jᵀ, so its own rounding error grows with their condition numbers.
    """
    J = jacobian(seed)
    L = np.random.default_rng(seed).normal(size=(7, 7)) + 3.0 * np.eye(7)
    for W in (L.T @ L, np.diag(np.diag(L) ** 2 + 0.1)):
        inverse = np.linalg.inv(W)
        middle = J @ inverse @ J.T
        expected = inverse @ J.T @ np.linalg.inv(middle)
        rounding = np.finfo(float).eps * (np.linalg.cond(W) + np.linalg.cond(middle))
        tolerance = 10.0 * rounding * np.abs(expected).max()
        for declared in (W, np.diag(W)) if not np.any(W - np.diag(np.diag(W))) else (W,):
            np.testing.assert_allclose(
                weighted_pseudo_inverse(J, declared), expected, rtol=0.0, atol=tolerance
            )
        assert np.abs(pseudo_inverse(J) - expected).max() > 10.0 * tolerance


@pytest.mark.equation("3.46")
@given(SEEDS)
def test_internal_motion_does_not_move_the_hand(seed: int) -> None:
    """J q̇ = v whatever q̇₀ (3.54), with J P = 0 to rounding however near a singularity."""
    J = jacobian(seed, smallest=1e-6)
    rng = np.random.default_rng(seed)
    v = J @ rng.normal(size=7)
    assert np.abs(J @ null_space_projector(J)).max() < 1e-14
    np.testing.assert_allclose(J @ null_space_motion(J, v, rng.normal(size=7)), v, atol=1e-9)


@pytest.mark.equation("3.47")
@given(SEEDS, st.floats(1e-6, 1.0))
def test_the_square_inverse_is_the_only_motion_there_is(seed: int, smallest: float) -> None:
    """q̇ = J⁻¹ v (3.47): J q̇ = v to rounding, and the pseudo-inverse and the QP say the same."""
    J = with_singular_values(seed, np.geomspace(1.0, smallest, 7))
    v = np.random.default_rng(seed).normal(size=7)
    x = square_inverse(J, v)
    np.testing.assert_allclose(J @ x, v, atol=1e-13 * np.abs(x).max() + 1e-12)
    for other in (pseudo_inverse(J) @ v, HierarchicalQP("daqp")(Hierarchy([Level(J, v)]))[0].x):
        np.testing.assert_allclose(x, other, rtol=0.0, atol=1e-14 / smallest * np.abs(x).max() + 1e-12)


def test_the_square_inverse_refuses_what_has_none() -> None:
    """Neither square nor of full rank: the message says what to take."""
    with pytest.raises(InvalidValue, match="must be square, got 6×7; take pseudo_inverse"):
        square_inverse(jacobian(0), np.ones(6))
    J = with_singular_values(0, np.array([1.0, 1.0, 1.0, 0.5, 0.5, 0.1, 0.0]))
    with pytest.raises(InvalidValue, match="rank 6 of 7"):
        square_inverse(J, np.ones(7))


@pytest.mark.slow
@given(SEEDS)
def test_any_motion_of_the_null_space_is_an_internal_motion(seed: int) -> None:
    """(3.46) with v = 0 and arbitrary q̇₀: J q̇ = 0, and P is a projector, P² = P = Pᵀ."""
    J, v0 = jacobian(seed, smallest=1e-4), np.random.default_rng(seed).normal(size=7)
    x, P = internal_motion(J, v0), null_space_projector(J)
    assert np.abs(J @ x).max() < 1e-13
    assert np.abs(x).max() > 1e-3
    np.testing.assert_allclose(P @ P, P, atol=1e-14)
    np.testing.assert_allclose(P, P.T, atol=1e-15)
    level = Hierarchy([Level(J, np.zeros(6)), Level(np.eye(7), v0)])
    np.testing.assert_allclose(HierarchicalQP("daqp")(level)[0].x, x, atol=1e-12)


@pytest.mark.equation("3.53", "3.54", "3.55")
@given(SEEDS)
def test_the_gradient_is_climbed_with_what_the_task_leaves(seed: int) -> None:
    """(3.55): wᵀ q̇ grows by k₀ ‖P ∇w‖², whatever the task; the hierarchy with k₀ ∇w below says the same."""
    J, rng = jacobian(seed), np.random.default_rng(seed)
    v, gradient, k0 = rng.normal(size=6), rng.normal(size=7), rng.uniform(0.1, 50.0)
    x = gradient_motion(J, v, gradient, k0)
    climbed = gradient @ (x - pseudo_inverse(J) @ v)
    np.testing.assert_allclose(
        climbed, k0 * np.linalg.norm(null_space_projector(J) @ gradient) ** 2, rtol=1e-9
    )
    both = Hierarchy([Level(J, v), Level(np.eye(7), k0 * gradient)])
    np.testing.assert_allclose(HierarchicalQP("quadprog")(both)[0].x, x, atol=1e-11 * np.abs(x).max())


@pytest.mark.parametrize("name", ["hqp/daqp", "hqp/clarabel", "hqp/proxqp", "hqp/quadprog", "active-set"])
def test_at_a_singularity_v_in_the_range_is_followed_and_v_outside_in_least_squares(name: str) -> None:
    """Sect. 3.5.2: J q̇ = v where v ∈ R(J); else the residual is normal to R(J), and QP and formula agree."""
    for seed in range(5):
        J = with_singular_values(seed, np.array([1.0, 0.8, 0.5, 0.3, 0.1, 0.0]))
        rng = np.random.default_rng(seed)
        inside, outside = J @ rng.normal(size=7), rng.normal(size=6)
        assert in_range(J, inside)
        assert not in_range(J, outside)
        for v in (inside, outside):
            x = resolver(name)(Hierarchy([Level(J, v)]))[0].x
            np.testing.assert_allclose(x, pseudo_inverse(J) @ v, atol=1e-11)
            assert np.abs(J.T @ (J @ x - v)).max() < 1e-11
        np.testing.assert_allclose(J @ (pseudo_inverse(J) @ inside), inside, atol=1e-12)


@given(SEEDS)
def test_a_weighted_norm_is_the_norm_of_the_stack(seed: int) -> None:
    """(3.50) for any positive definite W: least q̇ᵀ W q̇ with J q̇ = v, by formula and by QP."""
    J, rng = jacobian(seed), np.random.default_rng(seed)
    L = rng.normal(size=(7, 7)) + 3.0 * np.eye(7)
    v = rng.normal(size=6)
    for W in (L.T @ L, rng.uniform(0.1, 10.0, 7)):
        x = HierarchicalQP("daqp")(Hierarchy([Level(J, v)], norm=W))[0].x
        np.testing.assert_allclose(
            x, weighted_pseudo_inverse(J, W) @ v, rtol=0.0, atol=1e-10 * np.abs(x).max()
        )


def test_where_nothing_is_an_inequality_the_recursion_is_the_exact_optimum() -> None:
    """Against rational arithmetic, with rank loss and conflicts."""
    for seed in range(40):
        drawn = [level for level in random_hierarchy(seed).levels if np.isfinite(level.upper).all()]
        equal = Hierarchy([Level(level.A, level.upper, weight=level.weight) for level in drawn])
        np.testing.assert_allclose(task_priority(equal), lexicographic_optimum(equal), atol=1e-10)


@pytest.mark.equation("3.59")
@given(SEEDS)
def test_the_damped_inverse_minimises_its_cost(seed: int) -> None:
    """(3.59) is the least-squares solution of [J; k I] q̇ = [v; 0]."""
    J = jacobian(seed, smallest=1e-6)
    v = np.random.default_rng(seed).normal(size=6)
    stacked = np.vstack([J, 0.1 * np.eye(7)])
    expected = np.linalg.lstsq(stacked, np.concatenate([v, np.zeros(7)]), rcond=None)[0]
    np.testing.assert_allclose(damped_inverse(J, 0.1) @ v, expected, atol=1e-12)


@given(SEEDS)
def test_two_levels_of_task_priority_are_the_null_space_formula(seed: int) -> None:
    """With q̇ = q̇₀ as second level the recursion is (3.54)."""
    J, rng = jacobian(seed), np.random.default_rng(seed)
    v, v0 = rng.normal(size=6), rng.normal(size=7)
    x = task_priority(Hierarchy([Level(J, v), Level(np.eye(7), v0)]))
    np.testing.assert_allclose(x, null_space_motion(J, v, v0), atol=1e-10)


@given(SEEDS)
def test_task_priority_is_certified_wherever_nothing_is_an_inequality(seed: int) -> None:
    """Any rank, weights, conflicts and any norm: the recursion is the lexicographic optimum."""
    rng = np.random.default_rng(seed)
    first = rng.integers(-2, 3, (3, 6)).astype(float)
    levels = [first, np.vstack([first[0] + first[1], rng.normal(size=(2, 6))]), rng.normal(size=(2, 6))]
    L = rng.normal(size=(6, 6)) + 3.0 * np.eye(6)
    hierarchy = Hierarchy(
        [Level(A, rng.normal(size=len(A)), weight=rng.uniform(0.5, 2.0, len(A))) for A in levels],
        norm=L.T @ L,
    )
    assert certify_velocity(hierarchy, task_priority(hierarchy)).worst < 1e-10


def test_one_damped_level_is_the_damped_inverse() -> None:
    """q̇ = J* v (3.59) with k squared, near a singularity."""
    J = jacobian(4, smallest=1e-2)
    v = np.random.default_rng(4).normal(size=6)
    x = DampedLeastSquares(damping=ConstantDamping(0.1))(Hierarchy([Level(J, v)]))[0].x
    np.testing.assert_allclose(x, J.T @ np.linalg.solve(J @ J.T + 0.1**2 * np.eye(6), v), atol=1e-12)


def test_damping_never_leaks_into_a_higher_level() -> None:
    """The second level moves only where the first is not touched, though the first is damped."""
    J = jacobian(1, smallest=1e-3)
    rng = np.random.default_rng(1)
    hand = Level(J, rng.normal(size=6))
    alone, both = Hierarchy([hand]), Hierarchy([hand, Level(np.eye(7), rng.normal(size=7))])
    damped = DampedLeastSquares(ConstantDamping(0.1))
    np.testing.assert_allclose(J @ damped(both)[0].x, J @ damped(alone)[0].x, atol=1e-12)


@given(SEEDS)
def test_the_weighted_formula_solves_its_normal_equations(seed: int) -> None:
    """Σ ratio^(k−L) Aᵀ w (A x − b) + W x = 0."""
    rng = np.random.default_rng(seed)
    A1, A2, b1, b2 = rng.normal(size=(2, 4)), rng.normal(size=(3, 4)), rng.normal(size=2), rng.normal(size=3)
    W = rng.uniform(0.5, 2.0, 4)
    ratio = level_ratio(2)
    x = weighted_least_squares(Hierarchy([Level(A1, b1, weight=3.0), Level(A2, b2)], norm=W), ratio)
    gradient = 3.0 * A1.T @ (A1 @ x - b1) + ratio * A2.T @ (A2 @ x - b2) + ratio**2 * W * x
    assert ratio == pytest.approx(1e-3)
    assert np.abs(gradient).max() < 1e-12


def test_hard_equalities_come_first() -> None:
    """A fixed unknown and a hard equality hold exactly in every closed form."""
    limits = Level([[1.0, 1.0, 0.0]], [0.5])
    box = ([-np.inf, -np.inf, 0.3], [np.inf, np.inf, 0.3])
    hierarchy = Hierarchy([Level(np.eye(3), [5.0, 5.0, 5.0])], box=box, limits=limits)
    for x in (task_priority(hierarchy), weighted_least_squares(hierarchy, 1e-3)):
        np.testing.assert_allclose([x[0] + x[1], x[2]], [0.5, 0.3], atol=1e-12)


def test_a_closed_form_claims_nothing() -> None:
    """It leaves the limits, says FORMULA, and its certificate shows it."""
    hierarchy = Hierarchy([Level([[1.0]], [2.0])], box=([-1.0], [1.0]))
    resolution, _ = PseudoInverse()(hierarchy)
    assert resolution.status is Status.FORMULA
    assert not resolution.claimed
    assert resolution.x[0] == pytest.approx(2.0)
    assert not resolution.kkt_met()


@pytest.mark.parametrize("formula", [PseudoInverse(), DampedLeastSquares()])
def test_closed_forms_refuse_inequality_levels(formula: PseudoInverse | DampedLeastSquares) -> None:
    """The row is named, and what can resolve it."""
    hierarchy = Hierarchy([Level([[1.0]], upper=[2.0], name="keep below")])
    with pytest.raises(InvalidValue, match="knows no inequality, got keep below/row 0"):
        formula(hierarchy)


def test_damping_must_be_positive() -> None:
    """Zero damping is another resolver."""
    with pytest.raises(InvalidValue, match="damping must be a policy"):
        DampedLeastSquares(NONE)


def test_the_same_tick_gives_the_same_bits() -> None:
    """No hidden state."""
    hierarchy = random_hierarchy(3, "generic")
    np.testing.assert_array_equal(task_priority(hierarchy), task_priority(hierarchy))


def test_one_level_has_the_ratio_of_two() -> None:
    """The norm comes below the only level, so that two weights share the spread of 1e6."""
    assert level_ratio(1) == level_ratio(2) == pytest.approx(1e-3)
    assert level_ratio(3) == pytest.approx(1e-2)


@pytest.mark.parametrize(("share", "reachable"), [(0.0, True), (1e-12, True), (1e-7, False), (1.0, False)])
def test_the_range_of_a_jacobian_is_as_wide_as_rounding(share: float, reachable: bool) -> None:
    """v is a motion of the hand plus a share of a direction that the singular arm has lost."""
    J = with_singular_values(2, np.array([1.0, 0.8, 0.5, 0.3, 0.1, 0.0]))
    lost, inside = np.linalg.svd(J)[0][:, -1], J @ np.ones(7)
    assert in_range(J, inside + share * np.linalg.norm(inside) * lost) is reachable
