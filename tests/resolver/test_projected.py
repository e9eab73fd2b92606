"""`pqp/<solver>`: the strict optimum while nothing is active, one bounded least-squares problem otherwise."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from taskopt import Hierarchy, InvalidValue, Level, Status, UnknownName
from taskopt.resolver.projected import ProjectedQP, projected_problem
from taskopt.resolver.registry import resolve, resolver
from tests.helpers.oracles import lexicographic_optimum, random_hierarchy


def null(J: np.ndarray) -> np.ndarray:
    """Projector on the null space, by NumPy's pseudo-inverse."""
    return np.eye(J.shape[1]) - np.linalg.pinv(J) @ J


def test_without_active_bounds_it_is_the_strict_optimum() -> None:
    """Two levels in conflict with each other, hard equalities, any norm."""
    rng = np.random.default_rng(2)
    L = rng.normal(size=(6, 6)) + 3.0 * np.eye(6)
    for norm in (None, rng.uniform(0.5, 2.0, 6), L.T @ L):
        first = rng.normal(size=(2, 6))
        levels = [Level(first, [1.0, 2.0]), Level(np.vstack([first[0], rng.normal(size=(2, 6))]), [5, 1, 2])]
        problem = Hierarchy(levels, norm=norm, limits=Level(rng.normal(size=(1, 6)), [0.3]))
        expected = lexicographic_optimum(problem)
        np.testing.assert_allclose(resolve(problem, "pqp/daqp").x, expected, atol=1e-9)
        assert np.abs(resolve(problem, "wqp/daqp").x - expected).max() > 1e-6


def test_inside_bounds_it_is_bounded_least_squares() -> None:
    """Against SciPy: rows J₁, J₂ N₁ and N₂ with the sides b₁, b₂ − J₂ J₁† b₁ and 0."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        J1, b1, J2, b2 = (
            rng.normal(size=(2, 6)),
            rng.normal(size=2),
            rng.normal(size=(2, 6)),
            rng.normal(size=2),
        )
        rows = np.vstack([J1, J2 @ null(J1), null(np.vstack([J1, J2]))])
        sides = np.concatenate([b1, b2 - J2 @ np.linalg.pinv(J1) @ b1, np.zeros(6)])
        found = lsq_linear(rows, sides, (-0.3, 0.3), tol=1e-14, method="bvls")
        box = (np.full(6, -0.3), np.full(6, 0.3))
        answer = resolve(Hierarchy([Level(J1, b1), Level(J2, b2)], box=box), "pqp/daqp")
        np.testing.assert_allclose(answer.x, found.x, atol=1e-8)
        assert answer.active


def test_where_bounds_bind_a_lower_level_takes_from_a_higher_one() -> None:
    """This is what it does not promise: the first level costs more than at the optimum."""
    worse = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        levels = [
            Level(rng.normal(size=(3, 6)), 2 * rng.normal(size=3)),
            Level(np.eye(6), rng.normal(size=6)),
        ]
        problem = Hierarchy(levels, box=(np.full(6, -0.4), np.full(6, 0.4)))
        costs = [problem.levels[0].cost(resolve(problem, name).x) for name in ("pqp/daqp", "active-set")]
        assert costs[0] >= costs[1] - 1e-10
        worse += costs[0] > costs[1] + 1e-4
    assert worse > 10


@pytest.mark.slow
@pytest.mark.parametrize("name", ["daqp", "quadprog"])
def test_its_answer_is_the_optimum_of_the_problem_that_it_states(name: str) -> None:
    """With inequalities, weights and hard rows, against the exact optimum of the projected problem."""
    for seed in range(20):
        hierarchy = random_hierarchy(seed)
        answer, _ = ProjectedQP(name)(hierarchy)
        stated = projected_problem(hierarchy)
        np.testing.assert_array_equal(answer.problem.buffer, stated.buffer)
        assert np.abs(answer.x - lexicographic_optimum(stated)).max() < 1e-8
        assert answer.kkt_met()


def test_contradicting_limits_give_no_velocity() -> None:
    """NaN and a status, as for every resolver."""
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]), limits=Level([[1.0]], lower=[2.0]))
    answer = resolve(hierarchy, "pqp/daqp")
    assert answer.status is Status.INFEASIBLE
    assert np.isnan(answer.x).all()


def test_a_ratio_stands_in_the_name_of_a_weighted_resolver() -> None:
    """As it is in the resolver; a smaller one disturbs the first level less."""
    rng = np.random.default_rng(2)
    levels = [Level(rng.normal(size=(2, 4)), rng.normal(size=2)), Level(np.eye(4), rng.normal(size=4))]
    problem = Hierarchy(levels)
    costs = [problem.levels[0].cost(resolve(problem, f"wqp@{r}/daqp").x) for r in ("0.1", "0.01", "1e-4")]
    assert costs[0] > 10.0 * costs[1] > 100.0 * costs[2] > 0.0
    assert resolver("wqp@1e-2/daqp").name == "wqp@0.01/daqp"
    with pytest.raises(InvalidValue, match=r"needs a number in \(0, 1\] after @"):
        resolver("wqp@little/daqp")
    with pytest.raises(InvalidValue, match="ratio must be in"):
        resolver("wqp@7/daqp")
    with pytest.raises(UnknownName, match=r"no resolver named 'hqp@0\.1/daqp'"):
        resolver("hqp@0.1/daqp")
