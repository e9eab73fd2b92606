"""`active-set` against rational arithmetic, against its own certificate, and against itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.arrays import Array
from taskopt.hierarchy.certificate import certify
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.status import Status
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory
from tests.helpers.oracles import lexicographic_optimum, random_hierarchy
from tests.helpers.tight import tight_hierarchy

SEEDS = st.integers(0, 2**32 - 1)


def large_hierarchy(seed: int) -> Hierarchy:
    """10 to 39 unknowns, 2 to 5 levels; dependent, conflicting and integer-degenerate rows by turns."""
    rng = np.random.default_rng(seed)
    n, kind = int(rng.integers(10, 40)), seed % 4

    def draw(*shape: int) -> Array:
        return rng.integers(-2, 3, shape).astype(float) if kind == 3 else rng.standard_normal(shape)

    levels: list[Level] = []
    for _ in range(rng.integers(2, 6)):
        m = int(rng.integers(2, 13))
        A, b, width = draw(m, n), draw(m), np.abs(draw(m))
        if kind == 2:
            A[0] = 2.0 * A[-1]
            A[1] = levels[-1].A[0] if levels else A[1]
        equal = rng.random() < 0.5
        levels.append(Level(A, b) if equal else Level(A, lower=b - width, upper=b + width))
    box = (np.full(n, -0.3), np.full(n, 0.3)) if kind else None
    return Hierarchy(levels, box=box, norm=rng.uniform(0.1, 10.0, n))


@pytest.mark.parametrize("seed", range(300))
def test_it_finds_the_rational_optimum(seed):
    """x is the exact lexicographic optimum, whatever the rank, the conflicts and the degeneracy."""
    hierarchy = random_hierarchy(seed)
    resolution, _ = ActiveSet()(hierarchy)
    assert resolution.status is Status.SOLVED
    np.testing.assert_allclose(resolution.x, lexicographic_optimum(hierarchy), atol=1e-9)
    assert resolution.kkt_met()


@pytest.mark.parametrize("seed", range(40))
def test_large_hierarchies_are_certified(seed):
    """Every answer of a size where no enumeration reaches proves itself."""
    resolution, _ = ActiveSet()(large_hierarchy(seed))
    assert resolution.status is Status.SOLVED
    assert resolution.certificate.worst < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("block", range(10))
def test_thousands_of_large_hierarchies_are_certified(block):
    """1,000 more hierarchies of 10 to 39 unknowns."""
    for seed in range(1000 + 100 * block, 1100 + 100 * block):
        resolution, _ = ActiveSet()(large_hierarchy(seed))
        assert resolution.status is Status.SOLVED, seed
        assert resolution.certificate.worst < 1e-9, seed


@given(SEEDS)
@settings(deadline=None, max_examples=60)
def test_memory_changes_the_time_but_not_the_answer(seed):
    """From its own active set it needs one factorisation; from any other guess it ends at the same x."""
    hierarchy = random_hierarchy(seed)
    cold, memory = ActiveSet()(hierarchy)
    warm, _ = ActiveSet()(hierarchy, memory)
    state = np.random.default_rng(seed).integers(-1, 2, memory.state.size).astype(np.int8)
    lost, _ = ActiveSet()(hierarchy, Memory(state))
    assert warm.iterations <= 1
    np.testing.assert_allclose(warm.x, cold.x, atol=1e-10)
    np.testing.assert_allclose(lost.x, cold.x, atol=1e-9)


@given(SEEDS)
@settings(deadline=None, max_examples=60)
def test_the_fast_path_never_changes_the_answer(seed):
    """The fast path and the search agree wherever the answer of the fast path is accepted."""
    hierarchy = random_hierarchy(seed)
    np.testing.assert_allclose(
        ActiveSet(fast_path=True)(hierarchy)[0].x, ActiveSet(fast_path=False)(hierarchy)[0].x, atol=1e-9
    )


@given(SEEDS)
@settings(deadline=None, max_examples=40)
def test_a_full_norm_and_its_diagonal_agree(seed):
    """W as an (n, n) matrix gives what the same W gives as a diagonal (3.50)."""
    hierarchy = random_hierarchy(seed)
    full = Hierarchy.view(hierarchy.layout, hierarchy.buffer, np.diag(hierarchy.norm))
    np.testing.assert_allclose(ActiveSet()(full)[0].x, ActiveSet()(hierarchy)[0].x, atol=1e-8)


@given(SEEDS)
@settings(deadline=None, max_examples=40)
def test_a_full_norm_is_certified_on_the_declared_rows(seed):
    """The proof is of the problem as declared, not of the whitened one."""
    hierarchy = random_hierarchy(seed)
    factor = np.random.default_rng(seed).standard_normal((hierarchy.n, hierarchy.n))
    W = factor @ factor.T + 0.3 * np.eye(hierarchy.n)
    hierarchy = Hierarchy.view(hierarchy.layout, hierarchy.buffer, W)
    resolution, _ = ActiveSet()(hierarchy)
    assert resolution.status is Status.SOLVED
    assert resolution.kkt_met()


@pytest.mark.parametrize("block", range(10))
def test_bounds_within_a_hair_of_the_optimum_are_no_trap(block):
    """300 boxes with bounds at the optimum or 1e-12 to 1e-9 beside it: solved and proven, cold and lost."""
    for seed in range(30 * block, 30 * block + 30):
        hierarchy = tight_hierarchy(seed)
        state = np.random.default_rng(seed).integers(-1, 2, hierarchy.layout.width).astype(np.int8)
        exact = lexicographic_optimum(hierarchy) if seed % 6 == 1 else None
        for guess in (None, Memory(state)):
            resolution, _ = ActiveSet()(hierarchy, guess)
            assert resolution.status is Status.SOLVED, seed
            assert resolution.kkt_met(), seed
            if exact is not None:
                np.testing.assert_allclose(resolution.x, exact, atol=1e-8)
        lie = resolution.x + 1e-6 * np.where(state[: hierarchy.n] < 0, -1.0, 1.0)
        assert not certify(hierarchy, lie, resolution.multipliers).kkt_met(), seed


def test_ticks_that_swing_between_two_active_sets_are_guessed_right():
    """After two alternations one factorisation a tick; a memory of one tick needs more at every tick."""
    there, back = _swinging(1.0), _swinging(-1.0)
    memory, short, told, forgetful = None, None, [], []
    for k in range(12):
        hierarchy = back if k % 2 else there
        first, memory = ActiveSet(fast_path=False)(hierarchy, memory)
        second, short = ActiveSet(fast_path=False)(hierarchy, short and Memory(short.state))
        np.testing.assert_allclose(first.x, second.x, atol=1e-12)
        told.append(first.iterations)
        forgetful.append(second.iterations)
    assert memory is not None
    assert memory.alternates
    assert set(told[4:]) == {1}
    assert min(forgetful[4:]) > 1


def _swinging(sign: float) -> Hierarchy:
    """A target far outside the box, now on one side, now on the other."""
    A = np.random.default_rng(3).standard_normal((3, 7))
    return Hierarchy(
        [Level(A, sign * np.full(3, 9.0)), Level(np.eye(7), np.zeros(7))], (-np.ones(7), np.ones(7))
    )


@pytest.mark.parametrize("seed", range(6))
def test_a_saturated_stream_is_proven_tick_by_tick(seed):
    """30 unknowns, four levels whose rows turn slowly, targets out of reach: 60 ticks, each from the last."""
    rng = np.random.default_rng(seed)
    sizes, n = (6, 6, 3), 30
    start, turn = ([rng.standard_normal((m, n)) for m in sizes] for _ in range(2))
    goal = [rng.standard_normal(m) * 4.0 for m in sizes]
    box, memory = rng.uniform(0.05, 0.5, n), None
    for k in range(60):
        rows = [np.cos(0.02 * k) * A + np.sin(0.02 * k) * B for A, B in zip(start, turn, strict=True)]
        levels = [Level(A, b) for A, b in zip(rows, goal, strict=True)]
        hierarchy = Hierarchy([*levels, Level(np.eye(n), np.zeros(n))], box=(-box, box))
        resolution, memory = ActiveSet()(hierarchy, memory)
        assert resolution.status is Status.SOLVED, k
        assert resolution.kkt_met(), k


@pytest.mark.parametrize("gap", [1e-16, 6.6e-14, 5e-10])
def test_bounds_that_cross_by_rounding_agree(gap: float) -> None:
    """As phase one says, too; x is within the gap of both bounds, and the KKT conditions are met."""
    hierarchy = _with_crossed_bounds(gap)
    found, _ = ActiveSet()(hierarchy)
    assert found.claimed
    assert found.kkt_met()
    assert found.x == pytest.approx([0.5, 1.5], abs=gap)


def test_bounds_that_cross_by_more_are_infeasible() -> None:
    """No compromise between bounds that contradict each other is returned."""
    found, _ = ActiveSet()(_with_crossed_bounds(1e-6))
    assert found.status is Status.INFEASIBLE
    assert np.isnan(found.x).all()


def _with_crossed_bounds(gap: float) -> Hierarchy:
    """x₀ + x₁ = 2 where the bounds of x₀, 0.5 + gap and 0.5, cross, as those of a plan may do."""
    hierarchy = Hierarchy([Level([[1.0, 1.0]], [2.0])], box=([0.5, -5.0], [0.5, 5.0]))
    hierarchy.box_lower[0] += gap
    return hierarchy


def test_contradicting_hard_rows_are_infeasible():
    """x ≥ 1 in a row against x ≤ 0 in the box has no answer that could be sent to a robot."""
    hierarchy = Hierarchy(
        [Level(np.eye(2), np.ones(2))],
        box=(np.array([-1.0, -1.0]), np.zeros(2)),
        limits=Level(np.array([[1.0, 0.0]]), lower=np.ones(1)),
    )
    assert ActiveSet()(hierarchy)[0].status is Status.INFEASIBLE


def test_too_few_iterations_are_admitted():
    """An answer that is not finished does not claim to be."""
    hierarchy = next(h for h in map(large_hierarchy, range(1, 100, 4)) if ActiveSet()(h)[0].iterations > 5)
    assert ActiveSet(iterations=2)(hierarchy)[0].status is Status.ITERATION_LIMIT


def test_a_row_that_is_not_a_number_is_no_answer():
    """NaN that slips into the buffer is answered with FAILED, never with a velocity that claims."""
    hierarchy = random_hierarchy(0)
    hierarchy.A[0, 0] = np.nan
    resolution, _ = ActiveSet()(hierarchy)
    assert not resolution.kkt_met()
    assert not resolution.claimed


def test_weights_inside_a_level_weigh_the_squares():
    """½ w₁ (x − 1)² + ½ w₂ (x + 1)² has its minimum at (w₁ − w₂)/(w₁ + w₂)."""
    hierarchy = Hierarchy([Level([[1.0], [1.0]], [1.0, -1.0], weight=[3.0, 1.0])])
    np.testing.assert_allclose(ActiveSet()(hierarchy)[0].x, [0.5], atol=1e-15)
