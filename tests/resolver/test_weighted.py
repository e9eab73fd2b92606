"""`wqp/<solver>` answers `weighted_problem(hierarchy)`, exactly; its priorities are as good as its ratio."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.status import Status
from taskopt.resolver.active_set.polish import polish
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.weighted import WeightedQP, weighted_problem
from tests.helpers.oracles import lexicographic_optimum, random_hierarchy

EXACT = ["daqp", "quadprog"]


@pytest.mark.slow
@pytest.mark.parametrize("name", [*EXACT, "proxqp", "clarabel"])
def test_the_weighted_optimum_is_found(name: str) -> None:
    """Against the exact optimum of the flattened problem; 5e-7 for the interior point near its corner."""
    tolerance = 1e-9 if name in EXACT else 1e-6
    for seed in range(30):
        resolution, _ = WeightedQP(name)(random_hierarchy(seed))
        assert np.abs(resolution.x - lexicographic_optimum(resolution.problem)).max() < tolerance


@pytest.mark.parametrize("name", EXACT)
def test_the_answer_is_certified_for_the_problem_it_answers(name: str) -> None:
    """The certificate is of the weighted problem, and proves it."""
    for seed in range(30):
        hierarchy = random_hierarchy(seed)
        resolution, _ = WeightedQP(name)(hierarchy)
        assert resolution.kkt_met()
        assert resolution.problem.layout.level_count == 1
        assert polish(resolution).kkt_met()


def test_where_nothing_binds_it_is_weighted_least_squares() -> None:
    """The closed-form answer is met to 1e-9, with any norm."""
    rng = np.random.default_rng(5)
    L = rng.normal(size=(5, 5)) + 3.0 * np.eye(5)
    for norm in (None, rng.uniform(0.5, 2.0, 5), L.T @ L):
        levels = [Level(rng.normal(size=(2, 5)), rng.normal(size=2)), Level(np.eye(5), rng.normal(size=5))]
        hierarchy = Hierarchy(levels, norm=norm)
        resolve = WeightedQP("daqp")
        np.testing.assert_allclose(resolve(hierarchy)[0].x, resolve.closed_form(hierarchy), atol=1e-9)


def test_a_smaller_ratio_leaks_less() -> None:
    """The first level's cost goes to zero with the ratio, and is zero for strict levels only."""
    rng = np.random.default_rng(2)
    hierarchy = Hierarchy(
        [Level(rng.normal(size=(2, 4)), rng.normal(size=2)), Level(np.eye(4), rng.normal(size=4))]
    )
    costs = [
        hierarchy.levels[0].cost(WeightedQP("daqp", ratio)(hierarchy)[0].x) for ratio in (1e-1, 1e-2, 1e-3)
    ]
    assert costs[0] > 10.0 * costs[1] > 100.0 * costs[2] > 0.0
    assert hierarchy.levels[0].cost(HierarchicalQP("daqp")(hierarchy)[0].x) < 1e-20


def test_names_survive_the_flattening() -> None:
    """Tasks keep their names and limits theirs, so that figures can be told apart."""
    hierarchy = Hierarchy(
        [Level([[1.0, 0.0]], [2.0], name="hand"), Level([[0.0, 1.0]], [1.0], name="posture")],
        box=([-1.0, -1.0], [1.0, 1.0]),
        unknowns=("a", "b"),
    )
    resolution, _ = WeightedQP("daqp")(hierarchy)
    assert list(resolution.residuals) == ["hand", "posture", "norm"]
    assert [str(active) for active in resolution.active] == ["box/a upper"]
    assert weighted_problem(hierarchy).layout.row_names[0] == "hand/row 0"


def test_contradicting_limits_give_no_velocity() -> None:
    """NaN and a status, never an x outside the limits."""
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]), limits=Level([[1.0]], lower=[2.0]))
    resolution, _ = WeightedQP("daqp")(hierarchy)
    assert resolution.status is Status.INFEASIBLE
    assert np.isnan(resolution.x).all()


@pytest.mark.parametrize("ratio", [0.0, -1.0, 2.0])
def test_a_ratio_outside_its_range_is_refused(ratio: float) -> None:
    """0 < ratio ≤ 1."""
    with pytest.raises(InvalidValue, match="ratio must be in"):
        WeightedQP("daqp", ratio)
