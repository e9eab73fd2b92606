"""A batch: the velocities of `Controller` for many arms at once, proven, and nothing else."""

import numpy as np
import pytest

from taskopt import (
    BatchController,
    CentreOfMassTask,
    Circle,
    Configuration,
    Controller,
    DampingTask,
    FrameTask,
    InvalidValue,
    JointAccelerationLimit,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Latest,
    OrientationTask,
    PositionTask,
    RestDamping,
    Robot,
    Stack,
    UnknownName,
    frame_poses,
    planar_arm,
    stanford_manipulator,
)
from taskopt.arrays import Array
from taskopt.kinematics.task import Task
from tests.helpers.robots import robot

DT = 0.002
HAND = "panda_hand_tcp"
ARM = planar_arm([0.5] * 3, lower=-2.0, upper=2.0, velocity=2.0)
LIMITS = (JointPositionLimit(gain=0.5), JointVelocityLimit())


def postures(of: Robot, count: int, spread: float = 0.25, seed: int = 1) -> Array:
    """Postures around one that bends all joints."""
    lower = np.maximum(of.position_lower, -2.0)
    middle = 0.5 * (lower + np.minimum(of.position_upper, 2.0)) + 0.1
    return middle + np.random.default_rng(seed).uniform(-spread, spread, (count, of.nq))


def by_controller(of: Robot, stack: Stack, q: Array, starts: Array) -> Array:
    """The velocities of one `Controller` for each arm, whose targets began at its own start."""
    found = []
    for posture, start in zip(q, starts, strict=True):
        control = Controller(of, stack, dt=DT)
        control.start(start)
        found.append(control.step(posture, 0.0).v)
    return np.array(found)


STACKS: dict[str, list[list[Task]]] = {
    "strict": [[FrameTask(HAND, gain=50.0)], [JointTask(gain=20.0, weight=1e-6)]],
    "weighted": [[FrameTask(HAND, gain=50.0), JointTask(gain=20.0, weight=1e-3), DampingTask(weight=1e-9)]],
    "three levels": [
        [PositionTask(HAND, gain=50.0, weight=(1.0, 2.0, 3.0))],
        [OrientationTask(HAND, gain=20.0, axes="r")],
        [JointTask(gain=5.0)],
    ],
    "own axes": [[PositionTask(HAND, gain=50.0, expressed="own", axes="xz")], [DampingTask()]],
    "world axes": [[FrameTask(HAND, gain=50.0, expressed="world")], [JointTask()]],
    "no posture": [[PositionTask(HAND, gain=50.0)]],
    "a joint first": [[JointTask({"panda_joint1": 0.3}, joints=["panda_joint1"])], [JointTask(gain=9.0)]],
}


@pytest.mark.parametrize("name", STACKS)
def test_velocities_are_those_of_the_controller(name: str) -> None:
    """To 1e-11, for arms that are away from where their targets began, and all of them are proven."""
    of, stack = robot("panda"), Stack(STACKS[name], LIMITS)
    starts = postures(of, 9)
    q = starts + np.random.default_rng(2).uniform(-0.01, 0.01, starts.shape)
    batch = BatchController(of, stack, DT)
    batch.start(starts)
    step = batch.step(q)
    np.testing.assert_allclose(step.v, by_controller(of, stack, q, starts), rtol=0.0, atol=1e-11)
    assert step.proven.all()
    assert step.error_bound.max() <= 1e-8 * max(1.0, np.abs(step.v).max())
    assert step.solved.all()


