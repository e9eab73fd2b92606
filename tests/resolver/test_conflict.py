"""Contradicting hard limits: found, named, and minimal."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.status import Status
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.infeasible import Side, find_conflict
from taskopt.resolver.registry import resolver

SEEDS = st.integers(0, 2**32 - 1)


def random_limits(seed: int) -> Hierarchy:
    """A box and rows that contradict each other in about half of the cases."""
    rng = np.random.default_rng(seed)
    n, rows = int(rng.integers(2, 7)), int(rng.integers(1, 6))
    middle = rng.standard_normal(rows) * 1.5
    limits = Level(rng.standard_normal((rows, n)), lower=middle, upper=middle + rng.uniform(0.1, 1.0, rows))
    return Hierarchy([Level(np.eye(n), np.ones(n))], box=(-np.full(n, 0.4), np.full(n, 0.4)), limits=limits)


def can_hold(hierarchy: Hierarchy, kept: set[Side], all_sides: bool = False) -> bool:
    """Return True if the sides kept have a common point: a linear program, by an independent solver."""
    layout, rows, bounds = hierarchy.layout, [], []
    all_lower = [*hierarchy.box_lower, *hierarchy.limits.lower]
    all_upper = [*hierarchy.box_upper, *hierarchy.limits.upper]
    names = [hierarchy.name_of(j, True) for j in range(hierarchy.n)] + list(layout.row_names)
    for row, name, lower, upper in zip(
        [*np.eye(hierarchy.n), *hierarchy.limits.A], names, all_lower, all_upper, strict=False
    ):
        for side, sign, bound in (("lower", -1.0, lower), ("upper", 1.0, upper)):
            if np.isfinite(bound) and (all_sides or Side(name, side, float(bound)) in kept):
                rows.append(sign * row)
                bounds.append(sign * bound)
    result = linprog(np.zeros(hierarchy.n), A_ub=rows, b_ub=bounds, bounds=(None, None))
    return bool(result.status == 0)


@pytest.mark.slow
@given(SEEDS)
@settings(deadline=None, max_examples=80)
def test_a_conflict_is_found_exactly_where_a_linear_program_finds_none(seed):
    """Phase one by least squares and phase one by the simplex method agree."""
    hierarchy = random_limits(seed)
    found = find_conflict(hierarchy)
    assert (found is None) == can_hold(hierarchy, set(), all_sides=True)
    assert (ActiveSet()(hierarchy)[0].status is Status.INFEASIBLE) == (found is not None)


@pytest.mark.slow
@given(SEEDS)
@settings(deadline=None, max_examples=80)
def test_removing_any_one_member_makes_it_feasible(seed):
    """The set named is minimal: it cannot hold, and every set with one member less can."""
    hierarchy = random_limits(seed)
    found = find_conflict(hierarchy)
    assume(found is not None)
    members = set(found.members)
    assert not can_hold(hierarchy, members)
    for member in members:
        assert can_hold(hierarchy, members - {member})


def test_members_are_fewer_than_the_sides_that_give_way():
    """The least relaxation spreads over more sides than contradict each other; the members stay minimal."""
    spread = 0
    for seed in range(30):
        hierarchy = random_limits(seed)
        found = find_conflict(hierarchy)
        if found is None:
            continue
        members = set(found.members)
        assert not can_hold(hierarchy, members)
        assert all(can_hold(hierarchy, members - {member}) for member in members)
        spread += len(found.relaxation) > len(members)
    assert spread >= 3


@given(SEEDS)
@settings(deadline=None, max_examples=40)
def test_the_relaxation_is_enough(seed):
    """With each side moved by what is named, the limits agree."""
    hierarchy = random_limits(seed)
    found = find_conflict(hierarchy)
    assume(found is not None)
    for side, gap in found.relaxation:
        names = list(hierarchy.layout.row_names)
        target = hierarchy.lower if side.side == "lower" else hierarchy.upper
        index = names.index(side.name) if side.name in names else None
        if index is None:
            target = hierarchy.box_lower if side.side == "lower" else hierarchy.box_upper
            index = hierarchy.layout.unknowns.index(side.name.split("/")[1])
        target[index] += (gap + 1e-8) * (1.0 if side.side == "upper" else -1.0)
    assert find_conflict(hierarchy) is None


def test_a_crossed_interval_names_both_its_sides():
    """A bound pair that became empty after it was declared is its own conflict."""
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]), unknowns=["elbow"])
    hierarchy.box_lower[0] = 2.0
    found = find_conflict(hierarchy)
    assert found is not None
    assert str(found).startswith("these limits exclude each other: box/elbow ≥ 2; box/elbow ≤ 1")
    assert sum(gap for _, gap in found.relaxation) == pytest.approx(1.0)
    assert ActiveSet()(hierarchy)[0].status is Status.INFEASIBLE


@pytest.mark.parametrize("gap", [1e-8, 1e-6, 1e-3])
def test_a_small_conflict_names_all_its_members(gap):
    """A row beyond the corner of the box by 1e-8 needs the box: alone it can hold."""
    a = np.array([0.3, -1.0, 0.02, 0.7])
    corner = a @ np.where(a > 0.0, 1.0, -1.0)
    limits = Level([a], lower=[corner + gap * np.linalg.norm(a)], upper=[corner + 1.0])
    hierarchy = Hierarchy([Level(np.eye(4), np.zeros(4))], box=(-np.ones(4), np.ones(4)), limits=limits)
    found = find_conflict(hierarchy)
    assert found is not None
    assert len(found.members) == 5
    assert ActiveSet()(hierarchy)[0].status is not Status.SOLVED


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_the_unit_of_a_row_does_not_decide_whether_it_contradicts(scale):
    """x ≥ 1 + 1e-6 and x ≤ 1, in millimetres, metres or kilometres; and a miss of 1e-10 is none."""
    for gap, contradicts in ((1e-6, True), (1e-10, False)):
        limits = Level([[scale]], lower=[scale * (1.0 + gap)], upper=[2.0 * scale])
        hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]), limits=limits)
        assert (find_conflict(hierarchy) is not None) is contradicts
        assert ActiveSet()(hierarchy)[0].kkt_met() is not contradicts


@pytest.mark.parametrize("name", ["active-set", "hqp/daqp", "hqp/clarabel", "wqp/quadprog", "cvxpy/clarabel"])
def test_no_resolver_claims_an_optimum_where_limits_contradict(name):
    """A row of zeros that asks for 1, and a row beyond the corner of the box: INFEASIBLE, and x is NaN."""
    for row, bound in (([0.0, 0.0], 1.0), ([1.0, 1.0], 2.0 + 1e-6)):
        limits = Level([row], lower=[bound])
        hierarchy = Hierarchy([Level(np.eye(2), [0.2, 0.3])], box=(-np.ones(2), np.ones(2)), limits=limits)
        resolution = resolver(name)(hierarchy)[0]
        assert resolution.status is Status.INFEASIBLE
        assert np.isnan(resolution.x).all()
