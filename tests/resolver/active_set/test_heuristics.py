"""Each heuristic of the active set is needed: these problems are not solved, or not so soon, without it.

`taskopt.resolver.active_set` lists the heuristics by letter. The seeds were found by drawing some thousand
problems of each family and solving them with one heuristic switched off at a time.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.jit import COMPILED
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory
from tests.helpers.tight import tight_hierarchy
from tests.resolver.active_set.families import any_guess, cone, degenerate, near_pairs, saturated

Family = Callable[[int], Hierarchy]
compiled_only = pytest.mark.skipif(
    not COMPILED, reason="it lies at the edge of rounding, and NumPy's sums differ by processor"
)


def assert_solved(family: Family, seed: int, guess: bool = False) -> Resolution:
    """Resolve a problem by the search alone, from nothing or from a random guess; it must be proven."""
    hierarchy = family(seed)
    memory = any_guess(seed, hierarchy) if guess else None
    resolution, _ = ActiveSet(fast_path=False)(hierarchy, memory)
    assert resolution.status is Status.SOLVED, seed
    assert resolution.kkt_met(), seed
    return resolution


@pytest.mark.parametrize(
    ("family", "seed", "guess"),
    [
        pytest.param(saturated, 483, True, marks=compiled_only),
        (near_pairs, 2, False),
        (near_pairs, 140, True),
        (near_pairs, 221, True),
    ],
)
def test_a_second_start_without_the_guess_finds_the_proof(family: Family, seed: int, guess: bool) -> None:
    """[c] The search from a guess ends without a proof; from the empty working set it ends with one."""
    assert_solved(family, seed, guess)


@pytest.mark.parametrize("seed", [6, 8, 14, 20, 32, 94])
def test_perturbed_bounds_end_a_search_among_ties(seed: int) -> None:
    """[d] Up to 150 limits tie at zero: without the perturbed second search, it does not end."""
    assert_solved(cone, seed)


@pytest.mark.parametrize("seed", [117, 261, 434, 628])
def test_short_steps_between_perturbed_bounds_are_progress(seed: int) -> None:
    """[g] In the second search a step of 1e-10 unlocks rows: it is of the size of the perturbation."""
    assert_solved(cone, seed)


@pytest.mark.parametrize("seed", [21, 26, 77])
def test_the_second_search_starts_where_the_hard_rows_hold(seed: int) -> None:
    """[d] x = 0 keeps all hard rows; a second search from the empty working set ends without a proof."""
    assert_solved(near_pairs, seed, guess=True)


@pytest.mark.parametrize("seed", [1, 24, 44, 50])
def test_the_first_search_is_given_up_in_time(seed: int) -> None:
    """[d] The second search gets most of the factorisations; the first would use them all."""
    assert_solved(near_pairs, seed, guess=True)


@pytest.mark.parametrize(
    ("family", "seed"), [pytest.param(saturated, 483, marks=compiled_only), (saturated, 5)]
)
def test_the_perturbation_is_taken_out_again(family: Family, seed: int) -> None:
    """[e] With the perturbed bounds, the answer would be off by more than what the certificate allows."""
    assert_solved(family, seed)


@pytest.mark.parametrize("seed", [3, 22, 29, 44, 171, 210])
def test_all_rows_that_the_guess_violates_join_at_once(seed: int) -> None:
    """[f] Bounds lie at the optimum, or a hair beside it."""
    assert_solved(tight_hierarchy, seed)


@pytest.mark.parametrize("seed", [5, 76, 541])
def test_a_row_that_comes_straight_back_is_locked(seed: int) -> None:
    """[g] Near a singularity a row is dropped and added over and over: 550 factorisations, not 36."""
    assert assert_solved(saturated, seed).iterations < 150


def test_a_dropped_row_beyond_its_other_bound_is_held_there() -> None:
    """[i] Rows with bounds on both sides: one that leaves its upper bound may lie below its lower one."""
    assert_solved(degenerate, 448)


@pytest.mark.parametrize(
    ("family", "seed"), [(saturated, 5), (saturated, 76), (near_pairs, 63), (near_pairs, 334)]
)
def test_x_is_proven_by_multipliers_found_for_it(family: Family, seed: int) -> None:
    """[j] x is right, but the multipliers that its working set leads to do not prove it."""
    assert_solved(family, seed)


def test_an_unknown_at_a_bound_is_exactly_there() -> None:
    """The scaling by √W is undone by putting x onto the bounds that hold it, and into the box."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        n = 5
        box, norm = rng.uniform(0.05, 0.5, n), rng.uniform(0.1, 10.0, n)
        hierarchy = Hierarchy(
            [Level(rng.normal(size=(3, n)), 9.0 * rng.normal(size=3))], (-box, box), norm=norm
        )
        resolution, memory = ActiveSet(fast_path=False)(hierarchy)
        held = memory.state[:n] != 0
        np.testing.assert_array_equal(resolution.x[held], (memory.state[:n] * box)[held])


