"""A hierarchy from plain arrays: what it accepts, what it refuses, and how it reads."""

import numpy as np
import pytest

from taskopt.errors import Infeasible, InvalidValue
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.registry import resolve


def test_equalities_and_inequalities_of_a_level_keep_their_order():
    """Level(A, b, lower, upper) holds A x = b, then lower ≤ A x ≤ upper."""
    level = Level([[1.0, 2.0]], [3.0], [-1.0], [4.0], weight=2.0)
    np.testing.assert_array_equal(level.lower, [3.0, -1.0])
    np.testing.assert_array_equal(level.upper, [3.0, 4.0])
    np.testing.assert_array_equal(level.weight, [2.0, 2.0])


def test_hard_rows_come_first_and_levels_are_views():
    """What is written through a level arrives in the buffer that kernels read."""
    hierarchy = Hierarchy([Level([[1.0, 0.0]], [1.0])], limits=Level([[0.0, 1.0]], upper=[2.0]))
    assert hierarchy.limits.upper[0] == 2.0
    hierarchy.levels[0].A[0, 1] = 7.0
    assert hierarchy.A[1, 1] == 7.0
    assert hierarchy.copy().A[1, 1] == 7.0


def test_a_copy_does_not_follow_the_original():
    """The same problem in memory of its own."""
    hierarchy = Hierarchy([Level([[1.0]], [1.0])])
    kept = hierarchy.copy()
    hierarchy.A[:] = 5.0
    assert kept.A[0, 0] == 1.0


def test_the_cost_of_a_level_has_its_half_and_its_weight():
    """½ w d² at a generic point, with d the distance to the interval."""
    level = Hierarchy([Level([[2.0]], lower=[-1.0], upper=[1.0], weight=3.0)]).levels[0]
    assert level.cost(np.array([1.5])) == pytest.approx(0.5 * 3.0 * 2.0**2)
    assert level.cost(np.array([0.3])) == 0.0


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Level([[1.0, np.nan]], [0.0]), "A has NaN at index"),
        (lambda: Level([[1.0]], [0.0, 1.0]), "b must have shape 1, got 2"),
        (lambda: Level([[1.0]]), "needs b, or lower and upper"),
        (lambda: Level([[1.0]], [0.0], weight=0.0), "weight must be > 0, got 0"),
        (lambda: Level([[1.0]], [np.inf]), "not finite"),
        (lambda: Hierarchy([Level([[1.0]], [0.0]), Level([[1.0, 2.0]], [0.0])]), "one number of unknowns"),
        (lambda: Hierarchy([]), "no level and no box"),
        (lambda: Hierarchy([Level([[1.0]], [0.0])], norm=[-1.0]), "positive definite"),
        (lambda: Hierarchy([Level(np.eye(2), np.zeros(2))], norm=[[1.0, 2.0], [0.0, 1.0]]), "symmetric"),
        (lambda: Hierarchy([Level(np.eye(2), np.zeros(2))], norm=[[2.0, 1.0], [0.0, 2.0]]), "symmetric"),
        (lambda: Hierarchy([Level(np.eye(2), [0, 0])], norm=[[2.0, 1.0], [1.0 + 1e-9, 2.0]]), "symmetric"),
        (lambda: Hierarchy([Level([[1.0]], [0.0])], norm=[0.0]), "positive definite; least eigenvalue 0"),
        (lambda: Hierarchy([Level(np.eye(2), [0, 0])], norm=np.diag([1.0, 0.0])), "positive definite"),
        (lambda: Hierarchy([Level([[1.0]], [0.0])], unknowns=("a", "b")), "1 names, each different"),
        (lambda: Hierarchy([Level(np.eye(2), [0, 0])], unknowns=("a", "a")), "2 names, each different"),
        (lambda: Level(np.array([[1j]]), [1.0]), "A must be numbers, got array"),
        (lambda: Level([[10**400]], [1.0]), "A must be numbers below 1.8e308, the largest float, got"),
        (lambda: Hierarchy(Level([[1.0]], [0.0])), "sequence of levels, got Level"),  # type: ignore[arg-type]
        (lambda: Hierarchy(None), "sequence of levels, got NoneType"),  # type: ignore[arg-type]
        (lambda: Hierarchy([np.eye(2)]), r"a Level or a pair \(A, b\), got ndarray"),  # type: ignore[list-item]
        (lambda: Hierarchy([([[1.0]], [0.0], [1.0])]), "a Level or a pair"),  # type: ignore[list-item]
        (lambda: Hierarchy([Level([[1.0]], [0.0])], limits=3), "limits must be a Level"),  # type: ignore[arg-type]
        (lambda: Hierarchy([Level([[1.0]], [0.0])], box=3), "pair .*, got 3"),  # type: ignore[arg-type]
    ],
)
def test_what_is_wrong_is_named(build, message):
    """Each mistake is refused with what was got and what was expected."""
    with pytest.raises(InvalidValue, match=message):
        build()


