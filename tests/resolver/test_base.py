"""Memory from outside is checked before a compiled kernel sees it."""

from typing import Any

import numpy as np
import pytest

from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.base import Memory, Resolver, final_state
from taskopt.resolver.registry import resolver

BOX = ([-1.0, -1.0], [1.0, 1.0])
HIERARCHY = Hierarchy([Level([[1.0, 1.0]], [1.0])], box=BOX)
STATE = np.zeros(3, dtype=np.int8)


@pytest.mark.parametrize("name", ["active-set", "hqp/daqp", "pinv", "dls"])
@pytest.mark.parametrize(
    ("memory", "message"),
    [
        (Memory(np.zeros(2, dtype=np.int8)), "for each of 3 unknowns and rows"),
        (Memory(np.zeros(40, dtype=np.int8)), "for each of 3 unknowns and rows"),
        (Memory(np.zeros((1, 3), dtype=np.int8)), "for each of 3 unknowns and rows"),
        (Memory(np.array([5, -7, 100], dtype=np.int8)), "-1, 0 or 1"),
        (Memory(np.zeros(3)), "-1, 0 or 1"),  # type: ignore[arg-type]
        (Memory([0, 0, 0]), "-1, 0 or 1"),  # type: ignore[arg-type]
        (Memory(STATE, previous=np.zeros(5, dtype=np.int8)), "for each of 3 unknowns and rows"),
        (Memory(STATE, ranks=(1, 1, 1)), "each of 2 levels"),
        (STATE, "what a resolver returned last, got ndarray"),
    ],
)
def test_a_memory_of_another_problem_is_refused(name: str, memory: Any, message: str) -> None:
    """Size, content and type, by every resolver that has one."""
    with pytest.raises(InvalidValue, match=message):
        resolver(name)(HIERARCHY, memory)


@pytest.mark.parametrize("norm", [None, [[2.0, 0.5], [0.5, 1.0]]])
@pytest.mark.parametrize("name", ["active-set", "hqp/daqp", "wqp/daqp", "pinv", "dls"])
def test_its_own_memory_is_always_welcome(name: str, norm: Any) -> None:
    """What comes out goes in again, a full norm and an empty level among the problems."""
    answer: Resolver = resolver(name)
    for levels in ([Level([[1.0, 1.0]], [1.0])], [Level(np.empty((0, 2)), []), Level(np.eye(2), [1.0, 2.0])]):
        hierarchy = Hierarchy(levels, box=BOX, norm=norm)
        first, memory = answer(hierarchy)
        again, _ = answer(hierarchy, memory)
        np.testing.assert_allclose(again.x, first.x, atol=1e-12)


def test_a_logged_active_set_may_have_any_integer_type() -> None:
    """A file may have widened it."""
    wide = Memory(np.array([0, 1, 1], dtype=np.int64))  # type: ignore[arg-type]
    np.testing.assert_allclose(resolver("active-set")(HIERARCHY, wide)[0].x, [0.5, 0.5], atol=1e-12)


def test_violated_rows_are_active_without_a_multiplier() -> None:
    """x = 0.5 misses x ≥ 1 and x ≤ 0.2 and keeps x ≤ 2; equalities never count."""
    rows = Level([[1.0]] * 4, lower=[1.0, -np.inf, -np.inf, 0.0], upper=[np.inf, 0.2, 2.0, 0.0])
    hierarchy = Hierarchy([rows], box=([-1.0], [1.0]))
    state = final_state(hierarchy, np.array([0.5]), np.zeros((2, 5)))
    np.testing.assert_array_equal(state, [0, -1, 1, 0, 0])


def test_rows_with_a_multiplier_are_active_from_the_threshold_on() -> None:
    """1e-9 of the largest multiplier of a level counts, less is rounding."""
    hierarchy = Hierarchy([Level([[1.0, 1.0]], [9.0])], box=([-1.0, -1.0], [1.0, 1.0]))
    y = np.array([[10.0, 2e-8, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(final_state(hierarchy, np.ones(2), y), [1, 1, 0])
    y[0, 1] = 5e-9
    np.testing.assert_array_equal(final_state(hierarchy, np.ones(2), y), [1, 0, 0])
