"""INFEASIBLE is our own finding, never a solver's word."""

import numpy as np
import pytest

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.status import Status
from taskopt.resolver.infeasible import limits_agree, no_answer
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
    assert not answer.certified()
