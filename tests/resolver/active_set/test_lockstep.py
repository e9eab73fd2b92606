"""The fast path in lock-step: its error bound holds, and what it cannot prove it does not give."""

import numpy as np
import pytest

from taskopt import Hierarchy, Level
from taskopt.arrays import Array
from taskopt.jit.pack import PACK
from taskopt.resolver.active_set.lockstep import records, resolve_pack
from taskopt.resolver.active_set.lockstep.records import ArmAnswers, ArmRows, Cost
from tests.helpers.oracles import lexicographic_optimum

M, N = 2, 4


def problems(seed: int, scale: float = 1.0) -> tuple[Cost, ArmRows]:
    """Eight problems of two strict rows above a posture, in a box that some of them reach."""
    rng = np.random.default_rng(seed)
    D = 10.0 ** rng.uniform(-2.0, 2.0, N)
    A, r = rng.normal(size=(M * N, PACK)), rng.normal(size=(M, PACK)) * scale
    x0 = rng.normal(size=(N, PACK))
    lower, upper = -rng.uniform(0.5, 3.0, (N, PACK)), rng.uniform(0.5, 3.0, (N, PACK))
    return Cost(D, 1.0 / np.sqrt(D), np.zeros(M), np.ones(M)), ArmRows(
        A, r, x0, np.abs(D[:, None] * x0), lower, upper
    )


def answers(cost: Cost, rows: ArmRows) -> ArmAnswers:
    """What `resolve_pack` finds from the empty working set."""
    m, n = len(rows.r), len(cost.D)
    found = ArmAnswers(*(np.zeros((n, PACK)) for _ in range(3)), np.zeros((1, PACK)))
    resolve_pack(cost, rows, found, records.scratch_in(np.zeros((records.scratch_packs(m, n), PACK)), m, n))
    return found


def hierarchy(cost: Cost, rows: ArmRows, lane: int) -> Hierarchy:
    """The same numbers as a hierarchy."""
    A, r = rows.A[:, lane].reshape(-1, len(cost.D)), rows.r[:, lane]
    soft = cost.slack > 0.0
    last = [
        Level(A[soft], r[soft], weight=1.0 / cost.slack[soft]),
        Level(np.eye(len(cost.D)), rows.x0[:, lane], weight=cost.D),
    ]
    parts = [part for part in last if len(part.lower)]
    level = Level(
        np.vstack([part.A for part in parts]),
        np.concatenate([part.lower for part in parts]),
        weight=np.concatenate([part.weight for part in parts]),
    )
    strict = [Level(A[~soft], r[~soft])] if (~soft).any() else []
    return Hierarchy([*strict, level], box=(rows.lower[:, lane], rows.upper[:, lane]))


@pytest.mark.parametrize("seed", range(6))
def test_the_bound_holds_against_exact_arithmetic(seed: int) -> None:
    """The exact optimum is within the bound of every proven answer, and the bound is small."""
    cost, rows = problems(seed)
    found = answers(cost, rows)
    proven = found.proven[0] > 0.5
    assert np.count_nonzero(proven) >= 4
    assert np.median(found.bound[:, proven].max(axis=0)) < 1e-10
    for lane in np.flatnonzero(proven):
        exact = lexicographic_optimum(hierarchy(cost, rows, lane))
        distance = np.abs(found.x[:, lane] - exact)
        assert (distance <= found.bound[:, lane] + 2.0**-52 * np.abs(exact)).all()


def test_planted_lie_a_wrong_answer_is_outside_the_bound() -> None:
    """The test above would notice an error of 1e-9: the bounds are far below that."""
    cost, rows = problems(0)
    found = answers(cost, rows)
    lane = int(np.flatnonzero(found.proven[0])[0])
    exact = lexicographic_optimum(hierarchy(cost, rows, lane))
    assert (np.abs(found.x[:, lane] + 1e-9 - exact) > found.bound[:, lane]).any()


def test_bounds_are_held_and_released() -> None:
    """A working set with a wrong bound leads to the same answers as an empty one."""
    cost, rows = problems(3)
    found = answers(cost, rows)
    wrong = ArmAnswers(*(np.zeros((N, PACK)) for _ in range(3)), np.zeros((1, PACK)))
    wrong.state[1] = 1.0
    resolve_pack(cost, rows, wrong, records.scratch_in(np.zeros((records.scratch_packs(M, N), PACK)), M, N))
    both = (found.proven[0] > 0.5) & (wrong.proven[0] > 0.5)
    assert np.count_nonzero(both) >= 4
    assert np.abs(found.state).max() == 1.0
    np.testing.assert_array_equal(found.state[:, both], wrong.state[:, both])
    assert (np.abs(found.x - wrong.x)[:, both] <= (found.bound + wrong.bound)[:, both] + 1e-15).all()


def test_rows_of_the_last_level_are_weighed() -> None:
    """With slack, rows and posture are weighed against each other."""
    cost, rows = problems(4, 30.0)
    soft = Cost(cost.D, cost.root, np.array([0.0, 0.5]), np.ones(1))
    found = answers(soft, rows._replace(lower=rows.lower - 1e3, upper=rows.upper + 1e3))
    assert found.proven.all()
    for lane in range(PACK):
        free = rows._replace(lower=rows.lower - 1e3, upper=rows.upper + 1e3)
        exact = lexicographic_optimum(hierarchy(soft, free, lane))
        assert (np.abs(found.x[:, lane] - exact) <= found.bound[:, lane] + 1e-15 * np.abs(exact)).all()


def rows_of(A: Array, r: Array, x0: Array, upper: Array) -> tuple[Cost, ArmRows]:
    """One problem, eight times, with D = 1 and lower bounds of −1."""
    n = len(x0)
    spread = (
        np.repeat(part.ravel()[:, None], PACK, axis=1) for part in (A, r, x0, np.abs(x0), -np.ones(n), upper)
    )
    return Cost(np.ones(n), np.ones(n), np.zeros(len(r)), np.ones(len(r))), ArmRows(*spread)


def test_what_rounding_decides_is_not_proven() -> None:
    """An optimum that lies exactly on a bound without a multiplier; the same a little inside is proven."""
    A, r = np.array([[1.0, 1.0]]), np.array([1.0])
    tie = answers(*rows_of(A, r, np.zeros(2), np.array([0.5, 9.0])))
    inside = answers(*rows_of(A, r, np.zeros(2), np.array([0.5 + 1e-9, 9.0])))
    assert not tie.proven.any()
    assert inside.proven.all()


def test_dependent_rows_and_contradictory_bounds_are_not_proven() -> None:
    """Equal rows that contradict, NaN, and a lower bound above the upper one."""
    twice = np.array([[1.0, 1.0], [1.0, 1.0]])
    assert not answers(*rows_of(twice, np.array([1.0, 2.0]), np.zeros(2), np.ones(2))).proven.any()
    A, r = np.array([[1.0, 1.0]]), np.array([np.nan])
    assert not answers(*rows_of(A, r, np.zeros(2), np.ones(2))).proven.any()
    crossed = rows_of(A, np.array([0.2]), np.zeros(2), np.array([-2.0, 1.0]))
    assert not answers(*crossed).proven.any()
