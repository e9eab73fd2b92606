"""Rest at second order: still targets that cannot be met, and second derivatives of tasks."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize

from taskopt import (
    Configuration,
    Controller,
    FrameTask,
    JointAccelerationLimit,
    JointTask,
    PositionTask,
    RestDamping,
    Stack,
    planar_arm,
)
from taskopt.hierarchy.rest_bend import bent_directions
from taskopt.kinematics.bending import Bending
from taskopt.kinematics.pose import log6
from tests.helpers.robots import robot

H, GAIN = 5e-3, 6.0
ARM = planar_arm(lengths=(0.5, 0.5, 0.5))
START = np.array([0.4, 0.5, -0.3])
FAR = np.array([1.6, 1.2, 0.0])  # [m] 0.5 m out of the reach of 1.5 m


def far_stack(*, damped: bool = True, gain: float = GAIN) -> Stack:
    tip = PositionTask("tip", target=FAR, gain=gain, axes="xy")
    damping = RestDamping() if damped else None
    return Stack([[tip], [JointTask(gain=3.0)]], [JointAccelerationLimit(20.0)], order=2, damping=damping)


@cache
def path(*, damped: bool) -> tuple[np.ndarray, np.ndarray, Controller]:
    """Postures and velocities of 8 s towards a target out of reach."""
    control, q, found = Controller(ARM, far_stack(damped=damped), dt=H), START, []
    control.start(q)
    for k in range(round(8.0 / H)):
        control.step(q, k * H)
        found.append(control.after())
        q = found[-1][0]
    return np.array([one for one, _ in found]), np.array([v for _, v in found]), control


@pytest.mark.slow
def test_an_arm_rests_stretched_towards_a_target_out_of_reach():
    """Straight towards the target is the best; without damping the arm swings at its limits for ever."""
    postures, velocities, control = path(damped=True)
    assert np.abs(velocities[-1]).max() < 1e-6
    assert np.abs(postures[-1] - [np.arctan2(1.2, 1.6), 0.0, 0.0]).max() < 1e-6
    assert control.damped_ticks > 100
    assert np.abs(path(damped=False)[1][-200:]).max() > 0.1


@pytest.mark.equation("3.103")
def test_the_last_way_to_rest_is_about_as_quick_as_the_gain_says():
    """What remains dies out nearly as exp(−K t), the double pole of (3.103), although σ = 0."""
    off = np.abs(path(damped=True)[0][:, 1])
    first, last = np.flatnonzero(off > 1e-4)[-1], np.flatnonzero(off > 1e-8)[-1]
    rate = np.log(off[first] / off[last]) / (H * (last - first))
    assert 0.7 * GAIN < rate < 1.3 * GAIN


def test_rows_of_damping_have_names_and_answers_are_proven():
    """The hierarchy that was answered says what damps it: both ways to bend the arm."""
    _, _, control = path(damped=True)
    q, _ = control.after()
    resolution = control.step(q, 8.0)
    names = [block.name for block in resolution.problem.layout.blocks]
    assert "rest of level 1" in names
    rows = resolution.problem.A[resolution.problem.layout.blocks[names.index("rest of level 1")].rows]
    damped = rows[np.linalg.norm(rows, axis=1) > 0.0]
    assert np.linalg.matrix_rank(damped) == 2
    assert resolution.proven
    assert resolution.undamped is not None
    assert "rest of level 1" not in [block.name for block in resolution.undamped.problem.layout.blocks]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_panda_rests_at_the_nearest_pose_that_its_limits_allow(seed):
    """The error at rest is that of a local optimum within the limits, found by SciPy from there."""
    arm, rng = robot("panda"), np.random.default_rng(seed)
    lower, upper = arm.position_lower, arm.position_upper
    beyond = 0.2 * (upper - lower)
    pose = Configuration(arm, rng.uniform(lower - beyond, upper + beyond)).pose("panda_hand").copy()
    q = rng.uniform(lower + 0.1, upper - 0.1)
    levels = [[FrameTask("panda_hand", target=pose, gain=8.0)], [JointTask(gain=4.0)]]
    stack = Stack(levels, [JointAccelerationLimit(10.0)], order=2, damping=RestDamping())
    control = Controller(arm, stack, dt=0.01)
    control.start(q)
    for k in range(1000):
        control.step(q, 0.01 * k)
        q, v = control.after()
    assert np.abs(v).max() < 1e-6

    def cost(q):
        return 0.5 * np.sum(log6(np.linalg.inv(Configuration(arm, q).pose("panda_hand")) @ pose) ** 2)

    inside = np.clip(q, lower, upper)
    best = minimize(cost, inside, bounds=list(zip(lower, upper, strict=True)), method="L-BFGS-B")
    assert cost(inside) < best.fun + 1e-6


@pytest.mark.parametrize(
    "task",
    [
        FrameTask("panda_hand", target=(0.4, 0.2, 0.5)),
        FrameTask("panda_hand", target=(0.4, 0.2, 0.5), expressed="world"),
        PositionTask("panda_hand", target=(0.4, 0.2, 0.5), axes="xz"),
    ],
)
def test_second_derivatives_are_those_of_the_error(task):
    """f″(v, v) is minus the second difference of the error along a motion with the velocity v."""
    arm, rng = robot("panda"), np.random.default_rng(3)
    plan = Stack([[task]], order=2).compile(arm, 1e-3)
    q, v, step = rng.uniform(-1.0, 1.0, arm.nv), rng.standard_normal(arm.nv), 1e-4
    q = np.clip(q, arm.position_lower + 0.1, arm.position_upper - 0.1)
    plan.start(q)
    plan.moved(rng.standard_normal(arm.nv))
    errors = []
    for s in (step, -step, 0.0):
        plan.at(arm.integrate(q, v, s), 0.0)
        errors.append(plan.tasks[0].error.copy())
    expected = -(errors[0] + errors[1] - 2.0 * errors[2]) / step**2
    rows = slice(0, len(expected))
    found = Bending(plan).along(v)
    assert np.abs(found[rows] - expected).max() < 1e-5
    assert np.abs(found[rows]).max() > 0.1
    assert not found[rows.stop :].any()


def test_damping_is_the_second_derivative_of_the_cost_where_the_rank_is_lost():
    """With σ = 0, rows of damping add |rᵀ f″| to AᵀA, as a matrix."""
    f2 = np.array([[3.0, 1.0], [1.0, -2.0]])  # of the only row, which asks for 1
    A, b, groups = np.zeros((2, 2)), np.array([4.0, 0.0]), [np.array([0, 1])]
    A[1] = 1e-9, 0.0  # so that there is a lever arm
    periods = np.full(2, 0.25)
    found = bent_directions(
        1e9 * A, 0.0 * b, groups, np.eye(2), periods, lambda v: np.array([v @ f2 @ v, 0.0])
    )
    assert found[0] == 0.0
    A, b = np.diag([1e-3, 1e-3]), np.array([4000.0, 0.0])
    periods = np.full(2, 0.25e-3)
    _, rows = bent_directions(A, b, groups, np.eye(2), periods, lambda v: np.array([v @ f2 @ v, 0.0]))
    values, vectors = np.linalg.eigh(f2)
    assert np.allclose(rows.T @ rows, vectors @ np.diag(np.abs(values)) @ vectors.T, rtol=1e-2, atol=1e-2)
