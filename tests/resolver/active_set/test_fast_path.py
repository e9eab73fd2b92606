"""The fast path answers by itself where it should: else the search would, and hide the mistake."""

from dataclasses import replace

import numpy as np
import pytest

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.active_set.resolver import ActiveSet


def with_joint_rows(levels: list[Level], joints: int) -> Hierarchy:
    """Declare the last `joints` rows as joint rows, as the plan of a robot does."""
    declared = Hierarchy(levels)
    others = len(declared.lower) - joints
    layout = replace(declared.layout, column=(*(-1,) * others, *range(joints)))
    return Hierarchy.view(layout, declared.buffer, declared.norm)


def stationary_point(A: Array, b: Array, H: Array, g: Array) -> Array:
    """Minimise ½ xᵀ H x + gᵀ x with A x = b by the KKT system."""
    m = len(b)
    K = np.block([[H, A.T], [A, np.zeros((m, m))]])
    return np.linalg.solve(K, np.concatenate([-g, b]))[: len(g)]


def test_weights_of_joint_rows_count_once() -> None:
    """A strict row, then joint rows of weights 4 and 9: the fast path has the KKT point."""
    A, b, weight, target = (
        np.array([[1.0, 2.0]]),
        np.array([1.0]),
        np.array([4.0, 9.0]),
        np.array([0.5, -0.3]),
    )
    hierarchy = with_joint_rows([Level(A, b), Level(np.eye(2), target, weight=weight)], 2)
    resolution, _ = ActiveSet()(hierarchy)
    assert resolution.iterations == 0
    wanted = stationary_point(A, b, np.diag(weight), -weight * target)
    np.testing.assert_allclose(resolution.x, wanted, rtol=0, atol=1e-12)


def test_weights_of_soft_rows_count_once() -> None:
    """One level of a row of weight 4 and joint rows: the fast path has the weighted least squares."""
    a, target = np.array([1.0, 2.0]), np.array([0.5, -0.3])
    weight = np.array([4.0, 1.0, 1.0])
    level = Level(np.vstack([a, np.eye(2)]), [1.0, *target], weight=weight)
    resolution, _ = ActiveSet()(with_joint_rows([level], 2))
    assert resolution.iterations == 0
    wanted = np.linalg.solve(np.eye(2) + 4.0 * np.outer(a, a), target + 4.0 * a)
    np.testing.assert_allclose(resolution.x, wanted, rtol=0, atol=1e-12)


def test_an_unknown_with_next_to_no_cost_keeps_that_cost() -> None:
    """Joint rows of weights 1 and 1e-8: the second is uncovered, and its cost still counts."""
    A, b, weight, target = np.array([[1.0, 1e-4]]), np.array([1.0]), np.array([1.0, 1e-8]), np.zeros(2)
    hierarchy = with_joint_rows([Level(A, b), Level(np.eye(2), target, weight=weight)], 2)
    resolution, _ = ActiveSet()(hierarchy)
    assert resolution.iterations == 0
    wanted = stationary_point(A, b, np.diag(weight), np.zeros(2))
    np.testing.assert_allclose(resolution.x, wanted, rtol=1e-9)


@pytest.mark.parametrize("apart", [1e-4, 1e-6])
def test_rows_that_nearly_depend_are_left_to_the_search(apart: float) -> None:
    """Normal equations square the condition number: two rows a little apart are not for the fast path."""
    hierarchy = Hierarchy([Level([[1.0, 0.0, 0.0], [1.0, apart, 0.0]], [1.0, 1.0 + apart])])
    resolution, _ = ActiveSet()(hierarchy)
    assert resolution.iterations > 0
    np.testing.assert_allclose(resolution.x, [1.0, 1.0, 0.0], rtol=0, atol=1e-9)
