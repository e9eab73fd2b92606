"""A frame relative to another: the rows of Pinocchio's formula, both frames moving, and what stays still."""

import numpy as np
import pinocchio as pin
import pytest

from taskopt import (
    Configuration,
    Controller,
    FrameTask,
    InvalidValue,
    JointTask,
    JointVelocityLimit,
    Latest,
    PositionTask,
    RelativeFrameTask,
    Stack,
    UnknownName,
    resolve,
)
from taskopt.kinematics.task.relative import relative_error_into
from taskopt.testing import check_task
from tests.helpers.moving import bound, tumbling
from tests.helpers.robots import FRAMES, generic_q, robot

ROOTS = {
    "planar": "link1",
    "panda": "panda_link4",
    "tiago": "head_2_link",
    "talos_reduced": "gripper_right_base_link",
}


def relative_pose(at, frame, root):
    """The pose of a frame in another, by Pinocchio."""
    return (pin.SE3(at.pose(root)).inverse() * pin.SE3(at.pose(frame))).homogeneous


@pytest.mark.slow
@pytest.mark.parametrize("expressed", ["own", "root"])
@pytest.mark.parametrize("name", FRAMES)
def test_the_rows_keep_the_contract(name, expressed):
    """A is the derivative of e, with a target that tumbles in the root, on robots of four kinds."""
    of = robot(name)
    at = Configuration(of, of.posture("middle"))
    target = tumbling(relative_pose(at, FRAMES[name], ROOTS[name]), 1)
    for axes in ("xyzrpy", "xyz", "rpy"):
        task = RelativeFrameTask(
            FRAMES[name],
            root=ROOTS[name],
            target=target,
            gain=5.0,
            weight=2.0,
            axes=axes,
            expressed=expressed,
        )
        check_task(task, of, count=5)


def without_turning_of_the_root(root, frame, of_root, of_frame):
    """The motion of the frame relative to the root, as if the root did not turn."""
    of_frame -= of_root
    of_frame[:3], of_frame[3:] = root[:3, :3].T @ of_frame[:3], root[:3, :3].T @ of_frame[3:]


def without(what):
    """Error, M and rate of the task, without the derivative of the logarithm or the lever of the rate."""

    def wrong(own, frame, goal, twist, arrays):
        relative_error_into(own, frame, goal, twist, arrays)
        if what == "lever":
            arrays.rate[:] = arrays.M @ twist
        else:
            arrays.M[:3, :3] = arrays.M[3:, 3:] = arrays.pose[:3, :3].T
            arrays.M[:3, 3:] = 0.0

    return wrong


@pytest.mark.parametrize(
    ("where", "fault"),
    [
        ("relative_motion_into", without_turning_of_the_root),
        ("relative_error_into", without("lever")),
        ("relative_error_into", without("derivative")),
    ],
)
def test_a_wrong_derivative_is_caught(monkeypatch, where, fault):
    """The check above fails without the turning of the root, the lever of the rate, or Jlog6."""
    of = robot("panda")
    at = Configuration(of, of.posture("middle"))
    target = tumbling(relative_pose(at, "panda_hand", "panda_link4"), 1)
    monkeypatch.setattr(f"taskopt.kinematics.task.relative.{where}", fault)
    with pytest.raises(AssertionError, match="not the derivative"):
        check_task(RelativeFrameTask("panda_hand", root="panda_link4", target=target, gain=5.0), of, count=5)


@pytest.mark.parametrize("name", FRAMES)
def test_error_and_rows_are_those_of_the_formula(name):
    """e = −log6(X_d⁻¹ X) and A = Jlog6(X_d⁻¹ X) (J_f − Ad_X⁻¹ J_r), written with Pinocchio's functions."""
    of, frame, root = robot(name), FRAMES[name], ROOTS[name]
    at = Configuration(of, generic_q(of, 2))
    goal = pin.SE3(relative_pose(at, frame, root)) * pin.exp6(np.array([0.1, -0.2, 0.3, 0.5, -0.4, 0.2]))
    _, rows = bound(RelativeFrameTask(frame, root=root, target=goal, gain=3.0), at)
    pose = pin.SE3(relative_pose(at, frame, root))
    away = goal.actInv(pose)
    J = at.jacobian(frame, "own") - pose.actionInverse @ at.jacobian(root, "own")
    np.testing.assert_allclose(rows.A, pin.Jlog6(away) @ J, atol=1e-12)
    np.testing.assert_allclose(rows.lower, -3.0 * pin.log6(away).vector, atol=1e-12)


def test_joints_that_carry_both_frames_do_not_count():
    """The floating base and the torso of a humanoid move no hand relative to the other."""
    of = robot("talos_reduced")
    at = Configuration(of, generic_q(of, 0))
    _, rows = bound(RelativeFrameTask(FRAMES["talos_reduced"], root=ROOTS["talos_reduced"]), at)
    both = np.intersect1d(of.support(FRAMES["talos_reduced"]), of.support(ROOTS["talos_reduced"]))
    assert both.size >= 8
    np.testing.assert_allclose(rows.A[:, both], 0.0, atol=1e-12)
    assert np.linalg.matrix_rank(rows.A) == 6


