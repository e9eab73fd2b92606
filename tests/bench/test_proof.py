"""Exact references, families, and the count of wrong answers that are proven: none, and a lie is seen."""

from fractions import Fraction
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from taskopt.arrays import Array
from taskopt.bench import lies as attempts
from taskopt.bench.exact import as_floats, exact_optimum
from taskopt.bench.lies import Lies, compare, try_lies
from taskopt.bench.proof import RESOLVERS, Tally, is_broken, is_wrong, judged, measure, table, verdict
from taskopt.bench.scaled_problems import FAMILIES, scaled_problem
from taskopt.errors import Infeasible
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import Judgement, Verdict
from taskopt.resolver.registry import resolve
from tests.helpers.oracles import lexicographic_optimum, random_hierarchy

ORDINARY = ("well scaled", "no level", "rows 1e±3", "weights 1e±3")


@pytest.mark.parametrize("seed", range(25))
def test_two_exact_methods_agree_to_the_last_bit(seed: int) -> None:
    """Criss-cross on the complementarity problem, and a primal active set with Bland's rule."""
    hierarchy = random_hierarchy(seed)
    np.testing.assert_array_equal(as_floats(exact_optimum(hierarchy)), lexicographic_optimum(hierarchy))


@pytest.mark.parametrize("family", FAMILIES)
def test_two_exact_methods_agree_on_every_family(family: str) -> None:
    """Numbers that differ by twelve powers of ten are as exact as any."""
    for seed in range(2):
        _, hierarchy = scaled_problem(family, seed, most=4)
        np.testing.assert_array_equal(as_floats(exact_optimum(hierarchy)), lexicographic_optimum(hierarchy))


def test_what_contradicts_itself_has_no_exact_optimum() -> None:
    """By 1e-16, and by hard equalities."""
    above = np.nextafter(1.0, 2.0)
    with pytest.raises(Infeasible, match="limits contradict"):
        exact_optimum(Hierarchy([], box=([-1.0], [1.0]), limits=Level([[1.0]], lower=[above])))
    with pytest.raises(Infeasible, match="equalities contradict"):
        exact_optimum(Hierarchy([], limits=Level([[1.0], [2.0]], [1.0, 2.0 * above])))


@pytest.mark.parametrize("family", FAMILIES)
def test_nothing_wrong_is_proven(family: str) -> None:
    """A seeded sample of every family: no wrong answer is proven, and no bound is below its error."""
    *_, tallies = measure(4, ("active-set", "hqp/daqp"), seed=3, families=(family,))
    assert all(tally.clean for tally in tallies)
    assert sum(tally.right + tally.wrong for tally in tallies) == 16
    assert sum(tally.right for tally in tallies) >= 8


@pytest.mark.parametrize("name", RESOLVERS)
def test_ordinary_problems_are_solved_by_the_raw_answer(name: str) -> None:
    """Rows, weights and norms within 10^±3, no level among them: right, proven, and quick."""
    for family in ORDINARY:
        *_, tallies = measure(5, (name,), seed=1, families=(family,))
        for tally in tallies:
            assert (tally.right, tally.unproven, tally.broken) == (5, 0, 0), tally
            assert tally.iterations <= 1000, tally


def test_the_tally_sees_a_wrong_answer_that_is_proven() -> None:
    """Planted: a verdict that proves x + 1, and a bound of nothing."""
    _, hierarchy = scaled_problem("well scaled", 0)
    exact, found = exact_optimum(hierarchy), resolve(hierarchy)
    tally = Tally("well scaled", "active-set", "cold")
    tally.count(found, judged(hierarchy, found), exact)
    assert (tally.right, tally.unproven, tally.wrong, tally.clean) == (1, 0, 0, True)
    lie = Judgement(np.zeros(hierarchy.n), Verdict.PROVEN, (), "planted")
    tally.count(found, lie, [value + 1 for value in exact])
    assert (tally.wrong, tally.claimed, tally.proven, tally.broken, tally.clean) == (1, 1, 1, 1, False)
    shown = StringIO()
    Console(file=shown, width=120).print(table([tally, tally]))
    assert "well scaled" in shown.getvalue()
    assert "2 wrong, of which 2 claim to be solved and 2 are proven; 2 error bounds" in verdict(
        [tally, tally]
    )


@pytest.mark.parametrize(
    ("error", "size", "wrong"), [(0.9e-8, 1.0, False), (1.1e-8, 0.0, True), (1.1e-8, 2.0, False)]
)
def test_what_counts_as_wrong(error: float, size: float, wrong: bool) -> None:
    """1e-8 of max(1, |x_i|), entry by entry: none borrows from a larger one; no number is wrong."""
    exact = [Fraction(size), Fraction(10**6)]
    assert is_wrong(np.array([size + error, 1e6]), exact) == wrong
    assert is_wrong(np.array([np.nan, 1e6]), exact)
    assert is_broken(np.array([0.5 * error, 1.0]), np.array([size + error, 1e6]), exact)
    assert not is_broken(np.array([2.0 * error, 0.0]), np.array([size + error, 1e6]), exact)


def test_lies_are_not_believed() -> None:
    """Moved answers, toggled sides, and two answers to larger problems, from a few families."""
    lies = Lies()
    steps = sum(1 for _ in try_lies(lies, 2, seed=5, families=("well scaled", "weights 1e±6")))
    assert (steps, lies.moved) == (4, 36)
    assert lies.toggled > 4
    assert np.median(lies.ratios) <= 1e3
    assert lies.clean, lies


@pytest.mark.slow
def test_two_answers_never_contradict_their_bounds() -> None:
    """Up to 40 unknowns, one problem of each family."""
    lies = Lies()
    assert sum(1 for _ in compare(lies, 1, ("active-set", "hqp/clarabel"), seed=5)) == len(FAMILIES)
    assert lies.pairs > 6
    assert lies.clean, lies


def test_a_judge_that_believes_everything_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: every x is proven, with a bound of 1e-12."""

    def believe(hierarchy: Hierarchy, x: Array, state: object) -> Judgement:
        return Judgement(np.full(hierarchy.n, 1e-12), Verdict.PROVEN, (), "planted")

    monkeypatch.setattr(attempts, "judge", believe)
    lies = Lies()
    for _ in try_lies(lies, 1, seed=5, families=("well scaled",)):
        pass
    assert lies.proven > 5
    assert lies.broken > 5
    assert not lies.clean