def test_arms_on_bounds_have_the_velocities_and_bounds_of_the_controller() -> None:
    """With tight limits and a posture that pulls, some arms stand on bounds; hands are still followed."""
    of = robot("panda")
    stack = Stack(
        [[FrameTask(HAND, gain=5.0)], [JointTask(gain=400.0)]], [LIMITS[0], JointVelocityLimit(0.3)]
    )
    starts = postures(of, 40)
    q = starts + np.random.default_rng(2).uniform(-0.01, 0.01, starts.shape)
    batch = BatchController(of, stack, DT)
    batch.start(starts)
    step = batch.step(q)
    assert np.count_nonzero(step.on_bound) > 5
    np.testing.assert_allclose(step.v, by_controller(of, stack, q, starts), rtol=0.0, atol=1e-11)
    at = np.where(step.active < 0, -0.3 * of.velocity_limit, 0.3 * of.velocity_limit)
    assert (step.v[step.active != 0] == at[step.active != 0]).all()
    assert (np.abs(step.v) <= 0.3 * of.velocity_limit).all()
    second = batch.step(q)  # from the working sets of the first step
    np.testing.assert_allclose(second.v, step.v, rtol=0.0, atol=1e-12)


def test_a_hand_that_cannot_follow_is_proven_too() -> None:
    """A target that jumps away: joints stand on their limits, and the first level decides."""
    of = robot("panda")
    stack = Stack([[FrameTask(HAND, gain=200.0)], [JointTask(gain=1.0)]], LIMITS, damping=None)
    q = postures(of, 10)
    batch = BatchController(of, stack, DT)
    batch.start(q)
    goals = frame_poses(of, HAND, q)
    goals[::2, 0, 3] += 0.5
    batch.set({f"{HAND}.target": goals})
    first, step = batch.step(q), batch.step(q)  # the second from the working sets of the first
    assert np.count_nonzero(step.proven[::2]) >= 3
    assert first.solved.all()
    np.testing.assert_allclose(first.v, step.v, rtol=0.0, atol=1e-11)
    for arm in range(0, 10, 2):
        hand = FrameTask(HAND, target=Latest(goals[arm]), gain=200.0)
        alone = Controller(of, Stack([[hand], stack.levels[1]], LIMITS, damping=None), dt=DT)
        alone.start(q[arm])
        np.testing.assert_allclose(step.v[arm], alone.step(q[arm], 0.0).v, rtol=0.0, atol=1e-11)


def test_arms_that_lock_step_cannot_prove_take_ticks_of_their_own() -> None:
    """A stretched arm, at a singularity: what `active-set` finds, with a certificate of its own."""
    stack = Stack([[PositionTask("tip", axes="xy", gain=5.0)], [JointTask()]])
    q = np.array([[0.3, 0.4, 0.5], [0.0, 0.0, 0.0], [0.6, 0.4, 0.5]])
    batch = BatchController(ARM, stack, DT)
    batch.start(q)
    goals = frame_poses(ARM, "tip", q)[:, :3, 3] + [0.0, 0.01, 0.0]
    batch.set({"tip position.target": goals})
    for _ in range(2):  # the second time with the memory of the first
        step = batch.step(q)
        assert step.proven.tolist() == [True, False, True]
        assert list(step.resolutions) == [1]
        assert np.isinf(step.error_bound[1]).all()
        assert step.resolutions[1].kkt_met()
        hand = PositionTask("tip", axes="xy", gain=5.0, target=Latest(goals[1]))
        alone = Controller(ARM, Stack([[hand], [JointTask()]]), dt=DT)
        alone.start(q[1])
        np.testing.assert_allclose(step.v[1], alone.step(q[1], 0.0).v, rtol=0.0, atol=1e-11)


def test_robots_with_prismatic_joints_and_oblique_axes() -> None:
    """Chains of other kinds than the Panda's: prismatic, planar, and of a tree."""
    tips = {
        "planar": planar_arm([0.4] * 5, lower=-2.0, upper=2.0, velocity=2.0),
        "stanford": stanford_manipulator(),
    }
    for name, of in tips.items():
        tip = of.frames[-1]
        axes = "xy" if name == "planar" else "xyz"
        stack = Stack([[PositionTask(tip, gain=50.0, axes=axes)], [JointTask()]])
        starts = postures(of, 5)
        q = starts + 0.01
        batch = BatchController(of, stack, DT)
        batch.start(starts)
        np.testing.assert_allclose(batch.step(q).v, by_controller(of, stack, q, starts), rtol=0.0, atol=1e-11)


