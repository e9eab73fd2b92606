"""Exact references, families, and the count of wrong answers that are proven: none, and a lie is seen."""

from dataclasses import replace
from fractions import Fraction
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from taskopt.arrays import Array
from taskopt.bench import asked as requirements
from taskopt.bench import lies as attempts
from taskopt.bench.exact import as_floats, exact_optimum
from taskopt.bench.lies import Lies, compare, try_lies
from taskopt.bench.planted import planted
from taskopt.bench.proof import RESOLVERS, Court, Tally, is_broken, is_wrong, measure, table, verdict
from taskopt.bench.scaled_problems import FAMILIES, scaled_problem
from taskopt.errors import Infeasible
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import Judge, Judgement, Verdict
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import KKT_MET
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
    assert sum(tally.right + tally.wrong for tally in tallies) == 12  # four cold and two warm each
    assert sum(tally.right for tally in tallies) >= 6


@pytest.mark.slow
@pytest.mark.parametrize("name", RESOLVERS)
def test_ordinary_problems_are_solved_by_the_raw_answer(name: str) -> None:
    """Rows, weights and norms within 10^±3, no level among them: right, proven, and quick."""
    for family in ORDINARY:
        *_, tallies = measure(5, (name,), seed=1, families=(family,))
        for tally in tallies:
            assert (tally.right, tally.wrong, tally.unproven, tally.broken) == (
                6 if name.startswith("wqp/") else 9,
                0,
                0,
                0,
            ), tally
            assert tally.iterations <= 1000 or name == "wqp/proxqp", tally
            assert np.median(tally.bounds) <= 1e-10


def test_the_tally_sees_a_wrong_answer_that_is_proven() -> None:
    """Planted: a verdict that proves x + 1, and a bound of nothing."""
    _, hierarchy = scaled_problem("well scaled", 0)
    court, found = Court(hierarchy), resolve(hierarchy)
    exact, tally = court.exact, Tally("well scaled", "active-set")
    court.hear(tally, found)
    assert (tally.right, tally.unproven, tally.wrong, tally.clean) == (1, 0, 0, True)
    lie = Judgement(np.zeros(hierarchy.n), Verdict.PROVEN, (), "planted")
    tally.count(found, lie, [value + 1 for value in exact])
    assert (tally.wrong, tally.claimed, tally.proven, tally.broken, tally.clean) == (1, 1, 1, 1, False)
    shown = StringIO()
    Console(file=shown, width=120).print(table([tally, tally]))
    assert "well scaled" in shown.getvalue()
    assert "2 wrong, of which 2 are claimed and 2 are proven; 2 error bounds" in verdict([tally, tally])


FINE = Tally("rows 1e±3", "active-set", right=1000, unproven=9, bounds=[1e-16, 1e-11, 1e-3])
TOLD = Lies("rows 1e±3", moved=3, ratios=[1.0, 900.0, 1e9])


def test_measurements_that_show_what_is_asked_for() -> None:
    """Shares and medians below what is asked for, no lie proven, families with dependent rows apart."""
    apart = Tally("dependent rows", "active-set", right=10, unproven=9)
    assert all(one.met for one in requirements.asked([FINE, apart], [TOLD]))
    assert all(one.met for one in requirements.asked([], []))


@pytest.mark.parametrize(
    ("tally", "lies", "missed"),
    [
        (replace(FINE, proven=1), TOLD, "wrong and proven"),
        (replace(FINE, broken=1), TOLD, "error bound below the true error"),
        (FINE, replace(TOLD, broken=1), "error bound below the true error"),
        (replace(FINE, unproven=11), TOLD, "right but not proven, share of a family, within 10^±3"),
        (
            replace(FINE, family="rows 1e±6", unproven=51),
            TOLD,
            "right but not proven, share of a family, beyond",
        ),
        (replace(FINE, bounds=[2e-10]), TOLD, "error bound / max|x|, median, within 10^±3"),
        (FINE, replace(TOLD, ratios=[1001.0]), "error bound / true error, median of moved answers"),
        (FINE, replace(TOLD, proven=1), "lies proven"),
        (FINE, replace(TOLD, apart=1), "pairs of answers further apart than their bounds"),
    ],
)
def test_a_measurement_that_misses_what_is_asked_for_is_named(tally: Tally, lies: Lies, missed: str) -> None:
    """One figure too many, and no other requirement is missed."""
    found = requirements.asked([tally], [lies])
    assert [one.what for one in found if not one.met] == [missed]
    shown = StringIO()
    Console(file=shown, width=120).print(requirements.table(found))
    assert shown.getvalue().count("missed") == 1


