"""Jacobians and their derivatives against central differences, on robots of four kinds."""

import gc

import numpy as np
import pinocchio as pin
import pytest

from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics import pose
from taskopt.kinematics.configuration import Configuration
from tests.helpers.differences import STEP, derivative
from tests.helpers.robots import FRAMES, random_configuration, robot

CASES = [*FRAMES.items(), ("tiago", "wheel_right_link"), ("talos_reduced", "base_link")]


@pytest.mark.parametrize(("name", "frame"), CASES)
def test_the_jacobian_is_the_rate_of_the_pose(name, frame):
    """J e_k is [ṗ; ω] when velocity k is 1: columns against differences of the pose, on the manifold."""
    at = random_configuration(name, 1)
    arm, T = at.robot, at.pose(frame)
    for k, step in enumerate(np.eye(arm.nv) * STEP):
        ahead = Configuration(arm, arm.integrate(at.q, step, 1.0)).pose(frame)
        behind = Configuration(arm, arm.integrate(at.q, step, -1.0)).pose(frame)
        linear = (ahead[:3, 3] - behind[:3, 3]) / (2 * STEP)
        angular = pose.log3(ahead[:3, :3] @ behind[:3, :3].T) / (2 * STEP)
        np.testing.assert_allclose(at.jacobian(frame)[:, k], [*linear, *angular], rtol=0, atol=1e-9)
        own = np.concatenate([T[:3, :3].T @ linear, T[:3, :3].T @ angular])
        np.testing.assert_allclose(at.jacobian(frame, "own")[:, k], own, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("name", "frame"), CASES)
def test_the_hessian_is_the_derivative_of_the_jacobian(name, frame):
    """[:, j, k] is ∂J[:, j]/∂q_k; the transpose of the last two indices is not."""
    at = random_configuration(name, 2)
    numeric = derivative(lambda near: near.jacobian(frame), at)
    np.testing.assert_allclose(at.hessian(frame), numeric, rtol=0, atol=1e-9)
    if frame not in {"tip", "wheel_right_link"}:  # a planar arm's is symmetric, one joint's trivially so
        assert np.abs(at.hessian(frame).swapaxes(1, 2) - numeric).max() > 1e-2


@pytest.mark.parametrize(("name", "frame"), CASES)
def test_pose_jacobian_and_hessian_are_pinocchios(name, frame):
    """Our kernels, which start from joint Jacobians, agree with Pinocchio's frame functions."""
    at = random_configuration(name, 3)
    model, frame_id = at.robot.model, at.robot.frame_id(frame)
    data = model.createData()
    pin.computeJointJacobians(model, data, at.q)
    pin.computeJointKinematicHessians(model, data)
    pin.updateFramePlacements(model, data)
    aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    np.testing.assert_allclose(at.pose(frame), data.oMf[frame_id].homogeneous, rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        at.jacobian(frame), pin.getFrameJacobian(model, data, frame_id, aligned), rtol=0, atol=1e-14
    )
    raw = pin.getFrameKinematicHessian(model, data, frame_id, aligned)
    hessian = raw.ravel().reshape(raw.shape, order="F")  # it is filled in column-major order
    np.testing.assert_allclose(at.hessian(frame), hessian, rtol=0, atol=1e-13)


@pytest.mark.parametrize(("name", "frame"), FRAMES.items())
def test_views_follow_every_update(name, frame):
    """Arrays handed to kernels once are those of the posture moved to, without being asked for again."""
    at = random_configuration(name, 4)
    view, J = at.frame(frame), at.joint_jacobians
    moved = random_configuration(name, 5)
    before = J.copy()
    at.update(moved.q)
    np.testing.assert_array_equal(J, moved.joint_jacobians)
    np.testing.assert_array_equal(view.joint_rotation, moved.frame(frame).joint_rotation)
    np.testing.assert_array_equal(view.joint_translation, moved.frame(frame).joint_translation)
    assert np.abs(J - before).max() > 1e-2
    assert at.frame(frame) is view
    assert J.flags.f_contiguous


def test_a_view_outlives_its_configuration():
    """What a kernel holds stays valid when the configuration that gave it is gone."""
    view = random_configuration("panda", 6).frame("panda_hand")
    expected = random_configuration("panda", 6).frame("panda_hand").joint_rotation.copy()
    gc.collect()
    np.testing.assert_array_equal(view.joint_rotation, expected)


@pytest.mark.parametrize(("name", "frame"), CASES)
def test_columns_outside_the_support_do_not_move_the_frame(name, frame):
    """`columns` are exactly the joints between the root and the frame."""
    at = random_configuration(name, 7)
    moves = np.abs(at.jacobian(frame)).max(axis=0) > 1e-12
    assert set(np.flatnonzero(moves)) <= set(at.frame(frame).columns.tolist())
    assert moves.sum() == len(at.frame(frame).columns)


def test_a_configuration_keeps_its_own_q():
    """Neither the array it was made from nor the one it was moved to is shared."""
    q = robot("panda").posture("default")
    at = Configuration(robot("panda"), q)
    q[0] = 9.0
    assert at.q[0] == 0.0
    at.update(q)
    q[0] = 0.0
    assert at.q[0] == 9.0


def test_bad_input_is_named():
    """Size, unknown frame and unknown axes each raise their own error with the way out."""
    at = random_configuration("panda", 0)
    with pytest.raises(InvalidValue, match="shape 7, got 3"):
        Configuration(at.robot, [0.0, 0.0, 0.0])
    with pytest.raises(InvalidValue, match="7 numbers"):
        at.update(np.zeros(3))
    with pytest.raises(UnknownName, match="panda_hand"):
        at.pose("panda_hnd")
    with pytest.raises(InvalidValue, match="'world' or 'own'"):
        at.jacobian("panda_hand", "local")
