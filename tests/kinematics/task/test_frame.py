"""Frame tasks: exact derivatives, the textbook's rows, masks, names and refusals."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.pose import exp6, log3
from taskopt.kinematics.target import Function, Hold
from taskopt.kinematics.task import FrameTask, OrientationTask, PositionTask
from tests.helpers.moving import bound, derivative_mismatch, tumbling
from tests.helpers.robots import FRAMES, generic_q, robot

TASKS = {
    "pose, own": lambda f, r: FrameTask(f, target=r, gain=7.0),
    "pose, world": lambda f, r: FrameTask(f, target=r, gain=7.0, expressed="world"),
    "pose, masked": lambda f, r: FrameTask(f, target=r, gain=7.0, axes="xz ry"),
    "position, own": lambda f, r: PositionTask(f, target=r, gain=7.0, expressed="own"),
    "position, world": lambda f, r: PositionTask(f, target=r, gain=7.0, axes="xy"),
    "orientation, own": lambda f, r: OrientationTask(f, target=r, gain=7.0),
    "orientation, world": lambda f, r: OrientationTask(f, target=r, gain=7.0, expressed="world"),
}
TOLERANCE = 2e-8  # h² of the differences times third derivatives of order 100


@pytest.mark.parametrize("kind", TASKS)
@pytest.mark.parametrize("name", FRAMES)
def test_rows_are_the_derivative_of_the_error_along_any_motion_of_robot_and_target(name, kind):
    """ė = ẋ_d − A v, with the target tumbling and the robot in generic motion."""
    of = robot(name)
    target = tumbling(Configuration(of, generic_q(of, 5)).pose(FRAMES[name]), seed=6)
    task = TASKS[kind](FRAMES[name], target)
    assert max(derivative_mismatch(task, of, seed) for seed in range(4)) < TOLERANCE


def test_a_wrong_feedforward_is_caught():
    """The check above fails for a twist given in the axes of the target instead of the world's."""
    of = robot("panda")
    right = tumbling(Configuration(of, generic_q(of, 5)).pose("panda_hand"), seed=6)
    wrong = Function(
        right.value,
        lambda t: np.tile(right.value(t)[:3, :3].T, (2, 1, 1)).reshape(6, 3) @ right.derivative(t)[:3],
    )
    assert derivative_mismatch(FrameTask("panda_hand", target=wrong), of, 0) > 1e-2


@pytest.mark.parametrize("kind", ["pose, own", "pose, world", "orientation, own", "orientation, world"])
@pytest.mark.parametrize("angle", [1e-9, 1e-4, 3.1, np.pi - 1e-4])
def test_rows_stay_exact_from_tiny_errors_to_almost_half_a_turn(kind, angle):
    """ė = ẋ_d − A v where the logarithm is delicate; the step of the differences stays off the cut at π."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    axis = np.array([0.6, 0.0, 0.8])
    goal = at.pose("panda_hand") @ exp6(np.concatenate([[0.1, -0.2, 0.3], angle * axis]))
    task = TASKS[kind]("panda_hand", Hold(goal))
    assert derivative_mismatch(task, of, 0) < TOLERANCE


def test_the_own_pose_rows_are_those_of_pinocchio():
    """e = −log6(T_d⁻¹ T) and A = Jlog6(T_d⁻¹ T) J_own: pink's FrameTask with both signs turned."""
    of = robot("panda")
    q = generic_q(of, 1)
    data = of.model.createData()
    pin.framesForwardKinematics(of.model, data, q)
    T = data.oMf[of.frame_id("panda_hand")]
    goal = T * pin.exp6(np.array([0.1, -0.2, 0.3, 1.0, -0.5, 0.8]))
    J = pin.computeFrameJacobian(of.model, data, q, of.frame_id("panda_hand"), pin.LOCAL)
    task, rows = bound(FrameTask("panda_hand", target=goal, gain=3.0), Configuration(of, q))
    X = goal.actInv(T)
    np.testing.assert_allclose(task.error, -pin.log6(X).vector, atol=1e-13)
    np.testing.assert_allclose(rows.A, pin.Jlog6(X) @ J, atol=1e-13)
    np.testing.assert_allclose(rows.lower, 3.0 * task.error, atol=1e-13)
    np.testing.assert_array_equal(rows.lower, rows.upper)


@pytest.mark.equation("3.78", "3.79")
def test_a_world_position_task_is_the_geometric_jacobian_of_the_chapter():
    """PositionTask: A = J_P of (3.5), e = p_d − p, b = ṗ_d + K e (3.70)."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 1))
    p, rate = np.array([0.4, 0.1, 0.5]), np.array([0.3, -0.2, 0.1])
    task, rows = bound(
        PositionTask("panda_hand", target=Function(lambda t: p, lambda t: rate), gain=[1, 2, 3]), at
    )
    np.testing.assert_allclose(rows.A, at.jacobian("panda_hand")[:3], atol=1e-14)
    np.testing.assert_allclose(task.error, p - at.pose("panda_hand")[:3, 3], atol=1e-14)
    np.testing.assert_allclose(rows.lower, rate + [1, 2, 3] * task.error, atol=1e-14)


def test_own_and_world_orientation_errors_are_one_rotation_vector_in_two_axes():
    """R log(Rᵀ R_d) = log(R_d Rᵀ)."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 2))
    goal = tumbling(at.pose("panda_hand"), 3).value(0.0)
    own, _ = bound(OrientationTask("panda_hand", target=goal), at)
    world, _ = bound(OrientationTask("panda_hand", target=goal[:3, :3], expressed="world"), at)
    R = at.pose("panda_hand")[:3, :3]
    np.testing.assert_allclose(R @ own.error, world.error, atol=1e-13)
    np.testing.assert_allclose(own.error, log3(R.T @ goal[:3, :3]), atol=1e-13)


