"""The search on rows, weights, norms and bounds that differ in size by many powers of ten.

The reference is the exact optimum in rational numbers.
"""

from pathlib import Path

import numpy as np
import pytest

from taskopt.bench.exact import exact_optimum
from taskopt.bench.proof import is_wrong
from taskopt.bench.scaled_problems import scaled_problem
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import Verdict
from taskopt.hierarchy.status import Status
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.active_set.search import search

FAMILIES = ("rows 1e±6", "weights 1e±12", "norms 1e±4", "bounds 1e-9…1e9", "light rows")
HARD = (1042, 1060, 1102)  # a light row's sign is lost in the rounding of a heavy row's residual


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_the_answer_is_right_and_claimed_cold_and_warm(family: str) -> None:
    """Compare with the exact optimum, from an empty working set and from that of a problem beside it."""
    for seed in (*HARD, *range(20)):
        beside, problem = scaled_problem(family, seed)
        _, memory = ActiveSet()(beside)
        for start in (None, memory):
            answer, _ = ActiveSet()(problem, start)
            assert answer.claimed, (family, seed)
            assert not is_wrong(answer.x, exact_optimum(problem)), (family, seed)


def test_the_sign_of_a_short_row_is_found() -> None:
    """A row of length 1e-7 asks for x = 1 + 1e-7; the first search starts at the bound x ≥ 1 and drops it."""
    asked = 1.0 + 1e-7
    problem = Hierarchy([Level([[1e-7]], [1e-7 * asked])], box=([1.0], [3.0]))
    x, state, multipliers = np.zeros(1), np.array([-1, 1], np.int8), np.zeros((2, 2))
    search(problem.rows, state, x, multipliers, np.int64(9), 9, 0.0)
    assert x[0] == pytest.approx(asked, abs=1e-14)


@pytest.mark.parametrize("seed", [101, 121, 199, 218, 489])
def test_rows_that_nearly_depend_on_each_other_cost_no_digits(seed: int) -> None:
    """One row has a share of 1e-9 … 1e-6 that no other has; in double precision x is off by 1e-8 and more."""
    for problem in scaled_problem("dependent rows", seed):
        answer, _ = ActiveSet()(problem)
        assert answer.claimed
        assert not is_wrong(answer.x, exact_optimum(problem))
        assert answer.certificate.verdict is Verdict.PROVEN
        assert np.isfinite(answer.certificate.residuals).all()


def test_where_neither_rank_nor_sign_is_certain_there_is_an_answer() -> None:
    """A Panda whose fourth joint moves its own link by 1e-10 m: no proof holds it at a bound or frees it."""
    problem = Hierarchy.load(Path(__file__).with_name("nearly_dependent.npz"))
    answer, _ = ActiveSet()(problem)
    assert answer.status is Status.SOLVED
    assert answer.kkt_met()
    assert answer.certificate.verdict is Verdict.UNDECIDED


def test_what_can_be_proven_is_not_searched_coarsely() -> None:
    """The bound x₁ ≥ 0.04 is held for residuals of 1e-12 at level 1, against level 2; that is the optimum."""
    for share in (1e-10, 1.5e-10, 3e-10):
        first = Level([[1.0, -share], [1.0, 0.8 * share]], [0.0, 0.0])
        problem = Hierarchy([first, Level([[0.0, 1.0]], [1.0])], box=([-1.0, 0.04], [1.0, 0.08]))
        answer, _ = ActiveSet()(problem)
        assert answer.certificate.verdict is Verdict.PROVEN
        assert not is_wrong(answer.x, exact_optimum(problem))


@pytest.mark.parametrize("share", [1e-12, 1e-11, 5e-11])
def test_a_direction_that_rounding_makes_stays_given_up(share: float) -> None:
    """x₀ = 1, then x₀ + share · x₁ = 2 would send x₁ to 1/share, while other rows need their digits back."""
    near = Level([[0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 1.0, 1.0 + 2e-7]], [1.0, 1.0])
    tiny = [Level([[1.0, 0.0, 0.0, 0.0]], [1.0]), Level([[1.0, share, 0.0, 0.0]], [2.0])]
    problem = Hierarchy([near, *tiny])
    assert exact_optimum(problem)[1] > 1e9
    answer, _ = ActiveSet()(problem)
    assert answer.x == pytest.approx([1.0, 0.0, 1.0, 0.0], abs=1e-6)
    assert answer.claimed


def test_digits_are_won_back_where_limits_contradict_each_other_by_rounding() -> None:
    """Hard rows that meet at x = (−1e8, 1e8): residuals of 1e-8 are rounding there, not a contradiction."""
    share = 2.0**-27
    rows = Level([[1.0, 1.0], [1.0, 1.0 + share], [0.0, 0.75]], [0.0, 1.0, 0.75 / share])
    answer, _ = ActiveSet()(Hierarchy([], limits=rows))
    assert answer.claimed
    assert answer.x == pytest.approx([-1.0 / share, 1.0 / share], rel=1e-15)
