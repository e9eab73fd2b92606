"""Multipliers: what a limit costs is what moving it changes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt import Hierarchy, Level
from taskopt.hierarchy.active import Active, active_rows, level_multipliers
from taskopt.hierarchy.resolution import Resolution
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.registry import resolver
from tests.helpers.oracles import random_hierarchy

STEP = 1e-5


def bound_of(hierarchy: Hierarchy, row: Active) -> tuple[np.ndarray, int]:
    """The array and the index at which the bound of an active row stands."""
    names = list(hierarchy.layout.row_names)
    if row.name in names:
        return (hierarchy.upper if row.side == "upper" else hierarchy.lower), names.index(row.name)
    box = hierarchy.box_upper if row.side == "upper" else hierarchy.box_lower
    return box, hierarchy.layout.unknowns.index(row.name.split("/")[1])


def slopes(hierarchy: Hierarchy, row: Active) -> list[float]:
    """∂(½ Σ w d²)/∂bound of the level at which a row has its multiplier, to the left and to the right.

    The list is empty where another row takes its place: two rows that tie share one multiplier, and only
    the sum of their parts is unique.
    """
    costs, states = [], set()
    for step in (-STEP, 0.0, STEP):
        moved = hierarchy.copy()
        bounds, at = bound_of(moved, row)
        bounds[at] += step
        resolution = ActiveSet()(moved)[0]
        x = resolution.x
        states.add(resolution.state.tobytes())
        costs.append(moved.levels[row.level - 1].cost(x))
    if len(states) > 1:
        return []
    return [(costs[1] - costs[0]) / STEP, (costs[2] - costs[1]) / STEP]


def first_multipliers(resolution: Resolution) -> list[Active]:
    """Active rows whose multiplier is not zero at the first level where they count, the norm left out."""
    count = resolution.problem.layout.level_count
    return [row for row in resolution.active if row.level <= count and abs(row.multiplier) > 1e-6]


@given(st.integers(0, 2**32 - 1))
def test_moving_a_limit_changes_the_cost_by_its_multiplier(seed):
    """∂(½ Σ w d²)/∂bound = −multiplier at the level where it binds, by actually moving the bound."""
    hierarchy = random_hierarchy(seed)
    resolution = ActiveSet()(hierarchy)[0]
    for row in first_multipliers(resolution):
        sides = slopes(hierarchy, row)
        if not sides:
            continue
        left, right = sides
        least, most = min(sides), max(sides)
        slack = 20.0 * STEP * max(1.0, abs(row.multiplier), abs(left), abs(right))
        assert least - slack <= -row.multiplier <= most + slack, (row, left, right)


def test_a_multiplier_of_the_wrong_sign_is_caught():
    """The check above tells y from −y: x ≤ 1 keeps x = 3 from being met, and its multiplier is 2."""
    hierarchy = Hierarchy([Level([[1.0]], [3.0])], box=([-1.0], [1.0]))
    (row,) = first_multipliers(ActiveSet()(hierarchy)[0])
    assert row.multiplier == pytest.approx(2.0)
    assert slopes(hierarchy, row) == pytest.approx([-2.0, -2.0], rel=1e-4)


@pytest.mark.parametrize("name", ["active-set", "hqp/daqp", "hqp/clarabel"])
def test_every_limit_has_its_multiplier_at_the_first_level_that_it_binds(name):
    """x + y ≤ 1 costs its own level nothing, x ≤ 1.5 costs x = 2 half a unit, then x + y ≤ 1 costs y = 3."""
    levels = [
        Level([[1.0, 1.0]], upper=[1.0], name="keep"),
        Level([[1.0, 0.0]], [2.0]),
        Level([[0.0, 1.0]], [3.0]),
    ]
    hierarchy = Hierarchy(levels, box=([-9.0, -9.0], [1.5, 9.0]), unknowns=["x", "y"])
    resolution = resolver(name)(hierarchy)[0]
    first = {row.name: (row.level, row.multiplier) for row in reversed(resolution.level_multipliers)}
    assert first["box/x"] == (2, pytest.approx(0.5))
    assert first["keep/row 0"] == (3, pytest.approx(3.5))
    assert [row.level for row in resolution.level_multipliers] == sorted(
        row.level for row in resolution.level_multipliers
    )


def test_a_limit_that_binds_at_two_levels_has_a_multiplier_at_each():
    """x ≤ 1 keeps both 2 x = 4 and then y − x = −3 from being met."""
    levels = [Level([[2.0, 0.0]], [4.0]), Level([[-1.0, 1.0], [0.0, 1.0]], [-3.0, 0.0])]
    hierarchy = Hierarchy(levels, box=([-9.0, -9.0], [1.0, 9.0]), unknowns=["x", "y"])
    found = ActiveSet()(hierarchy)[0].level_multipliers
    assert [(row.name, row.level) for row in found] == [("box/x", 1), ("box/x", 2)]
    assert [row.multiplier for row in found] == pytest.approx([4.0, 1.0], rel=1e-12)


@pytest.mark.parametrize("size", [1.0, 1e4])
def test_a_multiplier_counts_relative_to_the_largest_of_its_row(size):
    """Beside −size at level 2, a multiplier of 1e-11 size at level 1 is noise, one of 1e-7 size is not."""
    hierarchy = Hierarchy([Level([[1.0]], [k]) for k in (3.0, 2.0)], box=([-1.0], [1.0]))
    state = np.array([1, 0, 0], dtype=np.int8)
    for first, level in ((1e-11, 2), (1e-7, 1)):
        multipliers = np.zeros((3, 3))
        multipliers[:2, 0] = first * size, -size
        (row,) = active_rows(hierarchy, state, multipliers)
        assert (str(row), row.level, row.multiplier) == ("box/x0 upper", level, multipliers[level - 1, 0])
        assert [found.level for found in level_multipliers(hierarchy, state, multipliers)] == [1, 2][
            level - 1 :
        ]


def test_an_equality_is_never_among_the_active_rows():
    """It holds on both sides, and its multiplier is no limit's."""
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([1.0], [1.0]))
    resolution = ActiveSet()(hierarchy)[0]
    assert resolution.x == pytest.approx([1.0])
    assert resolution.active == ()
