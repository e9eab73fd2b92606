"""Rest: a robot whose still target cannot be met stands still, and its hierarchy says what damps it."""

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from cases import benchmark_case
from scipy.optimize import lsq_linear

from taskopt import (
    Configuration,
    Controller,
    FrameTask,
    Hierarchy,
    InvalidValue,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Level,
    NoDamping,
    PositionTask,
    Resolution,
    RestDamping,
    Robot,
    Scenario,
    SelfCollisionLimit,
    Stack,
    planar_arm,
    resolve,
    run,
)
from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.directions import null_space, singular_values
from taskopt.hierarchy.multipliers import certify_velocity
from taskopt.hierarchy.rank_doubt import new_watch, rank_in_doubt
from taskopt.hierarchy.rest import damped_directions, parts_of
from taskopt.kinematics.limit.bound_distance import SpeedBounds
from taskopt.loop.rest import Rest
from taskopt.loop.rest_again import damp_again

BLOCKED, STRETCHED = (0.05, 0.0, 0.3), (1.2, 0.2, 0.6)  # [m] behind a joint limit, and out of reach
DT = 0.01


@cache
def panda() -> Robot:
    return Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))


def hand_stack(target: tuple[float, ...], gain: float = 5.0, *, damped: bool = True) -> Stack:
    hand = PositionTask("panda_hand", target=np.array(target), gain=gain, name="hand")
    limits = [JointPositionLimit(), JointVelocityLimit()]
    return Stack([[hand], [JointTask(name="posture")]], limits, damping=RestDamping() if damped else None)


@cache
def steps(
    target: tuple[float, ...], *, damped: bool = True, gain: float = 5.0, dt: float = DT, seconds: float = 3.0
) -> tuple[tuple[Resolution, ...], Controller]:
    control = Controller(panda(), hand_stack(target, gain, damped=damped), dt=dt)
    q, found = panda().posture("default"), []
    for k in range(round(seconds / dt)):
        found.append(control.step(q, k * dt))
        q = panda().integrate(q, found[-1].v, dt)
    return tuple(found), control


def last_jump(found: Sequence[Resolution], ticks: int = 50) -> float:
    return float(np.abs(np.diff([tick.v for tick in found[-ticks:]], axis=0)).max())


@pytest.mark.parametrize("target", [BLOCKED, STRETCHED])
def test_an_arm_rests_where_its_target_cannot_be_met(target: tuple[float, ...]) -> None:
    """Without damping the velocities jump by radians per second at every tick."""
    assert last_jump(steps(target)[0]) < 1e-3
    assert last_jump(steps(target, damped=False)[0]) > 1.0


def test_the_error_that_remains_is_that_of_the_undamped_arm_at_most() -> None:
    """Damping costs nothing of what the task can have."""
    for target in (BLOCKED, STRETCHED):
        errors = [np.linalg.norm(steps(target, damped=way)[1].plan.tasks[0].error) for way in (True, False)]
        assert errors[0] <= 1.001 * errors[1]


def test_a_reachable_target_is_never_damped() -> None:
    """In transit the velocity limits are active, and the hand cannot be as fast as it is asked to."""
    found, control = steps((0.5, 0.2, 0.4))
    assert control.damped_ticks == 0
    assert any(tick.active for tick in found)
    assert all(tick.undamped is None for tick in found)
    assert np.linalg.norm(control.plan.tasks[0].error) < 1e-4


@pytest.mark.parametrize("name", ["W1", "W1v", "W1s", "W2", "W2s", "W2h"])
def test_no_tick_of_the_reachable_benchmark_cases_is_damped(name: str) -> None:
    """Neither where velocity limits are active, nor where tasks of one level are weighed."""
    case = benchmark_case(name, 120)
    assert case.stack.damping is not None
    control, q = Controller(case.robot, case.stack, dt=0.002), case.q0
    for k, pose in enumerate(case.poses):
        case.hand.set(pose)
        q = case.robot.integrate(q, control.step(q, 0.002 * k).v, 0.002)
    assert control.damped_ticks == 0


