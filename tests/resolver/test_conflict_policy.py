"""Contradicting hard limits in the loop: named, kept for a post-mortem, relaxed by the least, or braked."""

from typing import get_args

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from taskopt import Controller, Hierarchy, JointTask, JointVelocityLimit, Level, Scenario, Stack
from taskopt.errors import Infeasible, InvalidValue, MissingFile, NotSolved, UnknownName
from taskopt.hierarchy.status import Status
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import BoundLimit, JointAccelerationLimit, Limit
from taskopt.kinematics.robot import Robot, planar_arm
from taskopt.loop.run import run
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.infeasible import ConflictPolicy, apply_conflict_policy, find_conflict, no_answer, relax
from taskopt.resolver.registry import resolver
from tests.resolver.test_conflict import random_limits

ARM = planar_arm([0.5, 0.5, 0.5], lower=-3.0, upper=3.0, velocity=9.0)
# Faster than the velocity limit, which knows no brakes: 2.9 ≤ v by acceleration, v ≤ 2 by velocity.
STACK = Stack(
    [[JointTask([1.0, 1.0, 1.0])]], [JointAccelerationLimit(10.0), JointVelocityLimit(velocity=2.0)]
)
FAST = np.array([3.0, 0.0, 0.0])


def controller(policy: str, name: str = "active-set") -> Controller:
    return Controller(ARM, STACK, name, dt=1e-2, on_conflict=policy)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["active-set", "hqp/daqp", "hqp/clarabel", "hqp/proxqp", "wqp/daqp"])
def test_the_error_names_the_limits_and_keeps_the_problem(name: str) -> None:
    """`Infeasible` says which sides exclude each other, by how much, in units, and has the hierarchy."""
    with pytest.raises(Infeasible, match="joint_velocity/joint1 ≤ 2 rad/s") as caught:
        controller("raise", name).step(np.zeros(3), 0.0, FAST)
    words = str(caught.value)
    assert "joint_acceleration/joint1 ≥ 2.9 rad/s" in words
    assert "least relaxation: " in words
    assert "by 0.45 rad/s" in words
    assert isinstance(caught.value.hierarchy, Hierarchy)
    assert find_conflict(caught.value.hierarchy) is not None


def test_the_next_step_after_an_error_is_right() -> None:
    """What was raised leaves nothing behind."""
    control = controller("raise")
    want = control.step(np.zeros(3), 0.0, np.zeros(3)).v.copy()
    with pytest.raises(Infeasible):
        control.step(np.zeros(3), 0.0, FAST)
    np.testing.assert_array_equal(control.step(np.zeros(3), 0.0, np.zeros(3)).v, want)


@pytest.mark.parametrize("name", ["active-set", "hqp/daqp"])
def test_relaxed_limits_give_way_by_the_least_and_the_answer_says_so(name: str) -> None:
    """Half of the gap each; status, notes and explanation tell; the rest of the problem is as declared."""
    resolution = controller("relax", name).step(np.zeros(3), 0.0, FAST)
    assert resolution.status is Status.RELAXED
    assert resolution.v[0] == pytest.approx(2.45, abs=1e-5)
    np.testing.assert_allclose(resolution.v[1:], 0.1, atol=1e-5)
    assert "joint_velocity/joint1 upper by 0.45 rad/s" in resolution.notes[0]
    assert resolution.explain().startswith(resolution.notes[0])
    assert resolution.kkt_met()


def test_brakes_slow_down_as_hard_as_allowed_and_the_answer_says_what_they_break() -> None:
    """v goes to 0 by a Δt a tick; no other joint moves."""
    control = controller("brake")
    resolution = control.step(np.zeros(3), 0.0, FAST)
    assert resolution.status is Status.BRAKED
    np.testing.assert_allclose(resolution.v, [2.9, 0.0, 0.0], atol=1e-12)
    assert "joint_velocity/joint1" in resolution.notes[1]
    assert "0.9 rad/s" in resolution.notes[1]
    for _ in range(9):
        resolution = control.step(np.zeros(3), 0.0)
    assert resolution.v[0] == pytest.approx(2.0)
    assert control.step(np.zeros(3), 0.0).status is Status.SOLVED


