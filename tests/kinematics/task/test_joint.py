"""Joint tasks: manifold differences, the chosen joints, and refusals."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.target import Circle, Function, Line
from taskopt.kinematics.task import JointTask
from tests.helpers.moving import bound, derivative_mismatch
from tests.helpers.robots import FRAMES, generic_q, robot


def moving_posture(of, seed):
    """A posture in constant generic motion, with its exact rate."""
    q, v = generic_q(of, seed), np.random.default_rng(seed).normal(size=of.nv)
    return Function(lambda t: of.integrate(q, v, t), lambda t: v)


@pytest.mark.parametrize("joints", ["one-dof", "all"])
@pytest.mark.parametrize("name", FRAMES)
def test_rows_are_the_derivative_of_the_error_along_any_motion(name, joints):
    """ė = q̇_d − A v on the manifold, free-flyer and continuous wheels included."""
    of = robot(name)
    task = JointTask(moving_posture(of, 11), joints=of.joints if joints == "all" else None, gain=3.0)
    assert max(derivative_mismatch(task, of, seed) for seed in range(3)) < 2e-8


@pytest.mark.parametrize("name", FRAMES)
def test_the_error_leads_to_the_target(name):
    """q ⊕ e = q_d when all joints are named."""
    of = robot(name)
    q, goal = generic_q(of, 1), generic_q(of, 2, spread=1.0)
    task, _ = bound(JointTask(goal, joints=of.joints), Configuration(of, q))
    reached = of.integrate(q, task.error, 1.0)
    np.testing.assert_allclose(of.difference(reached, goal), 0.0, atol=1e-12)


def test_a_continuous_joint_goes_the_short_way_round():
    """From 170° to −170° a wheel turns by +20°."""
    of = robot("tiago")
    wheel = "wheel_left_joint"
    column = of.velocity_index(wheel).start
    turn = np.zeros(of.nv)
    turn[column] = np.deg2rad(170.0)
    at = Configuration(of, of.integrate(of.neutral, turn, 1.0))
    task, rows = bound(JointTask({wheel: np.deg2rad(-170.0)}, joints=(wheel,)), at)
    np.testing.assert_allclose(task.error, np.deg2rad(20.0), atol=1e-14)
    assert rows.A.tolist() == [np.eye(of.nv)[column].tolist()]
    assert task.column == (column,)


def test_by_default_the_free_flyer_is_left_alone():
    """TALOS: one row for each joint with one velocity, none for the base."""
    of = robot("talos_reduced")
    task = JointTask().bind(of, "posture")
    assert len(task.row_names) == of.nv - 6
    assert not any(name.startswith("root_joint") for name in task.row_names)


def test_a_posture_may_be_whole_or_by_joint_or_a_mapping():
    """Three ways to write one target, joints not named staying where the run starts."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    joints = ("panda_joint2", "panda_joint4")
    whole = at.q.copy()
    whole[[1, 3]] = 0.1, -1.0
    targets = [
        bound(JointTask(value, joints=joints), at)[0].goal
        for value in (whole, [0.1, -1.0], {"panda_joint4": -1.0, "panda_joint2": 0.1})
    ]
    for target in targets:
        np.testing.assert_allclose(target, whole, atol=1e-15)


def test_weights_and_gains_go_to_the_joints_in_the_order_given():
    """b = K e row by row; a joint with weight 0 has no row."""
    of = robot("planar")
    at = Configuration(of, np.array([0.1, 0.2, 0.3]))
    task, rows = bound(
        JointTask([1.0, 2.0, 3.0], joints=("joint3", "joint1", "joint2"), gain=[5, 6, 7], weight=[1, 0, 2]),
        at,
    )
    assert task.row_names == ("joint3", "joint2")
    np.testing.assert_allclose(rows.lower, [5 * (1.0 - 0.3), 7 * (3.0 - 0.2)])
    np.testing.assert_array_equal(task.weight, [1, 2])


def test_a_line_in_joint_space_arrives():
    """Line(to): at the end e is what is left at the start posture, with zero feedforward."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    goal = generic_q(of, 1)
    task, rows = bound(JointTask(Line(to=goal, duration=2.0)), at)
    task.fill(at, 2.0, rows)
    np.testing.assert_allclose(task.error, goal - at.q, atol=1e-14)
    np.testing.assert_allclose(rows.lower, task.error, atol=1e-14)


@pytest.mark.parametrize(
    ("task", "error", "says"),
    [
        (JointTask(joints=("panda_joint9",)), UnknownName, "panda_joint"),
        (JointTask(np.zeros(3)), InvalidValue, "one a joint"),
        (JointTask({"panda_joint9": 0.0}), UnknownName, "panda_joint"),
        (JointTask(np.full(7, np.nan)), InvalidValue, "NaN"),
        (JointTask(Circle(radius=0.1, period=1.0)), InvalidValue, "path of a frame"),
        (JointTask(weight=np.ones(3)), InvalidValue, "weight"),
    ],
)
def test_what_the_robot_does_not_have_is_refused(task, error, says):
    """Names, sizes and NaN are found when the task meets the robot."""
    with pytest.raises(error, match=says):
        bound(task, Configuration(robot("panda"), generic_q(robot("panda"), 0)))


def test_one_number_cannot_place_a_free_flyer():
    """Only a whole posture can."""
    of = robot("talos_reduced")
    with pytest.raises(InvalidValue, match="whole posture"):
        bound(JointTask({"root_joint": 0.0}, joints=("root_joint",)), Configuration(of, generic_q(of, 0)))


@pytest.mark.parametrize("joints", ["joint1", ("joint1", "joint1")])
def test_joints_must_be_different_names_in_a_list(joints):
    """A bare string would be read letter by letter."""
    with pytest.raises(InvalidValue, match="different names"):
        JointTask(joints=joints)