def test_targets_of_each_arm_and_of_all() -> None:
    """Poses, positions and postures by arm; a `Latest` and declared values for all."""
    of, latest = robot("panda"), Latest((0.5, 0.1, 0.4))
    stack = Stack([[FrameTask(HAND, target=latest)], [JointTask({"panda_joint2": 0.2})]])
    q = postures(of, 3)
    batch = BatchController(of, stack, DT)
    batch.start(q)
    first = batch.step(q).v
    np.testing.assert_allclose(first, by_controller(of, stack, q, q), rtol=0.0, atol=1e-11)
    latest.set((0.5, 0.2, 0.4))
    second = batch.step(q).v
    assert np.abs(second - first).max() > 0.01
    points = np.tile([0.5, 0.1, 0.4], (3, 1))
    batch.set({f"{HAND}.target": points})
    np.testing.assert_allclose(batch.step(q).v, first, rtol=0.0, atol=1e-13)
    batch.set({"posture.target": q})
    assert np.abs(batch.step(q).v - first).max() > 1e-3


@pytest.mark.parametrize("threads", [2, None])
def test_threads_change_nothing(threads: int | None) -> None:
    """Bit by bit, also where a thread gets no arms, or a part of eight."""
    of, stack = robot("panda"), Stack(STACKS["strict"], LIMITS)
    for count in (1, 8, 21):
        q = postures(of, count)
        step, other = (BatchController(of, stack, DT, threads=k).step(q + 0.01) for k in (1, threads))
        np.testing.assert_array_equal(step.v, other.v)
        np.testing.assert_array_equal(step.error_bound, other.error_bound)


def test_a_step_is_not_changed_by_later_ones_and_integrates() -> None:
    """Answers are arrays of their own; `integrate` is what the robot does."""
    of, stack = robot("panda"), Stack(STACKS["strict"], LIMITS)
    q = postures(of, 4)
    batch = BatchController(of, stack, DT)
    batch.start(q)
    step = batch.step(q + 0.01)
    v, active = step.v.copy(), step.active.copy()
    after = batch.integrate(q, step.v)
    batch.step(q - 0.02)
    np.testing.assert_array_equal(step.v, v)
    np.testing.assert_array_equal(step.active, active)
    np.testing.assert_allclose(after[2], of.integrate(q[2], v[2], DT), atol=1e-15)
    assert "4 arms" in repr(step)


POSTURE: list[list[Task]] = [[JointTask()]]
POINT = PositionTask("tip", axes="xy")
ROUND = PositionTask("tip", target=Circle(radius=0.1, period=2.0), axes="xy")


@pytest.mark.parametrize(
    ("stack", "named"),
    [
        (Stack([[ROUND]]), "'tip position', a Circle"),
        (Stack([[POINT], *POSTURE], [JointAccelerationLimit(5.0)]), "a JointAccelerationLimit"),
        (Stack(POSTURE, norm=np.eye(3) + 0.1), "full matrix"),
        (Stack([[POINT], [JointTask(joints=["joint1"])]]), "joint2"),
    ],
)
def test_what_a_batch_does_not_know_is_refused_by_name(stack: Stack, named: str) -> None:
    """The message has the part's own name, or its class."""
    with pytest.raises(InvalidValue, match=named):
        BatchController(ARM, stack)


def test_robots_and_tasks_that_it_does_not_know_are_named() -> None:
    """A floating base, wheels, and a centre of mass."""
    talos = robot("talos_reduced")
    with pytest.raises(InvalidValue, match=r"root_joint of .* FreeFlyer"):
        BatchController(talos, Stack([[JointTask()]]))
    with pytest.raises(InvalidValue, match="'centre of mass', a CentreOfMassTask"):
        BatchController(robot("panda"), Stack([[CentreOfMassTask()], [JointTask()]]))