def test_the_damping_stands_in_the_problem_by_name_and_is_proven() -> None:
    """The certificate is that of the damped problem; of the declared one the answer is no optimum."""
    found, control = steps(STRETCHED)
    tick = found[-1]
    assert control.damped_ticks == sum(one.undamped is not None for one in found) > 100
    names = [(block.level, block.name) for block in tick.problem.layout.blocks]
    assert names == [
        (1, "hand"),
        (1, "rest of level 1"),
        (2, "posture"),
        (2, "free directions of level 1"),
    ]
    assert tick.kkt_met()
    assert certify_velocity(tick.problem, tick.v).kkt_met()
    assert "rests" not in tick.explain()
    assert "so that the robot comes to rest" in tick.explain()
    undamped = tick.undamped
    assert undamped is not None
    assert [block.name for block in undamped.problem.layout.blocks] == ["hand", "posture"]
    assert tick.damping_distance == np.abs(tick.v - undamped.v).max() > 0.1
    assert undamped.damping_distance == 0.0
    assert not certify_velocity(undamped.problem, tick.v).kkt_met()


def test_other_resolvers_and_the_closed_form_answer_the_damped_problem() -> None:
    """The rows of damping are rows like any other."""
    tick = steps(STRETCHED)[0][-1]
    for name in ("hqp/daqp", "hqp/clarabel"):
        np.testing.assert_allclose(resolve(tick.problem, name).x, tick.x, atol=1e-6)
    assert not tick.active, "so that the closed form is the optimum"
    assert tick.review is not None
    np.testing.assert_allclose(tick.review.closed_form, tick.x, atol=1e-9)


def test_damping_is_the_default_at_order_1() -> None:
    """At order 2 there is none unless it is asked for, also in a copy of a stack of order 1."""
    stack = Stack([[JointTask()]])
    assert stack.damping == RestDamping()
    assert replace(stack, order=2).damping is None
    assert Stack([[JointTask()]], damping=RestDamping(), order=2).damping == RestDamping()


def test_stacks_without_damping_and_single_hierarchies_have_no_such_rows() -> None:
    """A plan never has them; a stack may do without."""
    assert steps(STRETCHED, damped=False)[1].damped_ticks == 0
    assert all(tick.undamped is None for tick in steps(STRETCHED, damped=False)[0])
    layout = steps(STRETCHED)[1].plan.layout
    assert [block.name for block in layout.blocks] == ["hand", "posture"]
    with pytest.raises(InvalidValue, match="LevelDamping"):
        Stack([[JointTask()]], damping=NoDamping())  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_scenario_is_damped_and_its_step_keeps_the_declared_problem() -> None:
    """With any strict resolver; without damping the velocities jump."""
    arm = planar_arm([0.5, 0.5, 0.5], velocity=2.0)
    far = PositionTask("tip", target=(1.8, 1.2, 0.0), gain=5.0, axes="xy")
    stack = Stack([[far], [JointTask()]], [JointVelocityLimit()], damping=RestDamping())
    scenario = Scenario(robot=arm, q0=[0.3, 0.5, 0.4], stack=stack, duration=3.0, dt=DT)
    for name in ("active-set", "hqp/daqp"):
        found = list(run(scenario, name))
        assert np.abs(found[-1].v - found[-2].v).max() < 1e-3
        assert found[-1].resolution.undamped is not None
        assert [block.name for block in found[-1].hierarchy.layout.blocks] == ["tip position", "posture"]
        np.testing.assert_allclose(found[-1].closed_form, found[-1].v, atol=1e-6)
    undamped = list(run(replace(scenario, stack=replace(stack, damping=None))))
    assert np.abs(undamped[-1].v - undamped[-2].v).max() > 0.1


def test_a_copy_of_a_controller_rests_as_the_original_does() -> None:
    """Damping has no memory."""
    _, control = steps(STRETCHED)
    q = control.plan.configuration.q.copy()
    np.testing.assert_array_equal(deepcopy(control).step(q, 3.0).v, control.step(q, 3.0).v)


