"""`cvxpy/<solver>` against the exact optimum, and our resolvers against it on the objectives of Sect. 3.5."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.status import Status
from taskopt.loop.run import run
from taskopt.loop.scenario import load_scenario
from taskopt.resolver.cvxpy_model import CvxpyModel
from taskopt.resolver.registry import resolve, resolver
from tests.helpers.oracles import lexicographic_optimum, random_hierarchy

TASKS = Path(__file__).parents[2] / "tasks"
OBJECTIVES = (
    "square_inverse", "weighted_norm", "minimum_norm", "internal_motion", "manipulability", "joint_range",
    "damped", "damping_policy", "singular", "obstacle_distance", "obstacle_first", "panda_circle",
    "writing", "throwing",
)  # fmt: skip


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_any_hierarchy_has_its_exact_optimum(seed: int) -> None:
    """Rank-deficient, conflicting and inequality levels, limits and norms: as rational arithmetic has it."""
    hierarchy = random_hierarchy(seed)
    resolution = CvxpyModel("clarabel")(hierarchy)[0]
    assert resolution.status is Status.SOLVED
    np.testing.assert_allclose(resolution.x, lexicographic_optimum(hierarchy), atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["daqp", "proxqp"])
def test_other_solvers_find_it_or_do_not_prove_it(engine: str) -> None:
    """No answer that is wrong is certified."""
    for seed in range(20):
        hierarchy = random_hierarchy(seed)
        resolution = CvxpyModel(engine)(hierarchy)[0]
        apart = np.abs(resolution.x - lexicographic_optimum(hierarchy)).max()
        assert apart < 1e-5 or not resolution.kkt_met()


@pytest.mark.parametrize("name", OBJECTIVES)
def test_our_resolvers_agree_with_the_restatement_on_every_objective(name: str) -> None:
    """Each tick of a scenario has one answer: the chapter's, ours, and that of a cascade of programs."""
    scenario = load_scenario(TASKS / f"{name}.py")
    for step in run(scenario, resolver("active-set")):
        if step.index % 25 == 0:
            told = resolve(step.hierarchy, "cvxpy/clarabel")
            size = max(1.0, float(np.abs(step.v).max()))
            assert told.kkt_met()
            np.testing.assert_allclose(told.x, step.v, atol=1e-8 * size)
            np.testing.assert_allclose(resolve(step.hierarchy, "hqp/daqp").x, told.x, atol=1e-8 * size)
        if step.index >= 500:
            break


def test_limits_that_bind_are_named_with_their_multipliers() -> None:
    """A conflict with the box: the row gives way in least squares, the bound is active."""
    hierarchy = Hierarchy(
        [Level([[1.0, 1.0]], [5.0], name="reach"), Level(np.eye(2), [0.3, 0.1], name="rest")],
        box=(-np.ones(2), np.ones(2)),
    )
    resolution = resolve(hierarchy, "cvxpy/clarabel")
    np.testing.assert_allclose(resolution.x, [1.0, 1.0], atol=1e-9)
    assert {active.side for active in resolution.active} == {"upper"}
    assert resolution.kkt_met()


@pytest.mark.parametrize(
    ("box", "limits"),
    [
        (([0.0, 0.0], [1.0, 1.0]), Level([[1.0, 1.0]], lower=[3.0])),
        (None, Level([[1.0, 1.0], [2.0, 2.0]], [1.0, 3.0])),
    ],
)
def test_contradicting_limits_leave_no_answer(box: tuple | None, limits: Level) -> None:
    """Inequalities or equalities that exclude each other: INFEASIBLE, and x is no number."""
    hierarchy = Hierarchy([Level(np.eye(2), [0.0, 0.0])], box=box, limits=limits)
    resolution = resolve(hierarchy, "cvxpy/clarabel")
    assert resolution.status is Status.INFEASIBLE
    assert np.isnan(resolution.x).all()


@pytest.mark.parametrize("rows", [[[1.0, 1.0, 0.0]], np.zeros((0, 3)), np.zeros((2, 3))])
def test_what_no_level_asks_for_is_the_least_norm(rows: list) -> None:
    """No rows, rows of zeros, and one row: what stays free is W-orthogonal to what is asked."""
    A = np.asarray(rows)
    W = np.diag([1.0, 2.0, 3.0])
    told = resolve(Hierarchy([Level(A, np.ones(len(A)) * A.any())], norm=W), "cvxpy/clarabel")
    expected = np.array([2.0, 1.0, 0.0]) / 3.0 if A.any() else np.zeros(3)
    np.testing.assert_allclose(told.x, expected, atol=1e-9)


def test_the_closed_form_answer_is_task_priority() -> None:
    """Its closed form is that of every strict resolver."""
    hierarchy = random_hierarchy(3, "generic")
    np.testing.assert_array_equal(
        resolver("cvxpy/clarabel").closed_form(hierarchy), resolver("hqp/daqp").closed_form(hierarchy)
    )