def test_bad_arguments_are_named() -> None:
    """Shapes, numbers and addresses; after an error nothing has changed."""
    of = robot("panda")
    batch = BatchController(of, Stack(STACKS["strict"], LIMITS), DT)
    q = postures(of, 3)
    with pytest.raises(InvalidValue, match="start"):
        batch.set({"posture.target": q})
    batch.start(q)
    before = batch.step(q).v
    wrong = np.tile(np.eye(4), (3, 1, 1))
    wrong[1, 0, 0] = 2.0
    with pytest.raises(InvalidValue, match="target of arm 1"):
        batch.set({f"{HAND}.target": wrong})
    with pytest.raises(InvalidValue, match=r"\(3, 4, 4\)"):
        batch.set({f"{HAND}.target": wrong[:2]})
    with pytest.raises(UnknownName, match="targets only"):
        batch.set({"posture.weight": q})
    with pytest.raises(InvalidValue, match="q has NaN"):
        batch.step(np.full((3, 7), np.nan))
    with pytest.raises(InvalidValue, match="3×7"):
        batch.step(q[:2])
    with pytest.raises(InvalidValue, match="threads"):
        BatchController(of, Stack(STACKS["strict"]), threads=0)
    with pytest.raises(InvalidValue, match="Stack"):
        BatchController(of, STACKS["strict"])  # type: ignore[arg-type]
    np.testing.assert_array_equal(batch.step(q).v, before)


def test_poses_are_those_of_a_configuration() -> None:
    """Also of a frame in the middle of a chain, and of one that nothing moves."""
    of = robot("panda")
    q = postures(of, 11)
    for frame in (HAND, "panda_link4", "panda_link0"):
        found = frame_poses(of, frame, q)
        expected = [Configuration(of, posture).pose(frame) for posture in q]
        np.testing.assert_allclose(found, expected, atol=1e-15)


DAMPED: dict[str, list[list[Task]]] = {
    "strict": [[FrameTask(HAND, gain=20.0, name="hand")], [JointTask(gain=5.0)]],
    "two frames": [
        [PositionTask(HAND, gain=20.0, weight=(1.0, 2.0, 5.0), name="hand")],
        [OrientationTask("panda_hand", gain=20.0)],
        [DampingTask()],
    ],
    "joints first": [
        [JointTask(joints=["panda_joint1"], gain=5.0)],
        [FrameTask(HAND, gain=20.0, name="hand")],
        [DampingTask()],
    ],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", DAMPED)
def test_arms_are_damped_as_one_by_one(name: str) -> None:
    """Goals in reach and out of reach: an arm is damped at the same steps, and has the same velocities."""
    panda, dt, count = robot("panda"), 0.02, 16
    stack = Stack(DAMPED[name], LIMITS, damping=RestDamping())
    q = postures(panda, count, spread=0.6, seed=5)
    batch = BatchController(panda, stack, dt)
    controllers = [Controller(panda, stack, dt=dt) for _ in q]
    goals = frame_poses(panda, HAND, q)
    goals[:, :3, 3] *= np.linspace(0.9, 1.8, count)[:, None]
    batch.start(q)
    batch.set({"hand.target": goals})
    for control, posture, goal in zip(controllers, q, goals, strict=True):
        control.start(posture)
        control.set({"hand.target": goal[:3, 3] if name == "two frames" else goal})
    damped, proven = 0, 0
    for k in range(60):
        step = batch.step(q)
        proven += np.count_nonzero(step.proven)
        for arm, control in enumerate(controllers):
            one, alone = control.step(q[arm], k * dt), step.resolutions.get(arm)
            assert (one.undamped is not None) == (alone is not None and alone.undamped is not None)
            damped += one.undamped is not None
            np.testing.assert_allclose(step.v[arm], one.v, atol=1e-7)
        q = batch.integrate(q, step.v)
    assert damped > 60
    assert proven > 60