def test_an_arm_rests_although_the_undamped_answer_leaves_nothing_to_damp(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The first look of each tick, at the undamped answer, is made blind at rest."""
    found, control = steps(STRETCHED)
    control, damp_free, blind = deepcopy(control), Rest._damp_free, [True]
    q = panda().posture("default")
    for tick in found:
        q = panda().integrate(q, tick.v, DT)

    def first_blind(rest: Rest, x: Array, state: StateArray, speed: float) -> int:
        return 0 if blind and blind.pop() else damp_free(rest, x, state, speed)

    monkeypatch.setattr(Rest, "_damp_free", first_blind)
    monkeypatch.setattr(Rest, "again", lambda *_: None)
    fresh, after = Controller(panda(), hand_stack(STRETCHED), dt=DT).step(q, 3.0), [found[-1]]
    for k in range(5):
        blind[:] = [True]
        after.append(control.step(q, 3.0 + k * DT))
        q = panda().integrate(q, after[-1].v, DT)
    assert not blind
    assert last_jump(after) < 1e-3
    assert np.abs(fresh.v - found[-1].v).max() > 1.0


def steps_beside(
    control: Controller, q: Array, monkeypatch: pytest.MonkeyPatch, ticks: int = 60
) -> list[tuple[Resolution, Resolution]]:
    """Answers of a controller, and those at the same q of one that damps each tick as if it were first."""
    other, again, found = deepcopy(control), Rest.again, []
    for k in range(ticks):
        own = control.step(q, k * DT)
        with monkeypatch.context() as patched:
            patched.setattr(Rest, "again", lambda *_: None)
            found.append((own, other.step(q, k * DT)))
        assert Rest.again is again
        q = panda().integrate(q, own.v, DT)
    return [pair for pair in found if pair[1].is_damped]


def apart(pairs: list[tuple[Resolution, Resolution]]) -> float:
    return max(float(np.abs(own.v - other.v).max()) for own, other in pairs)


@pytest.mark.parametrize("target", [BLOCKED, STRETCHED])
def test_a_tick_after_a_damped_one_is_damped_as_the_first(
    target: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It begins with the last damped answer, and yet its answer is the same; so is the undamped one."""
    control, q = Controller(panda(), hand_stack(target), dt=DT), panda().posture("default")
    pairs = steps_beside(control, q, monkeypatch, 160)
    assert len(pairs) > 20
    assert apart(pairs) < 1e-9
    for own, other in pairs[::10]:
        assert own.undamped is not None
        assert other.undamped is not None
        np.testing.assert_allclose(own.undamped.v, other.undamped.v, atol=1e-9)
        assert own.undamped.kkt_met()
        assert own.damping_distance == pytest.approx(other.damping_distance, abs=1e-9)


def test_so_it_is_where_a_hard_row_holds_another_value_at_each_tick(monkeypatch: pytest.MonkeyPatch) -> None:
    """The hand slides along the base."""
    control = self_controller()
    pairs = steps_beside(control, np.array(SELF_START), monkeypatch)
    assert len(pairs) > 20
    assert apart(pairs) < 1e-9
    assert all(own.state[own.problem.n :][own.problem.layout.rows_of_level(0)].any() for own, _ in pairs)


def test_planted_lie_a_tick_after_a_damped_one_with_another_period(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice the Δt is half as much damping again, or more."""

    def longer(*arguments: tuple[Array, ...]) -> tuple[int, int]:
        dt, *others = arguments[4]
        return damp_again(*arguments[:4], (2.0 * dt, *others), *arguments[5:])  # type: ignore[arg-type]

    monkeypatch.setattr("taskopt.loop.rest.damp_again", longer)
    control, q = Controller(panda(), hand_stack(STRETCHED), dt=DT), panda().posture("default")
    assert apart(steps_beside(control, q, monkeypatch, 160)) > 1e-3


def test_only_joints_that_move_the_task_are_damped() -> None:
    """The task is that of the second of four links, which are straight, and cannot reach its target."""
    robot = planar_arm([1.0, 1.0, 1.0, 1.0])
    reach = PositionTask("link2", target=[3.0, 0.0, 0.0], gain=5.0)
    control = Controller(robot, Stack([[reach]], [JointVelocityLimit(1.0)], damping=RestDamping()), dt=DT)
    answer = control.step(np.zeros(4), 0.0)
    assert answer.undamped is not None
    rows = [block.rows for block in answer.problem.layout.blocks if block.name.startswith("rest of")]
    np.testing.assert_array_equal(answer.problem.A[rows[0]][:, 2:], 0.0)
    assert np.abs(answer.problem.A[rows[0]]).max() > 0.0


@pytest.mark.slow
def test_neither_gain_nor_period_matters() -> None:
    """Ten times the gain, and a tenth of the period."""
    found, _ = steps(STRETCHED, gain=50.0, dt=0.001)
    assert last_jump(found, 500) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_an_arm_rests_at_random_poses_in_and_out_of_reach(seed: int) -> None:
    """Position and orientation, some behind limits, some far away."""
    rng = np.random.default_rng(seed)
    target = np.array([*rng.uniform(-1.2, 1.2, 2), rng.uniform(-0.2, 1.4)])
    hand = FrameTask("panda_hand", target=target, gain=5.0)
    limits = [JointPositionLimit(), JointVelocityLimit()]
    stack = Stack([[hand], [JointTask()]], limits, damping=RestDamping())
    control, q, found = Controller(panda(), stack, dt=DT), panda().posture("default"), []
    for k in range(1000):
        found.append(control.step(q, k * DT))
        q = panda().integrate(q, found[-1].v, DT)
    assert last_jump(tuple(found), 100) < 1e-3


# --- The formulas -----------------------------------------------------------------------------------------


def by_definition(A: np.ndarray, b: np.ndarray, dt: float, threshold: float) -> float:
    """ε² of what damping ε in all directions leaves, by least squares; R is the largest column."""
    stacked = np.vstack([A, np.sqrt(threshold) * np.eye(A.shape[1])])
    x = lsq_linear(stacked, np.r_[b, np.zeros(A.shape[1])]).x
    return dt * float(np.linalg.norm(A, axis=0).max() * np.linalg.norm(b - A @ x))


def found_directions(A: Array, b: Array, free: Array, dt: float = DT) -> tuple[float, float, Array]:
    """ε², the gate, and the rows of damping of a level whose rows are of one group."""
    rows = np.full((len(A), A.shape[1]), np.nan)
    group = np.ones(len(A), dtype=np.int64)
    threshold, gate, count = damped_directions(A, parts_of(A, free), b, group, free, 0, dt, rows)
    return threshold, gate, rows[:count]


@pytest.mark.parametrize("seed", range(8))
def test_the_threshold_is_that_of_the_residual_it_leaves(seed: int) -> None:
    """ε² = Δt R ‖b − A x‖ at the least squares x with ε I, and the damped rows have singular values of ε."""
    rng = np.random.default_rng(seed)
    U, _, Vt = np.linalg.svd(rng.standard_normal((3, 6)), full_matrices=False)
    A, b = U @ np.diag([1.0, 0.5, 10.0 ** -rng.uniform(2.0, 4.0)]) @ Vt, rng.standard_normal(3)
    threshold, gate, damped = found_directions(A, b, np.eye(6))
    assert threshold > 0.0
    assert 0.0 < gate <= 1.0
    assert threshold == pytest.approx(by_definition(A, b, DT, threshold), rel=5e-3)
    together = np.linalg.svd(np.vstack([A, damped]), compute_uv=False)[:3]
    assert together.min() == pytest.approx(np.sqrt(threshold), rel=1e-6)


def test_damping_begins_with_nothing_where_undamped_steps_begin_to_overshoot() -> None:
    """Where half of Δt R |uᵀb| is σ²; the jump of a damping that begins later would be thrown at the arm."""
    b = np.array([0.0, 0.0, 1.0])
    least = np.sqrt(0.5 * DT)  # R = 1
    for ratio, part in ((1.001, 0.0), (0.999, 0.001), (0.9, 0.1), (0.5, 0.5), (1e-6, 1.0)):
        A = np.eye(3, 4) * np.array([1.0, 1.0, np.sqrt(ratio) * least, 0.0])
        _, _, damped = found_directions(A, b, np.eye(4))
        assert float((damped**2).sum()) == pytest.approx(DT * part, rel=5e-3, abs=3e-3 * DT)


def test_what_can_be_met_is_not_damped() -> None:
    """Nor where nothing is curved or free; but a step that a weak direction makes too long is."""
    rng = np.random.default_rng(0)
    A = rng.standard_normal((3, 6))
    assert found_directions(A, A @ rng.standard_normal(6), np.eye(6), 1e-3)[0] == 0.0
    assert found_directions(A, np.ones(3), np.zeros((0, 6)))[0] == 0.0
    straight, rows = np.zeros(3, dtype=np.int64), np.zeros((3, 6))
    column = A[:, :1], parts_of(A[:, :1], np.eye(1)), np.ones(3)
    assert damped_directions(*column, straight, np.eye(1), 0, DT, rows[:, :1])[0] == 0.0
    assert damped_directions(*column, straight + 1, np.eye(1), 0, 1e3, rows[:, :1])[0] > 0.0
    nearly = np.array([[1.0, 0.0, 0.0], [1.0, 1e-4, 0.0]])
    assert found_directions(nearly, np.array([1.0, -1.0]), np.eye(3))[0] > 1e-3


def test_directions_that_levels_before_have_are_no_loss_of_rank() -> None:
    """Of two rows one is lost, and it is damped unless it was taken."""
    A, group = np.array([[1.0, 0.0], [0.0, 0.0]]), np.ones(2, dtype=np.int64)
    rows = np.zeros((2, 2))
    for taken, count in ((0, 1), (1, 0)):
        level = A, parts_of(A, np.eye(2)), np.ones(2)
        assert damped_directions(*level, group, np.eye(2), taken, DT, rows)[2] == count


@pytest.mark.parametrize("seed", range(40))
def test_singular_values_are_those_of_lapack(seed: int) -> None:
    """Of matrices of any size, with rows that depend on others or are 0; in order, and with all vectors."""
    rng = np.random.default_rng(seed)
    m, p = (int(size) for size in rng.integers(1, 12 if seed % 4 else 24, 2))
    M = rng.standard_normal((m, p)) * 10.0 ** rng.uniform(-6.0, 6.0)
    if m > 2:
        M[1] = M[0] + 10.0 ** -rng.uniform(1.0, 18.0) * M[2]
        M[2] *= seed % 3 > 0
    if p > 2:
        M[:, 1] *= seed % 5 > 0
    U, sigma, Vt = singular_values(M)
    expected, count = np.linalg.svd(M, compute_uv=False), min(m, p)
    np.testing.assert_allclose(sigma, expected, rtol=0.0, atol=1e-13 * expected[0])
    np.testing.assert_allclose(Vt @ Vt.T, np.eye(p), atol=1e-13)
    np.testing.assert_allclose((U[:, :count] * sigma) @ Vt[:count], M, atol=1e-13 * expected[0])


@pytest.mark.parametrize("seed", range(20))
def test_the_null_space_is_that_of_singular_values(seed: int) -> None:
    """Rows of any size, some that depend on others; the basis stays within the columns."""
    rng = np.random.default_rng(seed)
    m, n = int(rng.integers(0, 9)), int(rng.integers(1, 9))
    rows = rng.standard_normal((m + 2, n)) * 10.0 ** rng.uniform(-6.0, 6.0, (m + 2, 1))
    if m > 2:
        rows[m - 1] = rows[0] + 3.0 * rows[1]
        rows[1] = 0.0 if seed % 2 else rows[1]
    columns = rng.random(n) < 0.8
    basis = null_space(rows, m, columns)
    length = np.linalg.norm(rows[:m], axis=1, keepdims=True)
    unit = (rows[:m] / np.where(length > 0.0, length, 1.0))[:, columns]
    rank = int((np.linalg.svd(unit, compute_uv=False) > 1e-9).sum()) if unit.size else 0
    assert basis.shape == (columns.sum() - rank, n)
    np.testing.assert_allclose(basis @ basis.T, np.eye(len(basis)), atol=1e-12)
    np.testing.assert_allclose(basis[:, columns] @ unit.T, 0.0, atol=1e-9)
    np.testing.assert_array_equal(basis[:, ~columns], 0.0)


def doubt(rows: np.ndarray, b: np.ndarray, x: np.ndarray, watch: np.ndarray | None = None) -> bool:
    h = Hierarchy([Level(rows, b)])
    if watch is None:
        watch = new_watch(h.n, np.ones(len(b), dtype=np.int64))
        watch[:2] = DT
    base = np.r_[np.full(h.n, -np.inf), np.full(h.n, np.inf)]
    state, layout = np.zeros(h.layout.width, dtype=np.int8), h.layout
    return rank_in_doubt(h.buffer, h.norm.copy(), layout.offsets, layout.columns, x, state, base, watch)


@pytest.mark.parametrize("seed", range(30))
def test_no_level_that_would_be_damped_passes_the_quick_test(seed: int) -> None:
    """Also with what it keeps of a factorisation of other rows; and some levels do pass."""
    rng = np.random.default_rng(seed)
    watch = new_watch(6, np.ones(3, dtype=np.int64))
    watch[:2] = DT
    for least in 10.0 ** -rng.uniform(-0.5, 4.0, 20):
        U, _, Vt = np.linalg.svd(rng.standard_normal((3, 6)), full_matrices=False)
        A, b = U @ np.diag([1.0, 0.5, least]) @ Vt, rng.standard_normal(3)
        x = np.linalg.lstsq(A, b, rcond=None)[0] if rng.random() < 0.5 else rng.standard_normal(6)
        damped = found_directions(A, b, np.eye(6))[0] > 0.0
        assert doubt(A, b, x, watch) or not damped
        assert doubt(A, b, x, watch) == doubt(A, b, x), "what is kept decides nothing"
    assert not doubt(np.eye(3, 6), np.ones(3), np.r_[np.ones(3), np.zeros(3)])


def test_planted_lie_damping_that_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """If the loop sends what was undamped, the arm shakes."""
    as_it_is: Callable[[Rest, Resolution], Resolution] = lambda _, undamped: undamped  # noqa: E731
    monkeypatch.setattr(Rest, "answer", as_it_is)
    control, q, found = Controller(panda(), hand_stack(STRETCHED), dt=DT), panda().posture("default"), []
    for k in range(200):
        found.append(control.step(q, k * DT))
        q = panda().integrate(q, found[-1].v, DT)
    assert last_jump(tuple(found)) > 1.0


SELF_TARGET = (-0.779, -0.556, -0.353, -2.206, -2.13, 0.957, 2.813)  # [rad]; its hand is then moved inwards
SELF_START = (-1.368, 0.35, 0.559, -2.749, -0.691, 1.017, -1.675)  # near the rest that follows


def self_controller(*, damped: bool = True) -> Controller:
    """Return a controller of an arm whose hand is asked into its base."""
    pose = Configuration(panda(), np.array(SELF_TARGET)).pose("panda_hand_tcp").copy()
    pose[:3, 3] *= 0.3
    hand = FrameTask("panda_hand_tcp", target=pose, gain=5.0)
    limits = [JointPositionLimit(), JointVelocityLimit(), SelfCollisionLimit()]
    stack = Stack([[hand], [JointTask()]], limits, damping=RestDamping() if damped else None)
    return Controller(panda(), stack, dt=DT)


def self_jump(*, damped: bool = True) -> float:
    """Return the largest last change of a velocity of that arm."""
    control, q, found = self_controller(damped=damped), np.array(SELF_START), []
    for k in range(80):
        found.append(control.step(q, k * DT))
        q = panda().integrate(q, found[-1].v, DT)
    return last_jump(found)


def test_an_arm_rests_at_its_limit_on_self_collision(monkeypatch: pytest.MonkeyPatch) -> None:
    """That limit narrows the speeds of joints, too, which holds none of them; taken to hold, all jump on."""
    assert self_jump() < 1e-3
    assert self_jump(damped=False) > 1.0
    monkeypatch.setattr(SpeedBounds, "of_speed", False)
    assert self_jump() > 1.0
