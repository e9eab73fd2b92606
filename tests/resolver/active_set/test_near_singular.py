"""`hqp/<solver>` where J is nearly singular and bounds bind: an answer, and never an untrue claim."""

from collections.abc import Iterator

import numpy as np
import pytest

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.hqp import HierarchicalQP

SMALLEST = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6]


def saturated(smallest: float, count: int) -> Iterator[Hierarchy]:
    """A 6 × 7 Jacobian above a posture; the velocity that is asked for is possible outside the box only."""
    for seed in range(count):
        rng = np.random.default_rng([seed, round(-np.log10(smallest))])
        U, sigma, Vt = np.linalg.svd(rng.normal(size=(6, 7)))
        sigma[-1] = smallest
        J = (U * sigma) @ Vt[:6]
        box = np.abs(rng.normal(size=7)) * 0.7 + 0.05
        levels = [Level(J, J @ rng.normal(size=7)), Level(np.eye(7), rng.normal(size=7))]
        yield Hierarchy(levels, box=(-box, box))


@pytest.mark.parametrize("smallest", SMALLEST)
@pytest.mark.parametrize("name", ["daqp", "quadprog"])
def test_active_set_solvers_find_the_optimum(name: str, smallest: float) -> None:
    """20 problems each, to 1e-7, claimed and proven."""
    for hierarchy in saturated(smallest, 20):
        resolution, _ = HierarchicalQP(name)(hierarchy)
        assert resolution.claimed
        assert resolution.kkt_met()
        np.testing.assert_allclose(resolution.x, ActiveSet()(hierarchy)[0].x, atol=1e-7)


@pytest.mark.parametrize("smallest", SMALLEST)
@pytest.mark.parametrize("name", ["clarabel", "proxqp"])
def test_others_find_it_or_say_that_they_did_not(name: str, smallest: float) -> None:
    """Nine in ten are right; x is inside the box in any case, and none that is wrong is proven."""
    right = 0
    for hierarchy in saturated(smallest, 20):
        resolution, _ = HierarchicalQP(name)(hierarchy)
        close = bool(np.abs(resolution.x - ActiveSet()(hierarchy)[0].x).max() < 1e-6)
        assert (np.abs(resolution.x) <= hierarchy.box_upper + 1e-7).all()
        assert close or not resolution.proven
        right += close and resolution.claimed
    assert right >= 18
