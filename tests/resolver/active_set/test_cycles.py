"""Searches that rounding would send round in circles: near rows, and rows that repeat far out of reach."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt import Hierarchy, Level
from taskopt.bench.exact import exact_optimum
from taskopt.hierarchy.proof.judgement import Verdict
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import CERTIFICATE_ROUNDING, SEARCH_SIGN
from taskopt.hierarchy.view import answer_of
from taskopt.jit import COMPILED
from taskopt.resolver.active_set import resolver
from taskopt.resolver.active_set.cycles import repeats
from taskopt.resolver.active_set.lexls import (
    factorise,
    invert_pivots,
    multipliers_of_level,
    new_factor,
    solve_levels,
    unknowns_into,
)
from taskopt.resolver.active_set.resolver import ActiveSet, resolution_of, search_further
from taskopt.resolver.active_set.tick import new_history, tick
from taskopt.resolver.active_set.workspace import (
    Factor,
    Held,
    LevelMultipliers,
    LevelSolution,
    Locks,
    Outcome,
)
from tests.helpers.tight import tight_hierarchy

HERE = Path(__file__).parent
compiled_only = pytest.mark.skipif(not COMPILED, reason="hundreds of factorisations of 48 unknowns")


def run_tick(problem: Hierarchy) -> tuple[int, int]:
    """Resolve a problem by the compiled tick alone; return its outcome and the factorisations."""
    layout = problem.layout
    data = problem.buffer, problem.norm.copy(), layout.offsets, layout.columns
    state, answer = np.empty(layout.width, np.int8), np.empty(layout.answer_size)
    outcome, rounds = tick(*data, (1, 1500), new_history(layout), state, answer)
    return int(outcome), int(rounds)


@compiled_only
def test_a_search_that_cycles_ends_soon_and_the_coarse_one_answers() -> None:
    """Two arms at 128 distance limits, with a row of level 1 repeated in level 2, 25 rad/s² out of reach.

    Rounding times that residual moves directions of 1e-6, other ones for each working set.
    """
    problem = Hierarchy.load(HERE / "repeated_row.npz")
    outcome, rounds = run_tick(problem)
    assert outcome == Outcome.CYCLED
    assert rounds < 1000  # of 4,500
    answer, _ = ActiveSet()(problem)
    assert answer.status is Status.SOLVED
    assert answer.kkt_met()
    assert answer.certificate.judgement.verdict is not Verdict.REFUTED


def test_further_searches_follow_a_cycle_but_no_limit_of_iterations() -> None:
    """Who allows three factorisations gets no more; after a cycle, further searches find the answer."""
    problem = Hierarchy([Level([[1.0, 1.0]], [3.0])], box=([-1.0, -1.0], [1.0, 1.0]))
    answer, state = np.zeros(problem.layout.answer_size), np.zeros(problem.layout.width, np.int8)
    stopped = resolution_of(problem, answer.copy(), state.copy(), Outcome.ITERATION_LIMIT, 3)
    assert stopped.status is Status.ITERATION_LIMIT
    cycled = resolution_of(problem, answer, state, Outcome.CYCLED, 3)
    assert cycled.status is Status.SOLVED
    np.testing.assert_array_equal(cycled.x, [1.0, 1.0])


def test_bounds_that_were_moved_are_moved_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """x keeps the bound 1 as the second search moved it, by 8e-10, and the bound 3 is not seen to stop it."""
    monkeypatch.setattr(resolver, "take_enclosed", lambda *_: False)  # which takes a thousand times longer
    problem = Hierarchy(
        [Level([[1.0, 2.0]], [9.0])], limits=Level([[1.0, 0.0], [0.0, 1.0]], upper=[1.0, 3.0])
    )
    answer, state = np.zeros(problem.layout.answer_size), np.array([0, 0, 1, 0, 1], np.int8)
    answer_of(answer, 2, 3, 1).x[:] = [1.0 + 8e-10, 4.0]
    found = resolution_of(problem, answer, state, Outcome.STILL_PERTURBED, 160)
    assert found.x == pytest.approx(exact_optimum(problem), abs=1e-15)
    assert found.claimed
    assert found.kkt_met()


def test_a_violation_shows_that_bounds_were_moved() -> None:
    """Hard rows that contradict each other by 3e-10 keep that violation: a solved tick says so."""
    assert run_tick(tight_hierarchy(210))[0] == Outcome.STILL_PERTURBED
    assert run_tick(tight_hierarchy(1))[0] == Outcome.SOLVED


def multipliers(
    A: np.ndarray, b: np.ndarray, hard: int, rounding: float = 0.0
) -> tuple[LevelMultipliers, np.ndarray, Factor]:
    """Solve equality rows, `hard` of them hard and the rest level 1; return level 1's multipliers, x, L."""
    count, n = A.shape
    size, offsets = np.linalg.norm(A, axis=1), np.array([0, hard, count])
    state = np.array([Held.FREE] * n + [Held.UPPER] * count, np.int8)
    factor = new_factor(count, 2, state, n)
    factorise(A, size, offsets, state, rounding, factor)
    invert_pivots(factor)
    solution = LevelSolution(np.empty(n), np.empty(count), np.empty(count))
    solve_levels(factor, size, b, 0.0, solution)
    x, out = np.empty(n), LevelMultipliers(np.empty(n + count), np.empty(n + count))
    unknowns_into(factor, solution.z, x)
    multipliers_of_level(A, size, factor, solution, state, x, 1, out)
    return out, x, factor


