"""Trials: what is measured of an answer, with resolvers that lie in every way."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from taskopt.bench.comparison.catalogue import problem_set
from taskopt.bench.comparison.reference import Reference, reference
from taskopt.bench.comparison.trial import BLANK, ROW, SETTINGS, resolver_in, trial, without_answer
from taskopt.bench.comparison.worker import Bank, Cell, answers
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import Verdict, judge
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import Memory, answered
from taskopt.resolver.registry import resolver

COLD, WARM, DEFAULTS = SETTINGS["cold"], SETTINGS["warm"], SETTINGS["defaults"]


@dataclass
class Liar:
    """Answers as active-set does, moved by `off`, with a status of its own; it counts its memories."""

    off: float = 0.0
    status: Status = Status.SOLVED
    memories: int = 0
    name: str = "liar"
    strict: bool = True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        self.memories += memory is not None
        found, after = resolver("active-set")(hierarchy)
        x = np.nan_to_num(found.x) + self.off * np.eye(hierarchy.n)[0]
        return answered(hierarchy, x, found.multipliers, found.state, self.status)[0], after

    def closed_form(self, hierarchy: Hierarchy) -> np.ndarray:
        return np.zeros(hierarchy.n)


def known(name: str = "velocity-bounds", count: int = 3) -> list[Reference]:
    return [reference(problem) for problem in problem_set(name).sequences[0].problems[:count]]


def told(liar: Any, references: list[Reference], setting: Any = COLD) -> list[dict[str, Any]]:
    return [*trial(references, liar, setting, repeats=1)]


def test_the_exact_answer_is_that_of_scipy() -> None:
    """The cost of the first level is the least that SciPy's bounded least squares finds inside the box."""
    for name in ("velocity-bounds", "limits"):
        (first,) = known(name, 1)
        level, problem = first.problem.levels[0], first.problem
        box = problem.box_lower, problem.box_upper
        best = lsq_linear(level.A, level.lower, box, method="bvls", tol=1e-14)
        assert level.cost(first.x) == pytest.approx(best.cost, rel=1e-8, abs=1e-14)
        assert first.error < 1e-10


def test_references_say_where_they_come_from() -> None:
    """Rational for small problems of short numbers, our proof for recorded ones, none for contradictions."""
    kinds = [known(name, 1)[0].kind for name in ("small", "limits", "contradicting")]
    assert kinds == ["rational", "proof", "infeasible"]


def test_a_right_answer_is_proven_and_a_wrong_one_refuted() -> None:
    """The distance of a wrong one is what it was moved by."""
    references = known()
    right, wrong = told(Liar(), references), told(Liar(1e-3), references)
    assert [row["verdict"] for row in right] == ["proven"] * 3
    assert max(row["distance"] for row in right) < 1e-12
    assert [row["verdict"] for row in wrong] == ["refuted"] * 3
    for row, one in zip(wrong, references, strict=True):
        assert row["distance"] == pytest.approx(1e-3 / max(1.0, np.abs(one.x).max()), rel=1e-6)
        assert row["regret"] > 0.0 or row["outside"] > 1e-4
    assert all(row["wall"] > 0.0 and row["cpu"] >= 0.0 for row in wrong)


def test_what_claims_nothing_is_not_judged() -> None:
    """Its distance is measured all the same."""
    rows = told(Liar(1e-3, Status.FORMULA), known())
    assert {(row["verdict"], row["claimed"]) for row in rows} == {("no claim", False)}
    assert all(row["distance"] > 1e-5 for row in rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "status", "verdict"),
    [
        ("velocity-bounds", Status.INFEASIBLE, "refuted"),
        ("contradicting", Status.INFEASIBLE, "proven"),
        ("contradicting", Status.SOLVED, "refuted"),
        ("contradicting", Status.FAILED, "no claim"),
    ],
)
def test_that_there_is_no_answer_is_a_claim(name: str, status: Status, verdict: str) -> None:
    """It is right where limits contradict each other, and an answer is then wrong."""
    (row,) = told(Liar(status=status), known(name, 1))
    assert row["verdict"] == verdict
    assert row["claimed"] == (status is not Status.FAILED)


def test_weights_are_judged_by_their_own_problem_and_measured_by_the_strict_one() -> None:
    """A weighted program that is solved exactly is proven, and far from the strict optimum."""
    rows = told(resolver("wqp/daqp"), known("small", 2))
    hard = [*trial([reference(strict_levels())], resolver("wqp/daqp"), COLD, 1)]
    assert [row["verdict"] for row in [*rows, *hard]] == ["proven"] * 3
    assert hard[0]["distance"] > 1e-6
    assert hard[0]["level"] == 1


