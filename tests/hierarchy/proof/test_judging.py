"""An answer is judged by its distance from the exact optimum, and no wrong one is ever proven."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import Verdict, judge
from taskopt.hierarchy.proof.prover import MOST_UNDECIDED
from taskopt.resolver.active_set.resolver import ActiveSet
from tests.helpers.badly_scaled import FAMILIES, badly_scaled
from tests.helpers.oracles import lexicographic_optimum

SEEDS = st.integers(0, 2**32 - 1)
EYE = np.eye(2)
ORACLE = 2.0**-52  # the oracle rounds its exact answer to doubles
LIES = {  # wrong answers that residuals relative to the largest row of a level pass as proven
    "light row": (Hierarchy([Level([[1.0, 0.0], [0.0, 1e-4]], [1.0, 1e-4])]), [1.0, 0.0]),
    "weights": (Hierarchy([Level(EYE, [1.0, 1.0], weight=[1e9, 1.0])]), [1.0, 500.0]),
    "norm": (Hierarchy([Level([[1.0, 0.0, 0.0]], [1.0])], norm=[1.0, 1.0, 1e-8]), [1.0, 0.0, 1.0]),
    "large target": (Hierarchy([Level(EYE, [1e9, 1.0])]), [1e9, 0.0]),
    "row that is not active": (
        Hierarchy(
            [Level([[1.0, 0.0]], [0.0]), Level([[0.0, 1.0]], [0.0])],
            limits=Level([[1.0, 0.05]], upper=[100.0]),
        ),
        [-5e-9, 7.0],
    ),
}  # fmt: skip


def is_wrong(x: np.ndarray, optimum: np.ndarray) -> bool:
    return bool((np.abs(x - optimum) > 1.0001e-8 * np.maximum(1.0, np.abs(optimum))).any())


def check(hierarchy: Hierarchy, x: np.ndarray, optimum: np.ndarray, state=None) -> Verdict:
    """Judge x, and compare with the exact optimum: the bound holds, and the verdict is true."""
    judgement = judge(hierarchy, x, state)
    if judgement.verdict is not Verdict.PROVEN_IF:
        assert (np.abs(x - optimum) <= judgement.error_bound + ORACLE * np.abs(optimum)).all()
    assert not (judgement.proven and is_wrong(x, optimum))
    assert not (judgement.verdict is Verdict.REFUTED and not is_wrong(x, optimum))
    return judgement.verdict


@pytest.mark.parametrize("lie", LIES)
def test_a_wrong_answer_beside_large_numbers_is_refuted(lie: str) -> None:
    """No entry borrows accuracy from a larger one, and no row from a heavier one."""
    hierarchy, x = LIES[lie]
    judgement = judge(hierarchy, x)
    assert judgement.verdict is Verdict.REFUTED
    assert judge(hierarchy, lexicographic_optimum(hierarchy)).proven


@pytest.mark.parametrize("family", FAMILIES)
def test_right_answers_are_proven_in_every_family(family: str) -> None:
    """The exact optimum is proven without any hint, and so is the answer of the active-set method."""
    for seed in range(8):
        hierarchy = badly_scaled(family, seed)
        optimum = lexicographic_optimum(hierarchy)
        assert check(hierarchy, optimum, optimum) is Verdict.PROVEN
        answer, _ = ActiveSet()(hierarchy)
        wrong = is_wrong(answer.x, optimum)
        assert (check(hierarchy, answer.x, optimum, answer.state) is Verdict.PROVEN) is not wrong


@pytest.mark.slow
@given(st.sampled_from(FAMILIES), SEEDS)
@settings(deadline=None, max_examples=40)
def test_perturbed_answers_are_bounded_and_never_proven_wrongly(family: str, seed: int) -> None:
    """The bound is never below the true error, with the right active set and with one that has a lie."""
    hierarchy = badly_scaled(family, seed)
    optimum = lexicographic_optimum(hierarchy)
    rng = np.random.default_rng(seed)
    x = optimum + 10.0 ** rng.uniform(-9.0, -1.0) * rng.standard_normal(hierarchy.n)
    check(hierarchy, x, optimum)
    lie = ActiveSet()(hierarchy)[0].state.copy()
    for i in rng.integers(0, len(lie), 2):
        lie[i] = rng.integers(-1, 2)
    check(hierarchy, x, optimum, lie)


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_many_answers_of_every_family(family: str) -> None:
    """At most one right answer in a hundred is not proven; the bound is near the error in the median."""
    missed, ratios = 0, []
    for seed in range(1000, 1300):
        hierarchy = badly_scaled(family, seed)
        optimum = lexicographic_optimum(hierarchy)
        missed += check(hierarchy, optimum, optimum) is not Verdict.PROVEN
        rng = np.random.default_rng(seed)
        x = optimum + 10.0 ** rng.uniform(-9.0, -1.0) * rng.standard_normal(hierarchy.n)
        check(hierarchy, x, optimum)
        ratios.append(float(np.median(judge(hierarchy, x).error_bound / np.abs(x - optimum))))
    assert missed <= 3
    assert np.median(ratios) < 10.0


def test_a_row_that_depends_up_to_rounding_is_named() -> None:
    """Exactly, x₁ = 1e16 meets both levels; the answer that keeps to level 1 is proven conditionally."""
    hierarchy = Hierarchy([Level([[1.0, 0.0]], [0.0]), Level([[1.0, 1e-16]], [1.0])])
    judgement = judge(hierarchy, [0.0, 0.0])
    assert judgement.verdict is Verdict.PROVEN_IF
    assert judgement.rows == ("level 2/row 0",)
    assert "level 2/row 0" in judgement.reason
    assert not judgement.proven
    assert judge(hierarchy, [0.0, 1e16]).proven
    assert judge(hierarchy, [0.0, 1.0]).verdict is Verdict.REFUTED


def test_what_is_wrong_on_the_condition_only_is_said_to_be_so() -> None:
    """Double precision cannot carry two rows that differ in the last digit; without the difference it can."""
    J = np.array([[0.1, 0.2, 0.3]])
    hierarchy = Hierarchy([Level(J, [1.0]), Level(J * (1.0 + 2.0**-52), [1.5])])
    x = lexicographic_optimum(Hierarchy([Level(J, [1.0])]))
    assert judge(hierarchy, x).verdict is Verdict.PROVEN_IF
    judgement = judge(hierarchy, x + [1e-3, 0.0, 0.0])
    assert judgement.verdict is Verdict.REFUTED_IF
    assert judgement.rows == ("level 2/row 0",)
    assert "Entry 0 is 0.001 away from the exact optimum, if these depend" in judgement.reason


def test_what_kinematics_round_off_refutes_nothing() -> None:
    """A short row pulls x₁ to its bound by an entry of 8e-16, which may as well be 0 beside an entry of 1."""
    rows = Level([[1.0, 0.0], [1e-6, 8e-16]], [0.0, 1e-7])
    problem = Hierarchy([rows], box=([-2.0, -2.0], [2.0, 2.0]))
    assert judge(problem, [1e-13, 2.0]).verdict is Verdict.PROVEN
    assert judge(problem, [1e-13, 0.0]).verdict is Verdict.UNDECIDED
    assert judge(problem, [1e-3, 0.0]).verdict is Verdict.REFUTED
    below = Hierarchy([rows, Level([[0.0, 1.0]], [-1.0])], box=([-2.0, -2.0], [2.0, 2.0]))
    assert judge(below, [1e-13, 2.0]).verdict is Verdict.PROVEN
    assert judge(below, [1e-13, -1.0]).verdict is Verdict.UNDECIDED


def test_hard_rows_that_agree_up_to_rounding_are_a_condition_too() -> None:
    """Two hard equalities are the same but for rounding, which alone decides where they cross."""
    limits = Level([[1.0, 0.3], [1.0, 0.3 + 1e-16]], [1.0, 1.0])
    hierarchy = Hierarchy([], limits=limits)
    assert judge(hierarchy, np.array([1.0, 0.3]) / 1.09).verdict is Verdict.PROVEN_IF


def test_ties_are_decided_whatever_the_hint_holds() -> None:
    """Level 1 asks for exactly the corner of the box and of a hard row: active or not, x is the same."""
    hierarchy = Hierarchy(
        [Level(EYE, [1.0, 1.0])], box=([-9.0, -9.0], [1.0, 1.0]), limits=Level([[1.0, 1.0]], upper=[2.0])
    )
    for a in (0, 1):
        for b in (0, 1):
            for c in (0, 1):
                state = np.array([a, b, c, 0, 0], dtype=np.int8)
                assert judge(hierarchy, [1.0, 1.0], state).proven


def test_hard_limits_that_contradict_each_other_have_no_optimum() -> None:
    """Nothing is proven, and nothing refuted, where there is no optimum; also by one unit of rounding."""
    for gap in (1.0, 1e-16):
        limits = Level([[1.0], [1.0]], lower=[-np.inf, gap], upper=[0.0, np.inf])
        assert judge(Hierarchy([], limits=limits), [0.0]).verdict is Verdict.UNDECIDED
    assert judge(Hierarchy([], limits=Level([[0.0]], lower=[1.0])), [0.0]).verdict is Verdict.UNDECIDED


def test_an_answer_that_is_no_number() -> None:
    """An infinite entry is refuted; NaN, or another size, is an error of the caller."""
    hierarchy = Hierarchy([Level(EYE, [1.0, 1.0])])
    assert judge(hierarchy, [np.inf, 0.0]).verdict is Verdict.REFUTED
    for x in ([np.nan, 0.0], [1.0]):
        with pytest.raises(InvalidValue, match="x"):
            judge(hierarchy, x)


def test_the_accuracy_asked_for_decides() -> None:
    """An error of 1e-6 is refuted at 1e-8, and proven at 1e-5."""
    hierarchy = Hierarchy([Level(EYE, [1.0, 1.0])])
    x = [1.0 + 1e-6, 1.0]
    assert judge(hierarchy, x).verdict is Verdict.REFUTED
    assert judge(hierarchy, x, accuracy=1e-5).proven


def test_a_row_that_repeats_another_does_not_hide_the_limits() -> None:
    """Many active limits and a row that is twice one of level 1: its other coefficients are exactly zero."""
    rng = np.random.default_rng(1)
    n = 26
    first = Level(rng.standard_normal((6, n)), rng.standard_normal(6))
    second = Level(rng.standard_normal((6, n)), 3.0 * rng.standard_normal(6))
    second.A[3] = 2.0 * first.A[2]
    third = Level(rng.standard_normal((5, n)), upper=0.1 * rng.standard_normal(5))
    reach = np.full(n, 0.5)
    hierarchy = Hierarchy([first, second, third, Level(np.eye(n), rng.standard_normal(n))], (-reach, reach))
    answer, _ = ActiveSet()(hierarchy)
    assert np.count_nonzero(answer.state[:n]) > MOST_UNDECIDED
    assert judge(hierarchy, answer.x, answer.state).proven


@pytest.mark.parametrize("bound", [0.0, 0.3])
@pytest.mark.parametrize("held", [0, 1])
def test_any_number_of_exact_ties_on_single_unknowns_is_decided(bound: float, held: int) -> None:
    """Level 2 asks for exactly the upper bounds of eleven unknowns, which level 1 has nothing to do with."""
    n = 13
    row = np.zeros((2, n))
    row[:, :2] = [[1.0, 0.7], [1.0, 0.3]]
    posture = Level(np.eye(n), np.full(n, bound))
    hierarchy = Hierarchy([Level(row[:1], [0.1]), posture], box=(-np.ones(n), np.full(n, bound)))
    x = lexicographic_optimum(hierarchy)
    state = np.where(np.arange(2 * n + 1) < n, held, 0).astype(np.int8)
    state[:2] = 0
    assert judge(hierarchy, x, state).proven


def test_an_answer_that_breaks_a_limit_is_refuted_whatever_ranks_say() -> None:
    """x₁ = 3 is beyond its bound, in a direction that no level sees; so is a level that costs more there."""
    rows = Level([[1.0, 1e-13]], [0.0])
    problem = Hierarchy([rows, Level([[0.0, 1.0]], [1.0])], box=([-2.0, -2.0], [2.0, 2.0]))
    assert judge(problem, [0.0, 1.0]).verdict is not Verdict.REFUTED
    assert judge(problem, [0.0, 3.0]).verdict is Verdict.REFUTED
    assert judge(problem, [0.0, 1.5]).verdict in (Verdict.REFUTED, Verdict.REFUTED_IF)