@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.integers(4, 18))
@settings(max_examples=100, deadline=None)
def test_the_terms_of_a_multiplier_bound_its_rounding(seed: int, rows: int, nearness: int) -> None:
    """Hard rows that differ by 2⁻ⁿ, and a row of level 1 that is an exact combination y of some of them.

    All numbers are dyadic, so A₀ᵀ λ = −r y A₀ has the exact multipliers λ = −r y, r = y·b₀ − b₁. Those of
    the rows with y_i = 0 are zero, and must not look like more.
    """
    rng = np.random.default_rng(seed)
    n = rows + 2
    near = rng.integers(-8, 9, n) + rng.integers(-8, 9, (rows, n)) * 2.0**-nearness
    y = rng.integers(-2, 3, rows) * rng.integers(0, 2, rows)
    if np.linalg.svd(near, compute_uv=False)[-1] < 2.0 ** -(nearness + 4) or not y.any():
        return  # rows that depend on each other, where λ is not the only one; or no row at all
    b = np.append(rng.integers(-4, 5, rows), rng.integers(10, 20)).astype(float)
    out, _, _ = multipliers(np.vstack([near, y @ near]), b, rows)
    exact = -(y @ b[:rows] - b[rows]) * y
    error = np.abs(out.value[n : n + rows] - exact)
    assert (error <= SEARCH_SIGN * out.terms[n : n + rows]).all()


def test_the_terms_are_no_larger_than_the_condition_of_the_rows() -> None:
    """Forty rows with the largest growth |L⁻¹| allows, none: the terms stay those of one equation."""
    n = 40
    A = np.vstack([np.eye(n), np.ones(n) / np.sqrt(n)])
    out, _, _ = multipliers(A, np.ones(n + 1), n)
    assert out.terms[n:].max() < 1e3


def test_the_coarse_search_sets_to_zero_what_is_left_of_a_dependent_row() -> None:
    """A row of level 1 repeats a hard one up to 1e-16, 20 out of reach, above a row of 1e-6.

    As declared, the optimum is x₁ = 1.002; with the row as dependent as the policy of ranks says, it is 1.
    """
    A, b = np.array([[1.0, 0.0], [1.0, 1e-16], [0.0, 1e-6]]), np.array([0.0, 20.0, 1e-6])
    np.testing.assert_allclose(multipliers(A, b, 1)[1], [0.0, 1.002], atol=1e-9)
    np.testing.assert_allclose(multipliers(A, b, 1, rounding=1e-13)[1], [0.0, 1.0], atol=1e-9)


def test_a_coarse_answer_that_is_refuted_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same problem: the exact search finds its optimum; the coarse one alone says that it has none."""
    problem = Hierarchy(
        [Level([[1.0, 0.0]], [0.0]), Level([[1.0, 1e-16], [0.0, 1e-6]], [20.0, 1e-6])],
        box=([-10.0, -10.0], [10.0, 10.0]),
    )
    answer, state = np.zeros(problem.layout.answer_size), np.zeros(problem.layout.width, np.int8)
    assert search_further(problem, answer, state)
    assert answer_of(answer, 2, 3, 2).x == pytest.approx([0.0, 1.002], abs=1e-9)
    monkeypatch.setattr(resolver, "_FURTHER_SEARCHES", ((1, CERTIFICATE_ROUNDING),))
    assert not search_further(problem, answer, state)


@given(st.integers(0, 40), st.integers(1, 40))
def test_a_cycle_is_found_and_nothing_else(before: int, period: int) -> None:
    """Working sets that count up, then go round: found within three times as many drops, never before."""
    width = 8
    seen, locks = np.full(width, -1, np.int64), Locks(np.zeros(width, np.bool_), np.zeros(width, np.bool_))
    for drop in range(1, 4 * (before + period) + 2):
        number = drop if drop <= before else before + 1 + (drop - before - 1) % period
        state = np.array([number >> j & 1 for j in range(width)], np.int8)
        if repeats(seen, drop, state, locks):
            assert drop > before + period
            return
    pytest.fail("no cycle was found")


def test_the_same_working_set_with_other_locks_is_no_cycle() -> None:
    """A row that may not be dropped any more makes the search go another way."""
    seen, state = np.full(2, -1, np.int64), np.array([1, 0], np.int8)
    free, locked = np.zeros(2, np.bool_), np.array([True, False])
    assert not repeats(seen, 1, state, Locks(free, free))
    assert not repeats(seen, 3, state, Locks(locked, free))
    assert not repeats(seen, 3, state, Locks(free, locked))
    assert repeats(seen, 3, state, Locks(free, free))


def test_a_plain_contradiction_is_not_looked_at_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Looking for an enclosure of an optimum that there is not took half a second in a loop."""
    looks: list[Hierarchy] = []
    monkeypatch.setattr(resolver, "take_enclosed", lambda problem, *_: looks.append(problem) or False)
    row, other = np.array([[1.0, 2.0, 0.5]]), np.array([[0.5, 1.0, 0.25]])
    for gap, looked in ((1e-3, False), (1e-7, True)):
        looks.clear()
        hard = Level(np.vstack([row, other]), lower=[1.0 + gap, -np.inf], upper=[np.inf, 0.5])
        found = ActiveSet()(Hierarchy([Level(np.eye(3), np.ones(3))], limits=hard))[0]
        assert found.status is Status.INFEASIBLE
        assert bool(looks) == looked