def test_limits_may_be_a_pair_like_any_level():
    """(A, b) as hard rows is A x = b."""
    hierarchy = Hierarchy([([[0.0, 1.0]], [1.0])], limits=([[1.0, 1.0]], [3.0]))
    np.testing.assert_array_equal(hierarchy.limits.lower, [3.0])
    np.testing.assert_array_equal(hierarchy.limits.upper, [3.0])


def test_levels_of_one_name_are_numbered():
    """Else what one of them lacks would be lost behind the other's name."""
    row = [[1.0]]
    hierarchy = Hierarchy([Level(row, [k], name="reach") for k in range(3)], limits=Level(row, upper=[1.0]))
    names = [block.name for block in hierarchy.layout.blocks]
    assert names == ["limits", "reach", "reach 2", "reach 3"]
    assert set(resolve(hierarchy).residuals) == {"reach", "reach 2", "reach 3"}


@pytest.mark.parametrize("norm", [[1.0, 2.0], [[2.0, 0.5], [0.5, 1.0]]])
def test_the_norm_of_a_kept_resolution_cannot_change(norm):
    """It is shared, so it is read-only; a hierarchy that needs another one is given one."""
    hierarchy = Hierarchy([Level([[1.0, 1.0]], [1.0])], norm=norm)
    kept = resolve(hierarchy).problem
    with pytest.raises(ValueError, match="read-only"):
        hierarchy.norm[0] = 7.0
    np.testing.assert_array_equal(kept.norm, norm)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda h: resolve(h, None), "such as 'active-set'; got None"),  # type: ignore[arg-type]
        (lambda h: resolve(list(h.levels)), "Hierarchy, got list"),  # type: ignore[arg-type]
    ],
)
def test_resolve_refuses_what_it_cannot_resolve(ask, message):
    """Anything but a hierarchy and a name."""
    with pytest.raises(InvalidValue, match=message):
        ask(Hierarchy([Level([[1.0]], [0.0])]))


def test_a_lower_bound_above_its_upper_bound_is_infeasible():
    """The bound is named with both its values."""
    with pytest.raises(Infeasible, match="bound 1 is empty, lower 2 and upper 1"):
        Hierarchy([Level(np.eye(2), np.zeros(2))], box=([0.0, 2.0], [1.0, 1.0]))


def test_a_norm_that_is_symmetric_but_for_rounding_is_taken():
    """A relative difference of 1e-15 between an entry and its transpose comes from computing W."""
    norm = [[2.0, 1.0], [1.0 + 1e-15, 2.0]]
    np.testing.assert_array_equal(Hierarchy([Level(np.eye(2), [0.0, 0.0])], norm=norm).norm, norm)


def test_equal_bounds_fix_an_unknown():
    """lower = upper is no empty interval; an infinite bound on the wrong side is one."""
    fixed = Hierarchy([Level(np.eye(2), [5.0, 5.0])], box=([1.0, -9.0], [1.0, 9.0]))
    np.testing.assert_allclose(resolve(fixed).x, [1.0, 5.0], atol=1e-12)
    for box in (([np.inf], [np.inf]), ([-np.inf], [-np.inf])):
        with pytest.raises(Infeasible, match="bound 0 is empty"):
            Hierarchy([Level([[1.0]], [0.0])], box=box)
