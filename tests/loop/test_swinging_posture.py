"""A posture below a target at full stretch comes to rest, although its null space turns quickly there."""

import numpy as np
import pytest

from taskopt import (
    Configuration,
    Controller,
    Hierarchy,
    JointTask,
    JointVelocityLimit,
    Level,
    PositionTask,
    Stack,
)
from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.rank_doubt import new_watch, rank_in_doubt
from taskopt.hierarchy.rest import parts_of, swing_below
from taskopt.hierarchy.tolerances import NEAR_LOSS
from taskopt.kinematics.robot import planar_arm

DT, GAIN = 0.01, 5.0  # [s], [1/s]


def run(seed: int, *, damped: bool = True, seconds: float = 8.0) -> tuple[float, float, int]:
    """Hold a point at full stretch, or almost, with a posture below that wants to bend the arm.

    Returns the largest change of a velocity in the last second, the error at the end, and the damped ticks.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 6))
    arm = planar_arm(list(rng.uniform(0.2, 0.6, n)), velocity=2.0)
    goal = rng.normal(size=n) * 10.0 ** rng.uniform(-6.0, -2.0) * (seed % 2)
    goal[0] = rng.uniform(-3.0, 3.0)
    point = Configuration(arm, goal).pose("tip")[:3, 3].copy()
    hand = PositionTask("tip", target=point, gain=GAIN, axes="xy")
    levels = [[hand], [JointTask(target=rng.uniform(-1.0, 1.0, n))]]
    declared = {} if damped else {"damping": None}
    control = Controller(arm, Stack(levels, [JointVelocityLimit()], **declared), dt=DT)
    q, v, jumps = rng.uniform(-1.5, 1.5, n), np.zeros(n), []
    for k in range(round(seconds / DT)):
        now = control.step(q, k * DT).v.copy()
        jumps.append(float(np.abs(now - v).max()))
        q, v = q + DT * now, now
    error = float(np.linalg.norm(Configuration(arm, q).pose("tip")[:2, 3] - point[:2]))
    return max(jumps[-round(1.0 / DT) :]), error, control.damped_ticks


@pytest.mark.parametrize("seed", [26, 27])
def test_a_posture_below_a_target_at_full_stretch_comes_to_rest(seed: int) -> None:
    """Every level is met, and undamped answers, each of them optimal, throw the arm back and forth."""
    jump, error, ticks = run(seed)
    assert jump < 1e-3
    assert error < 1e-4
    assert ticks > 0
    assert run(seed, damped=False)[0] > 0.1


def test_a_posture_is_slowed_down_beside_full_stretch_only() -> None:
    """One tick at a target that is met: beside full stretch the posture is damped, elsewhere it is not."""
    arm = planar_arm([0.5, 0.4, 0.3])
    for bend, damped in ((1e-4, True), (1.0, False)):
        q = np.array([0.3, bend, -0.5 * bend])
        hand = PositionTask("tip", target=Configuration(arm, q).pose("tip")[:3, 3].copy(), axes="xy")
        tick = Controller(arm, Stack([[hand], [JointTask(target=np.ones(3))]]), dt=DT).step(q, 0.0)
        assert tick.is_damped == damped
        if damped:
            assert tick.undamped is not None
            assert np.abs(tick.v).max() < 0.1 * np.abs(tick.undamped.v).max()


def test_nothing_is_written_below_the_last_level() -> None:
    """A blocked level without one below it is damped by its own rows; the others of the hierarchy stay."""
    arm = planar_arm([0.5, 0.4, 0.3])
    hand = PositionTask("tip", target=(1.5, 0.4, 0.0), gain=GAIN, axes="xy")
    tick = Controller(arm, Stack([[hand]]), dt=DT).step([0.3, 0.01, -0.01], 0.0)
    assert tick.is_damped
    assert [block.name for block in tick.problem.layout.blocks if "level" in block.name] == [
        "rest of level 1"
    ]
    assert tick.undamped is not None
    rows = tick.undamped.problem.A
    np.testing.assert_array_equal(tick.problem.A[: len(rows)], rows)


@pytest.mark.slow
def test_random_arms_at_full_stretch_come_to_rest() -> None:
    """All of 12 arms of three to five joints, at full stretch and beside it."""
    found = [run(seed, seconds=10.0) for seed in range(12)]
    assert max(jump for jump, *_ in found) < 1e-3
    assert max(error for _, error, _ in found) < 1e-4


def of_rank(rng: np.random.Generator, least: float) -> Array:
    """Three rows of six unknowns with the singular values 1, 0.5 and a given one."""
    U, _, Vt = np.linalg.svd(rng.standard_normal((3, 6)), full_matrices=False)
    return U @ np.diag([1.0, 0.5, least]) @ Vt


def swing(A: Array, group: IntArray, pull: Array) -> float:
    """The bound for rows of six unknowns that are all free."""
    return swing_below(A, parts_of(A, np.eye(6)), group, np.eye(6), pull, 0.0, DT)


@pytest.mark.parametrize("seed", range(8))
def test_the_bound_is_that_of_the_multipliers_of_the_weak_direction(seed: int) -> None:
    """Δt R ‖λ‖ with Aᵀ λ = p, where p lies along the weak direction; nothing where no direction is weak."""
    rng = np.random.default_rng(seed)
    least = 10.0 ** -rng.uniform(3.0, 6.0)
    A, group = of_rank(rng, least), np.ones(3, dtype=np.int64)
    pull = np.linalg.svd(A)[2][2] * rng.uniform(0.5, 2.0)
    prices = np.linalg.lstsq(A.T, pull, rcond=None)[0]
    lever = np.linalg.norm(A, axis=0).max()
    wanted = DT * lever * np.linalg.norm(prices) * (1.0 - (least / (NEAR_LOSS * lever)) ** 2)
    assert swing(A, group, pull) == pytest.approx(wanted, rel=1e-6)
    assert swing(A, 0 * group, pull) == 0.0
    assert swing(of_rank(rng, 0.4), group, pull) == 0.0


def in_doubt(A: Array, posture: Array, x: Array, dt: float) -> bool:
    """The quick test for rows A above a posture, with no Δt for damping of their own."""
    h = Hierarchy([Level(A, A @ x), Level(np.eye(6), posture)])
    watch = new_watch(6, np.r_[np.ones(3, dtype=np.int64), np.zeros(6, dtype=np.int64)])
    watch[1] = dt
    base, layout = np.r_[np.full(6, -np.inf), np.full(6, np.inf)], h.layout
    state = np.zeros(layout.width, dtype=np.int8)
    return rank_in_doubt(h.buffer, h.norm.copy(), layout.offsets, layout.columns, x, state, base, watch)


@pytest.mark.parametrize("seed", range(10))
def test_no_posture_that_would_be_damped_passes_the_quick_test(seed: int) -> None:
    """Where the bound exceeds the weight of the posture, the test says so; and some stacks pass."""
    rng, passed = np.random.default_rng(seed), 0
    for least in 10.0 ** -rng.uniform(0.0, 4.0, 40):
        A, group = of_rank(rng, least), np.ones(3, dtype=np.int64)
        x, posture = rng.standard_normal((2, 6))
        damped = swing(A, group, x - posture) > 1.0
        doubt = in_doubt(A, posture, x, DT)
        assert doubt or not damped
        assert not in_doubt(A, posture, x, 0.0)
        passed += not doubt
    assert passed > 0