@pytest.mark.slow
@given(seed=st.integers(0, 2**32 - 1), gain=st.floats(1.0, 400.0))
def test_with_exact_feedforward_a_tracked_target_stays_tracked(seed, gain):
    """With e = 0, the v that meets the rows follows a tumbling target: after dt the error is O(dt²)."""
    of, dt = robot("panda"), 1e-4
    q = generic_q(of, seed % 1000)
    at = Configuration(of, q)
    T = at.pose("panda_hand")
    right = tumbling(T, seed)
    shift = T @ np.linalg.inv(right.value(0.0))
    twist = np.kron(np.eye(2), shift[:3, :3])
    moved = Function(lambda t: shift @ right.value(t), lambda t: twist @ right.derivative(t))
    task, rows = bound(FrameTask("panda_hand", target=moved, gain=gain), at)
    assert np.abs(task.error).max() < 1e-12
    v = np.linalg.pinv(rows.A) @ rows.lower
    task.fill(Configuration(of, of.integrate(q, v, dt)), dt, rows)
    assert np.abs(task.error).max() < 1e-7 * max(1.0, np.abs(v).max() ** 2)


@pytest.mark.parametrize("name", FRAMES)
def test_at_the_start_a_task_without_target_asks_for_nothing(name):
    """Hold(): e = 0, b = 0 at the start, and target is the actual pose."""
    of = robot(name)
    at = Configuration(of, generic_q(of, 3))
    task, rows = bound(FrameTask(FRAMES[name]), at)
    np.testing.assert_allclose(rows.lower, 0.0, atol=1e-14)
    np.testing.assert_allclose(task.desired, at.pose(FRAMES[name]), atol=1e-15)
    np.testing.assert_allclose(task.actual, at.pose(FRAMES[name]), atol=1e-15)


def test_a_mask_keeps_the_rows_of_the_whole_task():
    """Rows, names and weights of a masked task are those of the full one."""
    at = Configuration(robot("panda"), generic_q(robot("panda"), 4))
    goal = tumbling(at.pose("panda_hand"), 1)
    weight = [1, 2, 3, 4, 5, 6]
    full, all_rows = bound(FrameTask("panda_hand", target=goal, weight=weight), at)
    part, rows = bound(FrameTask("panda_hand", target=goal, weight=weight, axes="xz y"), at)
    keep = [0, 2, 5]
    assert part.row_names == ("x", "z", "rz")
    np.testing.assert_array_equal(rows.A, all_rows.A[keep])
    np.testing.assert_array_equal(part.error, full.error[keep])
    np.testing.assert_array_equal(part.weight, full.weight[keep])


def test_a_weight_of_zero_takes_the_row_out():
    """(1, 0) on a pose is a position task: three rows."""
    task = FrameTask("panda_hand", weight=(1.0, 0.0)).bind(robot("panda"), "hand")
    assert task.row_names == ("x", "y", "z")
    assert task.row_units == ("m/s",) * 3


def test_columns_that_do_not_move_the_frame_stay_zero():
    """The wheels and head of TIAGo do not move its tool."""
    of = robot("tiago")
    at = Configuration(of, generic_q(of, 0))
    _, rows = bound(FrameTask("arm_tool_link"), at)
    still = [j for j in range(of.nv) if j not in of.support("arm_tool_link")]
    assert not rows.A[:, still].any()
    assert rows.A[:, of.support("arm_tool_link")].any(axis=0).all()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"gain": -1.0}, "gain"),
        ({"gain": [1.0, 2.0]}, "shape 6"),
        ({"gain": np.nan}, "gain has NaN"),
        ({"weight": 0.0}, "weight"),
        ({"weight": (0.0, 1.0), "axes": "xyz"}, "weight is 0"),
        ({"axes": ""}, "no row"),
        ({"axes": "zyx"}, "order"),
        ({"axes": [True, False]}, "6 truth values"),
        ({"expressed": "hand"}, "'own' or 'world'"),
    ],
)
def test_a_senseless_declaration_is_refused_where_it_is_written(options, says):
    """Gain, weight, axes and frame are checked without a robot."""
    with pytest.raises(InvalidValue, match=says):
        FrameTask("panda_hand", **options)


def test_an_unknown_frame_gets_its_nearest_match():
    """UnknownName names panda_hand for panda_hnd."""
    with pytest.raises(UnknownName, match="panda_hand"):
        FrameTask("panda_hnd").bind(robot("panda"), "hand")
