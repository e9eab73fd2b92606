"""The fallback is taken with a proof only, and phase one has the last word on a contradiction."""

import numpy as np
import pytest

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import Memory, answered
from taskopt.resolver.fallback import ActiveSetWithFallback

AGREE = Hierarchy([Level([[1.0, 0.0]], [2.0])], box=([-1.0, -1.0], [1.0, 1.0]))
CONTRADICT = Hierarchy(
    [Level([[1.0, 0.0]], [2.0])], box=([-1.0, -1.0], [1.0, 1.0]), limits=Level([[1.0, 0.0]], lower=[2.0])
)


def said(hierarchy: Hierarchy, x: Array, status: Status) -> tuple[Resolution, Memory]:
    """Return an answer without multipliers, so that no x but 0 is proven."""
    layout = hierarchy.layout
    multipliers = np.zeros((layout.level_count + 1, layout.width))
    return answered(hierarchy, x, multipliers, np.zeros(layout.width, np.int8), status)


class Claims:
    """A resolver that claims zero to be the optimum."""

    name, strict = "claims", True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        return said(hierarchy, np.zeros(hierarchy.n), Status.SOLVED)

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        return np.zeros(hierarchy.n)


def test_a_fallback_without_a_proof_is_not_taken() -> None:
    """The search has no proof, the fallback claims a wrong optimum: the answer stays FAILED."""
    failed, _ = said(AGREE, np.zeros(2), Status.FAILED)
    concluded = ActiveSetWithFallback(fallback=Claims()).conclude(failed)
    assert concluded.status is Status.FAILED
    assert concluded.fallback is None


def test_a_fallback_that_is_refuted_is_not_taken_although_it_meets_its_conditions() -> None:
    """The level asks x2 = 1 with a weight of 1e-20, which no tolerance of a residual sees."""
    light = Hierarchy([Level([[1.0, 0.0], [0.0, 1.0]], [0.0, 1.0], weight=[1.0, 1e-20])])
    failed, _ = said(light, np.zeros(2), Status.FAILED)
    assert Claims()(light)[0].kkt_met()
    concluded = ActiveSetWithFallback(fallback=Claims()).conclude(failed)
    assert concluded.status is Status.FAILED
    assert concluded.fallback is None


def test_a_search_that_does_not_end_is_followed_by_the_fallback() -> None:
    """x₁ = 1 at its bound is the optimum; a fallback without one leaves the search the last word."""
    stopped, _ = said(AGREE, np.zeros(2), Status.ITERATION_LIMIT)
    concluded = ActiveSetWithFallback().conclude(stopped)
    assert concluded.status is Status.SOLVED
    assert concluded.fallback == "hqp/daqp"
    assert concluded.x == pytest.approx([1.0, 0.0], abs=1e-12)
    assert ActiveSetWithFallback(fallback=Claims()).conclude(stopped).status is Status.ITERATION_LIMIT


@pytest.mark.parametrize(("hierarchy", "status"), [(AGREE, Status.FAILED), (CONTRADICT, Status.INFEASIBLE)])
def test_phase_one_decides_what_is_infeasible(hierarchy: Hierarchy, status: Status) -> None:
    """INFEASIBLE is kept where the limits contradict each other, and becomes FAILED where they agree."""
    claimed, _ = said(hierarchy, np.zeros(2), Status.INFEASIBLE)
    assert ActiveSetWithFallback(fallback=None).conclude(claimed).status is status