@pytest.mark.parametrize("expressed", ["own", "root"])
def test_with_the_world_as_root_it_is_the_task_of_the_frame(expressed):
    """A link that is fixed to the world as root: the rows are those of FrameTask."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 1))
    target = tumbling(at.pose("panda_hand"), 3)
    _, relative = bound(
        RelativeFrameTask("panda_hand", root="panda_link0", target=target, expressed=expressed), at, 0.2
    )
    _, plain = bound(
        FrameTask("panda_hand", target=target, expressed="own" if expressed == "own" else "world"), at, 0.2
    )
    np.testing.assert_allclose(relative.A, plain.A, atol=1e-13)
    np.testing.assert_allclose(relative.lower, plain.lower, atol=1e-13)


@pytest.mark.parametrize("name", ["panda", "talos_reduced"])
def test_the_closed_form_and_the_model_in_cvxpy_agree(name):
    """Without limits the answer is that of task priority; with a limit that binds, that of CVXPY."""
    of = robot(name)
    at = Configuration(of, generic_q(of, 4))
    goal = relative_pose(at, FRAMES[name], ROOTS[name]) @ pin.exp6(np.full(6, 0.1)).homogeneous
    task = RelativeFrameTask(FRAMES[name], root=ROOTS[name], target=goal, gain=5.0, axes="xyz")
    free = Stack([[task], [JointTask(of.posture("middle"))]]).at(at, dt=1e-2)
    formula, ours = resolve(free, "pinv").x, resolve(free, "active-set").x
    np.testing.assert_allclose(ours, formula, atol=1e-9)
    slow = JointVelocityLimit(velocity=0.5 * float(np.abs(formula).max()))
    tight = Stack([[task], [JointTask(of.posture("middle"))]], [slow]).at(at, dt=1e-2)
    ours, told = resolve(tight, "active-set"), resolve(tight, "cvxpy/clarabel")
    assert ours.active
    np.testing.assert_allclose(ours.x, told.x, atol=1e-7)


def test_two_hands_hold_a_part_while_one_of_them_moves():
    """Below a task that leads one hand 10 cm away, the other keeps its place relative to it, to 1e-6."""
    of, dt = robot("talos_reduced"), 5e-3
    left, right = FRAMES["talos_reduced"], ROOTS["talos_reduced"]
    q = of.posture("default").copy() if "default" in of.postures else of.posture("middle").copy()
    start = Configuration(of, q)
    lead = PositionTask(left, target=start.pose(left)[:3, 3] + [0.0, 0.0, 0.1], gain=5.0)
    hold = RelativeFrameTask(right, root=left, gain=20.0)
    control = Controller(of, Stack([[lead], [hold], [JointTask()]]), dt=dt)
    for k in range(200):
        q = of.integrate(q, control.step(q, k * dt).v, dt)
    after = Configuration(of, q)
    assert np.linalg.norm(after.pose(left)[:3, 3] - start.pose(left)[:3, 3]) > 0.09
    np.testing.assert_allclose(
        relative_pose(after, right, left), relative_pose(start, right, left), atol=1e-5
    )
    task = control.plan.tasks[1]
    assert task.frame == right
    np.testing.assert_allclose(task.desired, task.actual, atol=1e-3)


def test_a_target_that_is_no_pose_is_named():
    """A pose with NaN, or a sheared one, from a sensor stops the tick with the name of the task."""
    of = robot("panda")
    latest = Latest()
    task = RelativeFrameTask("panda_hand", root="panda_link4", target=latest, name="wrist")
    plan = Stack([[task]]).compile(of, 1e-3)
    q = of.posture("default")
    for bad in (np.full((4, 4), np.nan), np.diag([1.0, 2.0, 1.0, 1.0])):
        plan.start(q)
        latest.set(bad)
        with pytest.raises(InvalidValue, match="target of 'wrist'"):
            plan.at(q, 0.0)


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: RelativeFrameTask("tip", root="tip"), InvalidValue, "two frames, got 'tip' twice"),
        (lambda: RelativeFrameTask("a", root="b", expressed="world"), InvalidValue, "'own' or 'root'"),
        (
            lambda: RelativeFrameTask("a", root="b", weight=(1.0, 0.0), axes="rpy"),
            InvalidValue,
            "weight is 0",
        ),
        (lambda: RelativeFrameTask("tip", root="b").bind(robot("planar"), "t"), UnknownName, "'b'"),
    ],
)
def test_what_makes_no_sense_is_refused(make, error, words):
    """One frame twice, axes of nothing, no row left, a frame that is not there."""
    with pytest.raises(error, match=words):
        make()