def strict_levels() -> Hierarchy:
    """Two levels that contradict each other."""
    return Hierarchy([Level([[1.0, 1.0]], [1.0]), Level(np.eye(2), [8.0, 8.0])])


def test_only_a_warm_trial_hands_over_the_memory() -> None:
    """Each problem but the first has the memory of the one before."""
    cold, warm = Liar(), Liar()
    told(cold, known())
    told(warm, known(), WARM)
    assert (cold.memories, warm.memories) == (0, 2)


def test_what_refuses_is_noted() -> None:
    """A formula that knows no inequality says so in every row, and the rows are whole."""
    unequal = Hierarchy([Level(np.eye(2), lower=[0.0, 0.0], upper=[1.0, 1.0])])
    rows = told(resolver("pinv"), [reference(unequal)])
    assert rows[0]["status"] == "REFUSED"
    assert "knows no inequality" in rows[0]["note"]
    assert rows[0].keys() == BLANK.keys() == ROW.keys() == without_answer(0, "CRASHED", "").keys()


def test_default_tolerances_are_looser() -> None:
    """OSQP stops at 1e-3 if nobody asks for more, and so is refuted where it is proven otherwise."""
    references = known()
    asked = told(resolver_in(COLD, "hqp/osqp"), references)
    default = told(resolver_in(DEFAULTS, "hqp/osqp"), references)
    assert max(row["distance"] for row in asked) < 1e-8 < max(row["distance"] for row in default)
    with pytest.raises(InvalidValue, match="no setting 'hot'"):
        next(answers(Bank(), Cell("small", "ties 0", "pinv", "hot"), 1))


def test_a_cell_tells_when_it_is_ready() -> None:
    """Twice None, for the references and the untimed answer, then a row for each problem."""
    messages = [*answers(Bank(), Cell("small", "ties 0", "hqp/daqp", "cold"), 1)]
    assert messages[:2] == [None, None]
    assert [row["index"] for row in messages[2:] if row] == [0, 1]


def test_what_is_proven_on_a_condition_is_told_from_what_is_undecided() -> None:
    """A row is another one up to rounding: read to the last digit, the two contradict each other."""
    J = np.array([[0.1, 0.2, 0.3]])
    near = J * (1.0 + 2.0**-52)
    problem = Hierarchy([Level(J, [1.0]), Level(near, [1.5])])
    rows = [*trial([reference(problem)], resolver("active-set"), SETTINGS["cold"], repeats=1)]
    assert [row["verdict"] for row in rows] == ["proven if"]
    assert (rows[0]["reference"], rows[0]["distance"]) == ("condition", pytest.approx(0.0, abs=1e-15))
    assert [row["verdict"] for row in told(Liar(1e-3), [reference(problem)])] == ["refuted if"]
    exact = Hierarchy([Level(J, [1.0]), Level(J, [1.5])])
    rows = [*trial([reference(exact)], resolver("active-set"), SETTINGS["cold"], repeats=1)]
    assert [row["verdict"] for row in rows] == ["proven"]


def test_time_inside_a_solver_is_a_part_of_the_time_around_it() -> None:
    """It is zero for a resolver without a package, and less than the wall clock for one with."""
    known = [reference(Hierarchy([Level([[1.0, 1.0]], [3.0])], box=([-1.0, -1.0], [1.0, 1.0])))]
    (own,), (other,) = ([*trial(known, resolver(name), COLD)] for name in ("active-set", "hqp/daqp"))
    assert own["inside"] == 0.0
    assert 0.0 < float(other["inside"]) < float(other["wall"])


def test_an_answer_that_suggests_nothing_is_judged_by_the_optimum() -> None:
    """Far from the optimum, an answer and its active set prove nothing; the reference's active set does."""
    (known,) = [reference(problem_set("random-20").sequences[0].problems[0])]
    assert known.kind == "proof"
    found = resolver("active-set")(known.problem)[0]
    lie = found.x + 2e-3 * np.random.default_rng(1).standard_normal(known.problem.n)
    state = np.zeros_like(found.state)
    assert judge(known.problem, lie, state).verdict is Verdict.UNDECIDED
    wrong = answered(known.problem, lie, found.multipliers, state, Status.SOLVED)[0]
    assert known.judge(wrong).verdict is Verdict.REFUTED
    assert known.judge(found).proven


def test_no_resolver_is_compared_with_itself() -> None:
    """The reference is the rounded enclosure: it is not always the very answer that led to it."""
    known = [reference(problem) for problem in problem_set("random-20").sequences[0].problems]
    rows = told(resolver("active-set"), known)
    assert all(one.error < 1e-13 for one in known)
    assert 0.0 < max(row["distance"] for row in rows) < 1e-12
