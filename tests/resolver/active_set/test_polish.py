"""The polished answer is exact, and its iterations say whether the solver's active set was right."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.active_set.polish import polish
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.registry import resolve
from tests.helpers.oracles import lexicographic_optimum, random_hierarchy


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.sampled_from(["daqp", "clarabel", "proxqp", "quadprog"]))
def test_the_right_active_set_gives_the_exact_optimum(seed: int, name: str) -> None:
    """To rounding, whatever the raw answer's last digits were."""
    hierarchy = random_hierarchy(seed)
    raw, _ = HierarchicalQP(name)(hierarchy)
    polished = polish(raw)
    np.testing.assert_allclose(polished.x, lexicographic_optimum(hierarchy), atol=1e-9)
    assert polished.claimed
    assert polished.kkt_met()


def test_raw_and_polished_are_kept_apart() -> None:
    """Polishing makes a new resolution; the raw one does not change."""
    raw, _ = HierarchicalQP("clarabel")(random_hierarchy(54))
    before = raw.answer.copy()
    assert polish(raw) is not raw
    np.testing.assert_array_equal(raw.answer, before)


def test_a_wrong_active_set_is_set_right_and_told() -> None:
    """Without the bounds that hold it back, the set needs more than one factorisation; itself, just one."""
    told = 0
    for seed in range(20):
        hierarchy = random_hierarchy(seed)
        raw, _ = HierarchicalQP("daqp")(hierarchy)
        assert polish(raw).iterations == 1
        if any(row.multiplier for row in raw.active):
            lie = Resolution(raw.source, raw.answer, np.zeros_like(raw.state), raw.status)
            polished = polish(lie)
            np.testing.assert_allclose(polished.x, ActiveSet()(hierarchy)[0].x, atol=1e-9)
            told += polished.iterations > 1
    assert told >= 8


@pytest.mark.parametrize("status", [Status.FAILED, Status.ITERATION_LIMIT])
def test_a_solver_that_gave_up_is_polished_from_where_it_stood(status: Status) -> None:
    """Even x = NaN has an active set, the empty one."""
    hierarchy = random_hierarchy(3)
    right = ActiveSet()(hierarchy)[0]
    lost = Resolution(hierarchy, np.full_like(right.answer, np.nan), np.zeros_like(right.state), status)
    lost.answer[-hierarchy.layout.size :] = hierarchy.buffer
    np.testing.assert_allclose(polish(lost).x, right.x, atol=1e-9)


def test_what_is_no_optimum_is_not_polished() -> None:
    """A closed form claims nothing, and contradicting limits leave nothing: they stay what they are."""
    formula = resolve(Hierarchy([Level([[1.0, 1.0]], [3.0])], box=([-1.0, -1.0], [1.0, 1.0])), "pinv")
    assert polish(formula) is formula
    nothing = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]), limits=Level([[1.0]], lower=[3.0]))
    answer = resolve(nothing, "hqp/daqp")
    assert answer.status is Status.INFEASIBLE
    assert polish(answer) is answer
