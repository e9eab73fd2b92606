"""Jumps are found, measured beside the change of the problem, and blamed on the cause that was planted."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt import (
    Controller,
    Hierarchy,
    JointAccelerationLimit,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Level,
    PositionTask,
    RestDamping,
    Stack,
)
from taskopt.hierarchy import jumps
from taskopt.hierarchy.causes import ADVICE
from taskopt.hierarchy.jumps import JumpWatch, change_of_problem
from taskopt.hierarchy.resolution import Resolution
from taskopt.kinematics.task import During
from taskopt.resolver.active_set.resolver import ActiveSet
from tests.helpers.robots import robot

DT = 0.01


def answer(A, b, box=None) -> Resolution:
    """The answer of `active-set` to one level."""
    return ActiveSet()(Hierarchy([Level(A, b)], box=box or ([-9.0, -9.0], [9.0, 9.0])))[0]


def watched(stack: Stack, ticks: int = 200, dt: float = DT) -> JumpWatch:
    """Let a Panda follow a stack from its default posture."""
    of = robot("panda")
    control, q = Controller(of, stack, dt=dt, watch=True), of.posture("default")
    for k in range(ticks):
        q = of.integrate(q, control.step(q, k * dt).v, dt)
    assert control.continuity is not None
    return control.continuity.jumps


def stretched(**given_to_stack: object) -> Stack:
    """A hand whose target is out of reach."""
    far = PositionTask("panda_hand", target=(1.2, 0.2, 0.6), gain=5.0)
    limits = [JointPositionLimit(), JointVelocityLimit(), *given_to_stack.pop("limits", [])]
    return Stack([[far], [JointTask()]], limits, **given_to_stack)


@given(
    b=st.lists(st.floats(-5.0, 5.0), min_size=4, max_size=4),
    A=st.lists(st.floats(-3.0, 3.0), min_size=8, max_size=8),
)
@settings(max_examples=50, deadline=None)
def test_the_change_of_the_problem_is_that_of_its_rows_in_the_unit_of_the_unknowns(b, A):
    """Two equalities: |Δb| + |ΔA x|, divided by the length of the row, by its definition row by row."""
    before, after = np.array(A[:4]).reshape(2, 2), np.array(A[4:]).reshape(2, 2)
    first, second = answer(before, b[:2]), answer(after, b[2:])
    if np.abs(first.x).max() > 8.0 or np.abs(second.x).max() > 8.0:
        return
    expected = []
    for old, new, b_old, b_new in zip(before, after, b[:2], b[2:], strict=True):
        length = float(np.sqrt(new @ new)) or 1.0
        turned = abs(sum((new[i] - old[i]) * first.x[i] for i in range(2)))
        expected.append((abs(b_new - b_old) + turned) / length)
    assert change_of_problem(first, second) == pytest.approx(max(expected), rel=1e-12, abs=1e-12)


def test_only_the_side_counts_that_is_active() -> None:
    """A bound that is far away may move as it likes; one that holds the answer counts."""
    held = answer(np.eye(2), [5.0, 0.0], ([-9.0, -9.0], [1.0, 9.0]))
    other_side = answer(np.eye(2), [5.0, 0.0], ([-7.0, -9.0], [1.0, 9.0]))
    same_side = answer(np.eye(2), [5.0, 0.0], ([-9.0, -9.0], [1.5, 9.0]))
    assert change_of_problem(held, other_side) == 0.0
    assert change_of_problem(held, same_side) == 0.5


def pair(cause: str) -> tuple[Resolution, Resolution]:
    """Two ticks between which the answer jumps, for one cause."""
    if cause == "transition":
        off = Hierarchy([Level(np.eye(2), lower=np.full(2, -np.inf), upper=np.full(2, np.inf))])
        return ActiveSet()(off)[0], answer(np.eye(2), [1.0, 1.0])
    if cause == "rank":
        near = np.array([[1.0, 1.0], [1.0, 1.0 + 1e-4]])
        return answer(near, [1.0, 1.0]), answer(near, [1.0, 1.0 + 2e-4])
    if cause == "gain":
        return answer(np.eye(2), [1.0, 0.0]), answer(np.eye(2), [-1.0, 0.0])
    return answer(np.eye(2), [1.0, 0.0]), answer(np.eye(2), [2.0, 0.0])


@pytest.mark.parametrize("cause", ["transition", "rank", "gain", "dt"])
def test_the_planted_cause_is_named(cause: str) -> None:
    """The jump names its unknown, its size, and what to do."""
    watch = JumpWatch()
    first, second = pair(cause)
    assert watch.add(first) == 0.0
    size = watch.add(second)
    assert size == pytest.approx(np.abs(second.x - first.x).max())
    assert watch.largest is not None
    assert watch.largest.cause == cause
    assert ADVICE[cause] in str(watch.largest)


def test_a_watch_that_does_not_look_at_the_rank_is_caught(monkeypatch) -> None:
    """Without the look at singular values the case of rank is blamed on something else."""
    monkeypatch.setattr(jumps, "loses_rank", lambda *_: False)
    with pytest.raises(AssertionError):
        test_the_planted_cause_is_named("rank")


def test_a_target_out_of_reach_is_a_matter_of_rank_and_both_remedies_work() -> None:
    """The stretched arm jumps; an acceleration limit bounds it, damping brings the arm to rest."""
    shaking = watched(stretched())
    assert shaking.steepest is not None
    assert shaking.steepest.cause == "rank"
    assert shaking.largest is not None
    assert shaking.largest.size > 4.0
    limited = watched(stretched(limits=[JointAccelerationLimit(15.0)]))
    assert limited.largest is not None
    assert limited.largest.size <= 15.0 * DT + 1e-9
    resting, of, path = stretched(damping=RestDamping()), robot("panda"), []
    control, q = Controller(of, resting, dt=DT), of.posture("default")
    for k in range(250):
        path.append(control.step(q, k * DT).v.copy())
        q = of.integrate(q, path[-1], DT)
    assert np.abs(np.diff(path[-50:], axis=0)).max() < 1e-3


def test_a_task_that_is_switched_on_is_a_transition_and_blending_helps() -> None:
    """Switched at once it jumps; over half a second it does not."""
    sizes = []
    for blend in (0.0, 0.5):
        aside = During(PositionTask("panda_hand", target=(0.3, 0.4, 0.5), gain=3.0), begin=0.2, blend=blend)
        found = watched(Stack([[aside], [JointTask()]], [JointVelocityLimit()]), ticks=100)
        assert found.largest is not None
        assert found.largest.cause == "transition"
        sizes.append(found.largest.size)
    assert sizes[1] < 0.2 * sizes[0]


def test_a_gain_beyond_the_step_is_named_and_a_lower_one_helps() -> None:
    """K Δt = 1.8 overshoots its target at every tick; K Δt = 0.5 never does."""
    of = robot("panda")
    goal = of.posture("default") + 0.1
    fast, slow = (watched(Stack([[JointTask(goal, gain=gain / DT)]]), ticks=60) for gain in (1.8, 0.5))
    assert fast.largest is not None
    assert slow.largest is not None
    assert fast.largest.cause == "gain"
    assert slow.largest.cause == "dt"
    assert slow.largest.size < 0.3 * fast.largest.size


def test_a_reachable_motion_is_not_abrupt() -> None:
    """An arm that follows its problem has no abrupt jump."""
    near = PositionTask("panda_hand", target=(0.4, 0.2, 0.5), gain=2.0)
    found = watched(Stack([[near], [JointTask()]], [JointPositionLimit(), JointVelocityLimit()]))
    assert found.largest is not None
    assert not found.largest.is_abrupt
    assert found.steepest is None or not found.steepest.is_abrupt