def test_a_run_follows_the_policy_of_its_scenario() -> None:
    """`on_conflict` of the scenario decides, and is checked when it is declared."""
    stack = Stack([[JointTask([9.0, 9.0, 9.0], gain=50.0)]], [JointAccelerationLimit(10.0), _Wall()])
    parts = {"robot": ARM, "q0": [0.0, 0.0, 0.0], "stack": stack, "duration": 1.0, "dt": 1e-2}
    with pytest.raises(Infeasible, match=r"active-set at t = .* wall/joint1"):
        list(run(Scenario(**parts), ActiveSet()))
    statuses = [step.resolution.status for step in run(Scenario(**parts, on_conflict="brake"), ActiveSet())]
    assert set(statuses) == {Status.SOLVED, Status.BRAKED}
    with pytest.raises(UnknownName, match="did you mean brake"):
        Scenario(**parts, on_conflict="break")


class _Wall(Limit):
    """No joint 1 beyond 0.4 rad, without a thought for how it is to stop."""

    name = "wall"

    def bind(self, robot: Robot, dt: float) -> "_BoundWall":
        return _BoundWall(dt)


class _BoundWall(BoundLimit):
    """v_1 ≤ (0.4 − q_1)/Δt."""

    def __init__(self, dt: float) -> None:
        super().__init__("wall")
        self._dt = dt

    def narrow(self, configuration: Configuration, bounds: np.ndarray, owner: int) -> None:
        upper = max((0.4 - configuration.q[0]) / self._dt, 0.0)
        if upper < bounds[1, 0]:
            bounds[1, 0], bounds[3, 0] = upper, owner


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_what_is_relaxed_can_be_solved_and_less_would_not_do(seed: int) -> None:
    """With the whole relaxation the hierarchy is solved and certified; 99 % of it leave a conflict."""
    hierarchy = random_limits(seed)
    found = find_conflict(hierarchy)
    assume(found is not None)
    answer = ActiveSet()(relax(hierarchy, found))[0]
    assert answer.status is Status.SOLVED
    assert answer.kkt_met()
    less = tuple((side, 0.99 * gap) for side, gap in found.relaxation)
    assert find_conflict(relax(hierarchy, type(found)(found.members, less))) is not None


def test_a_solver_that_claims_a_conflict_where_there_is_none_is_not_believed() -> None:
    """Phase one decides: the error is that of an answer that is missing."""
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]))
    claimed = no_answer(hierarchy, Status.INFEASIBLE)[0]
    assert claimed.status is Status.FAILED
    claimed = claimed.replaced(Status.INFEASIBLE)
    for policy in get_args(ConflictPolicy):
        assert (
            apply_conflict_policy(policy, resolver("hqp/daqp"), hierarchy, claimed, np.zeros(1), "t = 0")
            is claimed
        )


@pytest.mark.parametrize("norm", [None, [1.0, 2.0, 3.0], np.diag([1.0, 2.0, 3.0]) + 0.1])
def test_a_saved_hierarchy_is_the_same_elsewhere(tmp_path, norm) -> None:
    """Every number bit by bit, every name, and so the same answer and the same conflict."""
    file = tmp_path / "tick.npz"
    kept = Hierarchy(
        [Level(np.eye(3), [1.0, 2.0, 3.0], name="reach")], box=(-np.ones(3), np.ones(3)), norm=norm
    )
    kept.save(file)
    read = Hierarchy.load(file)
    assert read.layout == kept.layout
    np.testing.assert_array_equal(read.buffer, kept.buffer)
    np.testing.assert_array_equal(ActiveSet()(read)[0].x, ActiveSet()(kept)[0].x)
    with pytest.raises(Infeasible) as caught:
        controller("raise").step(np.zeros(3), 0.0, FAST)
    caught.value.hierarchy.save(file)  # type: ignore[attr-defined]
    assert str(find_conflict(Hierarchy.load(file))) in str(caught.value)


def test_a_file_that_is_no_hierarchy_is_refused(tmp_path) -> None:
    """Missing, not a zip, another archive, and names that do not fit the numbers."""
    with pytest.raises(MissingFile):
        Hierarchy.load(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("hello")
    np.savez(tmp_path / "other.npz", a=np.ones(3))
    hierarchy = Hierarchy([Level([[1.0]], [0.0])])
    hierarchy.buffer = hierarchy.buffer[:-1]
    hierarchy.save(tmp_path / "short.npz")
    for name in ("text", "other", "short"):
        with pytest.raises(InvalidValue, match=name):
            Hierarchy.load(tmp_path / f"{name}.npz")


def test_an_unknown_policy_is_refused() -> None:
    """With the names that there are."""
    with pytest.raises(UnknownName, match="raise, relax, brake"):
        controller("hope")
    assert not issubclass(NotSolved, Infeasible)
