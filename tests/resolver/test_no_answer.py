"""INFEASIBLE is our own finding, never a solver's word."""

import numpy as np
import pytest

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import Memory, answered
from taskopt.resolver.infeasible import limits_agree, no_answer, refuse_broken_claim
from taskopt.resolver.registry import resolve

FAMILIES = [
    "hqp/daqp",
    "hqp/clarabel",
    "hqp/proxqp",
    "hqp/quadprog",
    "wqp/daqp",
    "wqp/proxqp",
    "cvxpy/clarabel",
]


@pytest.mark.parametrize("given", [Status.FAILED, Status.ITERATION_LIMIT, Status.INFEASIBLE])
def test_limits_that_agree_are_not_called_infeasible(given: Status) -> None:
    """A solver that claims it has failed; what else it says of itself stands."""
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]))
    assert limits_agree(hierarchy)
    answer, _ = no_answer(hierarchy, given)
    assert answer.status is (Status.FAILED if given is Status.INFEASIBLE else given)
    assert np.isnan(answer.x).all()


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("gap", [1e-3, 1.0])
def test_limits_that_contradict_are_infeasible_whoever_was_asked(name: str, gap: float) -> None:
    """x₀ + x₁ ≥ 2 + gap inside |x| ≤ 1, whatever the solver ran into."""
    box = (-np.ones(2), np.ones(2))
    hierarchy = Hierarchy([Level([[1.0, 0.0]], [0.5])], box, limits=Level([[1.0, 1.0]], lower=[2.0 + gap]))
    assert not limits_agree(hierarchy)
    answer = resolve(hierarchy, name)
    assert answer.status is Status.INFEASIBLE
    assert not answer.kkt_met()


def claimed(hierarchy: Hierarchy, x: float) -> tuple[Resolution, Memory]:
    """An answer that claims to be the optimum."""
    width, levels = hierarchy.layout.width, hierarchy.layout.level_count
    state = np.zeros(width, dtype=np.int8)
    return answered(hierarchy, np.array([x]), np.zeros((levels + 1, width)), state, Status.SOLVED)


def test_a_claim_that_breaks_hard_limits_is_not_sent_where_every_answer_must() -> None:
    """x ≥ 1.5 and x ≤ 1: x = 1.2 may be claimed by a solver with coarse tolerances, and is no velocity."""
    hierarchy = Hierarchy([Level([[1.0]], [3.0])], box=([-1.0], [1.0]), limits=Level([[1.0]], lower=[1.5]))
    answer, _ = refuse_broken_claim(claimed(hierarchy, 1.2))
    assert answer.status is Status.INFEASIBLE
    assert np.isnan(answer.x).all()


def test_a_claim_is_returned_as_it_is_where_limits_hold_or_can_hold() -> None:
    """Inside the limits, and outside of limits that agree, where the certificate refuses it."""
    hierarchy = Hierarchy([Level([[1.0]], [3.0])], box=([-1.0], [1.0]))
    for x in (1.0, 1.2):
        answer = claimed(hierarchy, x)
        assert refuse_broken_claim(answer) is answer
    assert not claimed(hierarchy, 1.2)[0].kkt_met()
