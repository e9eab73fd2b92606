"""Every robot of the extra: kinematics, limits, and whether its base floats."""

from pathlib import Path

import numpy as np
import pytest

from taskopt.errors import InvalidValue, MissingFile, NotInstalled, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot, named, robot_names
from taskopt.kinematics.robot.arms import ARMS


def test_all_robots_but_the_empty_file_are_listed():
    """68 of the 69 files: ur3 holds no link; two share a stem and are told apart by folder."""
    assert len(robot_names()) == len(set(robot_names())) >= 68
    assert "ur3" not in robot_names()
    assert {"anymal_b_simple/anymal", "anymal_c_simple/anymal"} <= set(robot_names())


@pytest.mark.slow
@pytest.mark.parametrize("name", robot_names())
def test_every_listed_robot_loads_and_moves(name):
    """Kinematics at the middle of the ranges, which is inside them; all postures are configurations."""
    arm = Robot.load(name)
    at = Configuration(arm, arm.posture("middle"))
    assert arm.outside(at.q) == ()
    for posture in arm.postures.values():
        np.testing.assert_allclose(arm.checked_q(posture), posture, atol=1e-12)
    assert len(arm.velocity_names) == arm.nv == len(set(arm.velocity_names)) == len(arm.coordinate_units)
    moved = sum(abs(at.jacobian(frame)).max(initial=0.0) > 0.1 for frame in arm.frames)
    assert moved > 0
    assert np.isfinite(at.joint_jacobians).all()


@pytest.mark.parametrize(
    ("name", "floating"),
    [
        ("talos_reduced", True),
        ("talos_left_arm", False),
        ("solo12", True),
        ("icub_reduced", True),
        ("anymal_c_simple/anymal", True),
        ("quadrotor_base", True),
        ("panda", False),
        ("tiago_dual", False),
        ("pr2", False),
        ("allegro_left_hand", False),
    ],
)
def test_walkers_and_flyers_float_and_arms_do_not(name, floating):
    """By the SRDF's posture or by the table; the caller may say otherwise."""
    assert (Robot.load(name).joints[0] == "root_joint") is floating
    if name != "quadrotor_base":
        assert (Robot.load(name, floating=not floating).joints[0] == "root_joint") is not floating


@pytest.mark.parametrize(
    ("name", "posture"),
    [
        ("panda", "default"),
        ("kinova", "arm_up"),
        ("talos_reduced", "half_sitting"),
        ("solo12", "straight_standing"),
        ("z1", "arm_up"),
        ("xarm7", "hold-up"),
        ("b1-z1", "standing_with_arm_up"),
    ],
)
def test_postures_come_from_the_srdf(name, posture):
    """By the names that the files give them."""
    assert posture in Robot.load(name).postures


def test_joints_can_be_locked_on_loading():
    """The Panda without its fingers has seven joints, and its default posture loses two numbers."""
    arm = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    assert (arm.nq, arm.nv) == (7, 7)
    np.testing.assert_allclose(arm.posture("default"), [0, -0.785398, 0, -2.35619, 0, 1.5707, 0.785398])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("pandda", "did you mean panda"),
        ("anymal", "anymal_b_simple/anymal.* have that file name"),
        ("ur3", "ur3_robot"),
        ("my_arm.urdf", r"a file is read by Robot\.from_urdf"),
    ],
)
def test_an_unknown_robot_gets_the_nearest(name, said):
    """A typing error, a stem that two robots share, the empty file."""
    with pytest.raises(UnknownName, match=said):
        Robot.load(name)


def test_something_else_than_a_name_is_refused():
    """A path object in place of a name gets the way to read a file."""
    with pytest.raises(InvalidValue, match=r"by its name, got .*Robot\.from_urdf"):
        Robot.load(Path("arm.urdf"))


def test_without_the_extra_the_line_that_installs_it_is_given(monkeypatch):
    """And the arms of the textbook are still there."""
    monkeypatch.setattr(named, "_share", lambda: None)
    named._files.cache_clear()
    try:
        with pytest.raises(
            NotInstalled, match=r"robot 'panda' is not installed.*pip install 'taskopt\[robots\]'"
        ):
            Robot.load("panda")
        assert robot_names() == tuple(ARMS)
        assert Robot.load("scara").nq == 4
    finally:
        named._files.cache_clear()


def test_a_mesh_that_the_extra_forgot_is_named_on_use():
    """romeo_laas_small moves, and says what it lacks when it is to be drawn."""
    arm = Robot.load("romeo_laas_small")
    with pytest.raises(MissingFile, match=r"Torso\.mesh"):
        _ = arm.visual


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(robot_names()) - {"romeo_laas_small"}))
def test_every_listed_robot_has_its_meshes(name):
    """Collision and visual shapes load, and but for one file without any there is something to draw."""
    arm = Robot.load(name)
    assert (arm.visual.ngeoms + arm.geometry.ngeoms > 0) is (name != "simple_humanoid_classical")
