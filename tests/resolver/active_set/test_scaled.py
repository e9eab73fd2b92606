"""The search on rows, weights, norms and bounds that differ in size by many powers of ten.

The reference is the exact optimum in rational numbers.
"""

import numpy as np
import pytest

from taskopt.bench.exact import exact_optimum
from taskopt.bench.proof import is_wrong
from taskopt.bench.scaled_problems import scaled_problem
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.active_set.search import search

FAMILIES = ("rows 1e±6", "weights 1e±12", "norms 1e±4", "bounds 1e-9…1e9", "light rows")
HARD = (1042, 1060, 1102)  # a light row's sign is lost in the rounding of a heavy row's residual


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
    search(problem.rows, state, x, multipliers, np.int64(9), 9)
    assert x[0] == pytest.approx(asked, abs=1e-14)