def test_no_unknown_leaves_the_box_by_rounding() -> None:
    """A bound within SEARCH_BOX of the optimum does not block the step, and is kept all the same."""
    upper = 1.0 - 5e-13
    hierarchy = Hierarchy([Level([[1.0]], [1.0])], box=([-1.0], [upper]))
    assert ActiveSet(fast_path=False)(hierarchy)[0].x[0] <= upper


def posture(
    target: list[float], lower: list[float], upper: list[float], limits: Level | None = None
) -> Hierarchy:
    """A last level of joint rows, x = target, as a robot's plan declares them, inside a box."""
    n = len(target)
    declared = Hierarchy([Level(np.eye(n), target)], (lower, upper), limits)
    hard = 0 if limits is None else len(limits.lower)
    layout = replace(declared.layout, column=(*(-1,) * hard, *range(n)))
    return Hierarchy.view(layout, declared.buffer, declared.norm)


def test_the_fast_path_does_not_hold_a_bound_with_the_wrong_sign() -> None:
    """[b] The target lies 3e-9 inside a bound that was active: the answer is the target, not the bound."""
    hierarchy = posture([1.0 - 3e-9], [-10.0], [1.0])
    resolution, memory = ActiveSet()(hierarchy, Memory(np.array([1, 0], dtype=np.int8)))
    assert resolution.iterations == 0
    assert memory.state[0] == 0
    np.testing.assert_allclose(resolution.x, [1.0 - 3e-9], rtol=0, atol=1e-13)


def test_the_fast_path_does_not_pass_a_bound() -> None:
    """[b] The target lies 5e-10 outside a bound that was not active: the bound becomes active."""
    resolution, memory = ActiveSet()(posture([1.0 + 5e-10], [-10.0], [1.0]))
    assert resolution.iterations == 0
    assert memory.state[0] == 1
    assert resolution.x[0] == 1.0


def test_the_fast_path_does_not_break_a_limit() -> None:
    """[b] The target lies 5e-10 outside a hard row: the answer is on it."""
    limit = Level([[1.0, 1.0]], upper=[2.0 - 5e-10])
    resolution, _ = ActiveSet()(posture([1.0, 1.0], [-9.0, -9.0], [9.0, 9.0], limit))
    assert resolution.x.sum() <= 2.0 - 5e-10 + 1e-12


def test_the_fast_path_changes_a_few_bounds_by_itself() -> None:
    """[b] Three bounds become active at one tick: the search is not needed."""
    resolution, memory = ActiveSet()(posture([2.0, -3.0, 4.0, 0.5], [-1.0] * 4, [1.0] * 4))
    assert resolution.iterations == 0
    np.testing.assert_array_equal(memory.state[:4], [1, -1, 1, 0])
    np.testing.assert_array_equal(resolution.x, [1.0, -1.0, 1.0, 0.5])


@pytest.mark.parametrize("smallest", [1e-3, 2e-3])
def test_the_refinement_gains_what_normal_equations_lose(smallest: float) -> None:
    """[b] σ_min is 1e-3, which the fast path accepts: x is as by orthogonal factorisation, to 1e-11."""
    worst = 0.0
    for seed in range(20):
        hierarchy = nearly_singular(seed, smallest)
        fast, _ = ActiveSet()(hierarchy)
        assert fast.iterations == 0
        worst = max(worst, np.abs(fast.x - ActiveSet(fast_path=False)(hierarchy)[0].x).max())
    assert worst < 1e-11


def test_the_fast_path_leaves_what_is_nearly_singular_to_the_search() -> None:
    """[b] With σ_min of 1e-6 the square of the condition number is too much for normal equations."""
    for seed in range(10):
        assert ActiveSet()(nearly_singular(seed, 1e-6))[0].iterations > 0


def nearly_singular(seed: int, smallest: float) -> Hierarchy:
    """A 6 × 7 Jacobian with a given smallest singular value, with a target that can be met, and a posture."""
    rng = np.random.default_rng([seed, 23])
    U, sigma, Vt = np.linalg.svd(rng.normal(size=(6, 7)))
    sigma[:] = np.linspace(1.0, 0.5, 6)
    sigma[-1] = smallest
    J = (U * sigma) @ Vt[:6]
    return Hierarchy([Level(J, J @ rng.normal(size=7))], norm=np.ones(7))