@pytest.mark.parametrize(
    ("error", "size", "wrong"), [(0.9e-8, 1.0, False), (1.1e-8, 0.0, True), (1.1e-8, 2.0, False)]
)
def test_what_counts_as_wrong(error: float, size: float, wrong: bool) -> None:
    """1e-8 of max(1, |x_i|), entry by entry: none borrows from a larger one; no number is wrong."""
    exact = [Fraction(size), Fraction(10**6)]
    assert is_wrong(np.array([size + error, 1e6]), exact) == wrong
    assert is_wrong(np.array([np.nan, 1e6]), exact)
    x = np.array([size + error, 1e6])
    for bound, broken in (([0.5 * error, 1.0], True), ([2.0 * error, 0.0], False)):
        judgement = Judgement(np.array(bound), Verdict.UNDECIDED, (), "planted")
        assert is_broken(judgement, x, exact) == broken
        assert not is_broken(replace(judgement, verdict=Verdict.PROVEN_IF), x, exact)


def test_lies_are_not_believed() -> None:
    """Moved answers, toggled sides, planted multipliers, from two families; the bounds are sharp."""
    for family in ("well scaled", "weights 1e±6"):
        *_, lies = try_lies(family, 12, seed=5)
        assert min(lies.toggled, lies.planted) >= 12
        assert lies.moved >= 9
        assert 1.0 <= np.min(lies.ratios) <= np.median(lies.ratios) <= 1e3
        assert lies.clean, lies
        shown = StringIO()
        Console(file=shown, width=120).print(attempts.table([lies]))
        assert "…" not in shown.getvalue()
        assert f"{lies.toggled} active sets with a side toggled" in attempts.verdict([lies])


def test_planted_multipliers_hide_wrong_answers_from_residuals() -> None:
    """The search finds wrong answers whose KKT residuals pass for those of an optimum; all are refuted."""
    hidden = 0
    for seed in range(8):
        _, hierarchy = scaled_problem("well scaled", seed)
        court, found = Court(hierarchy), resolve(hierarchy)
        rng = np.random.default_rng(seed)
        for _ in range(6):
            lie = planted(hierarchy, as_floats(court.exact), found.state, rng)
            if lie.residual <= KKT_MET and is_wrong(lie.x, court.exact):
                hidden += 1
                assert court.judge(lie.x, lie.state).verdict is Verdict.REFUTED
    assert hidden > 0


def test_two_answers_never_contradict_their_bounds() -> None:
    """Up to 40 unknowns, the second judged in reverse order; a planted lie in one of them is seen."""
    lies = Lies("well scaled")
    assert sum(1 for _ in compare(lies, 2, ("active-set", "hqp/daqp"), seed=5)) == 2
    assert (lies.pairs, lies.apart) == (2, 0)


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_two_answers_never_contradict_their_bounds_in_any_family(family: str) -> None:
    """One problem of up to 40 unknowns of each family."""
    lies = Lies(family)
    assert sum(1 for _ in compare(lies, 1, ("active-set", "hqp/clarabel"), seed=5)) == 1
    assert lies.pairs + lies.unpaired == 1
    assert lies.clean, lies


def test_a_judge_that_believes_everything_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: every x is proven, with a bound of 1e-12; answers of two resolvers then contradict it."""

    def believe(self: Judge, x: Array, state: object = None) -> Judgement:
        return Judgement(np.full(len(x), 1e-12), Verdict.PROVEN, (), "planted")

    monkeypatch.setattr(Judge, "__call__", believe)
    *_, lies = try_lies("well scaled", 4, seed=5)
    assert lies.proven > 5
    assert lies.broken > 5
    assert not lies.clean
    monkeypatch.setattr(attempts, "judge", lambda hierarchy, x, state: believe(hierarchy, x, state))
    monkeypatch.setattr(attempts, "resolve", lambda hierarchy, name: _spoilt(hierarchy, name == "pinv"))
    pairs = Lies("well scaled")
    assert len(list(compare(pairs, 1, ("active-set", "pinv"), seed=5))) == pairs.apart == 1


def _spoilt(hierarchy: Hierarchy, spoil: bool) -> Resolution:
    """Return the optimum, or one that is off by 1e-6."""
    found = resolve(hierarchy)
    if spoil:
        found.x[0] += 1e-6
    return found
