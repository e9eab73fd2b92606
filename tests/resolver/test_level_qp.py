"""One level of `hqp` as a program: rows on the free directions, and proximal steps that are tried again."""

import numpy as np
import pytest

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import final_state
from taskopt.resolver.level_qp import RowSet, least_violation, row_svd
from taskopt.resolver.solver_accuracy import SolverTo
from taskopt.solver.registry import solver


def rows(G: list[list[float]], lower: list[float], upper: list[float]) -> RowSet:
    return RowSet(np.array(G), np.array(lower), np.array(upper), np.arange(len(lower)))


def test_bounds_of_a_feasible_point_are_clipped_so_that_it_is_feasible_exactly() -> None:
    """ξ keeps a row but for rounding: on z, zero is inside; where ξ is not known to keep it, it is not."""
    row = rows([[1.0, 0.0]], [1.0], [2.0])
    xi = np.array([1.0 - 1e-12, 0.0])
    assert row.seen_from(xi, np.eye(2), feasible=True).lower[0] == 0.0
    assert row.seen_from(xi, np.eye(2), feasible=False).lower[0] > 0.0


def test_a_stronger_pull_is_tried_where_a_solver_fails() -> None:
    """ξ keeps a row but for rounding: zero is inside on z; if ξ is not known to keep it, zero is not."""
    engine = SolverTo(solver("daqp"), 1e-8)

    def fails_near_singularity(program: QuadraticProgram) -> Solution:
        found = engine(program)
        if np.diagonal(program.H).min() < 1e-3:
            return Solution(found.x, found.y, found.y_box, Status.FAILED, 1)
        return found

    equal = row_svd(np.array([[1.0, 0.0]]), np.array([2.0]), len)
    limit = rows([[1.0, 0.0]], [-np.inf], [1.0])
    nothing = RowSet(np.empty((0, 2)), np.empty(0), np.empty(0), np.empty(0, np.int64))
    found = least_violation(fails_near_singularity, equal, nothing, limit)
    assert found.status is Status.SOLVED
    np.testing.assert_allclose(found.z, [1.0, 0.0], rtol=0, atol=1e-6)


@pytest.mark.parametrize(("x", "side"), [(2.0, 1), (-2.0, -1), (0.0, 0)])
def test_a_violated_row_is_active_without_a_multiplier(x: float, side: int) -> None:
    """The row of the last level has no multiplier of its own; it is active because it is violated."""
    hierarchy = Hierarchy([Level([[1.0]], lower=[-1.0], upper=[1.0])])
    state = final_state(hierarchy, np.array([x]), np.zeros((2, 2)))
    np.testing.assert_array_equal(state, [0, side])
