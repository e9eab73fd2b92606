"""A flawed URDF is refused by the name of the flaw, and what a model cannot hold is said."""

import warnings

import pinocchio as pin
import pytest

from taskopt.errors import DroppedWarning, InvalidValue, MissingFile
from taskopt.kinematics.robot import Robot, robot_names
from taskopt.kinematics.robot.arms import ARMS
from taskopt.kinematics.robot.named import _path
from taskopt.kinematics.robot.urdf_check import checked_urdf
from tests.helpers.urdf_text import ARM, LIMIT, PAN, TILT, joint, robot, written

XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
SPHERE = '<collision><geometry><sphere radius="{}"/></geometry></collision>'


def upper(inner: str) -> str:
    """The two-joint arm whose link "upper" has something in it."""
    return ARM.replace('<link name="upper"/>', f'<link name="upper">{inner}</link>')


REFUSED = {
    "two parents": (
        robot(PAN, TILT, joint("rocker", "base", "lower")),
        "'lower' has two parent joints.*'rocker'",
    ),
    "a cycle beside the root": (
        robot(PAN, joint("a", "x", "y"), joint("b", "y", "x"), links="base upper x y"),
        "cycle through the links x, y",
    ),
    "a joint from a link to itself": (
        robot(PAN, joint("a", "lower", "lower")),
        "cycle through the links lower",
    ),
    "two roots": (robot(PAN), "2 root links, base, lower"),
    "an unknown parent": (robot(PAN, joint("tilt", "uper", "lower")), "'tilt' needs one <parent.*got 'uper'"),
    "two children": (
        ARM.replace('<child link="upper"/>', 2 * '<child link="upper"/>'),
        "'pan' needs one <child",
    ),
    "two links of a name": (robot(PAN, TILT, links="base upper lower base"), "two links are named 'base'"),
    "two joints of a name": (robot(PAN, joint("pan", "upper", "lower")), "two joints are named 'pan'"),
    "a joint without a name": (ARM.replace('name="tilt" ', ""), "the joint after 'pan' has no name"),
    "an axis of zeros": (
        robot(PAN, joint("tilt", "upper", "lower", axis="0 0 0")),
        "'tilt' moves.*axis is 0 0 0",
    ),
    "an axis of two numbers": (ARM.replace("0 1 0", "0 1"), "'tilt'.*3 finite numbers, got '0 1'"),
    "an axis without numbers": (ARM.replace(' xyz="0 1 0"', ""), "'tilt'.*<axis xyz=…> is missing"),
    "a decimal comma": (ARM.replace('upper="2"', 'upper="0,5"'), "'pan'.*upper.*finite number, got '0,5'"),
    "a number that is none": (ARM.replace('lower="-1"', 'lower="nan"'), "'pan'.*lower.*got 'nan'"),
    "digits of another script": (ARM.replace('upper="2"', 'upper="٢"'), "'pan'.*upper.*finite number"),
    "an underscore": (ARM.replace('upper="2"', 'upper="1_0"'), "'pan'.*upper.*finite number, got '1_0'"),
    "an unknown type": (ARM.replace("revolute", "screw"), "'pan' has the type 'screw'"),
    "no limit": (robot(joint("pan", "base", "upper", ""), TILT), "'pan' is revolute and has no <limit>"),
    "a safety controller without a factor": (
        robot(joint("pan", "base", "upper", LIMIT + "<safety_controller/>"), TILT),
        "'pan'.*k_velocity.*is missing",
    ),
    "friction without a number": (
        robot(joint("pan", "base", "upper", LIMIT + "<dynamics/>"), TILT),
        "'pan'.*neither damping nor friction",
    ),
    "no effort": (ARM.replace(' effort="1"', ""), "'pan'.*effort.*is missing"),
    "lower above upper": (ARM.replace('lower="-1"', 'lower="3"'), "'pan' has position limits 3 to 2"),
    "a negative speed": (ARM.replace('velocity="3"', 'velocity="-3"'), "'pan'.*velocity.*got '-3'"),
    "an orientation that is not read": (
        ARM.replace('xyz="0 0 0.3"', 'xyz="0 0 0" quat_xyzw="0 0 1 0"'),
        "'pan'.*quat_xyzw.*ignored",
    ),
    "two limits": (robot(joint("pan", "base", "upper", 2 * LIMIT), TILT), "'pan' has two elements <limit>"),
    "a mass that is no number": (upper('<inertial><mass value="x"/></inertial>'), "'upper'.*mass.*got 'x'"),
    "a negative mass": (upper('<inertial><mass value="-1"/></inertial>'), "'upper'.*mass.*≥ 0"),
    "a radius of zero": (upper(SPHERE.format(0)), "'upper'.*radius.*> 0, got '0'"),
    "a mesh without size": (
        upper('<visual><geometry><mesh filename="a.stl" scale="1 0 1"/></geometry></visual>'),
        "'upper'.*scale",
    ),
    "a mimic of itself": (
        robot(joint("pan", "base", "upper", LIMIT + '<mimic joint="pan"/>'), TILT),
        "'pan' mimics itself",
    ),
    "a mimic of a planar joint": (
        robot(
            joint("pan", "base", "upper", "", "planar"),
            joint("t", "upper", "lower", LIMIT + '<mimic joint="pan"/>'),
        ),
        "'t' mimics 'pan', which has several axes",
    ),
    "a plane that is not that of x and y": (
        robot(joint("pan", "base", "upper", "", "planar").replace("0 0 1", "1 0 0"), TILT),
        "'pan' is planar.*'1 0 0'.*along z only",
    ),
    "a macro": (
        ARM.replace("<robot", f"<robot {XACRO}").replace("<link", "<xacro:a/><link", 1),
        "xacro.*<xacro:a>",
    ),
    "a macro of an unbound prefix": (
        ARM.replace("<link", "<xacro:a/><link", 1),
        "xacro that is not expanded",
    ),
    "an expression": (
        ARM.replace('upper="2"', 'upper="${pi/2}"'),
        r"xacro.*'\$\{pi/2\}' in <limit>.*from_xacro",
    ),
    "an argument": (ARM.replace('name="arm"', 'name="$(arg name)"'), r"xacro.*\$\(arg name\)"),
    "no joint that moves": (robot(links="base"), "no joint that moves"),
    "another format": ("<sdf><model name='a'/></sdf>", "no URDF: it needs a root element <robot>"),
    "no XML": ("{}", "not XML"),
    "an unknown encoding": ("<?xml version='1.0' encoding='klingon'?>" + ARM, "not XML"),
    "nothing": ("", "not XML"),
}


@pytest.mark.parametrize("flaw", REFUSED)
def test_a_flaw_is_refused_by_name(tmp_path, flaw):
    """The error is one of taskopt's, and names the file and the element."""
    text, said = REFUSED[flaw]
    with pytest.raises(InvalidValue, match=f"(?s)arm.urdf.*{said}"):
        Robot.from_urdf(written(tmp_path, text))


def test_the_arm_of_these_tests_is_right(tmp_path):
    """Each flaw above is the only one: without it the file loads, without a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        arm = Robot.from_urdf(written(tmp_path, ARM))
    assert (arm.joints, arm.dropped) == (("pan", "tilt"), ())


DROPPED = {
    "no range": (
        ARM.replace('lower="-1" upper="2" ', ""),
        "joints pan, tilt cannot move: <limit> states no lower",
    ),
    "no speed": (
        robot(joint("pan", "base", "upper", LIMIT.replace("3", "0")), TILT),
        "joint pan: velocity 0",
    ),
    "an attribute of a limit": (
        ARM.replace('upper="2"', 'uper="2"', 1),
        "joint pan: the attribute uper of <limit> is not read",
    ),
    "an attribute of a mimic": (
        robot(
            PAN,
            TILT,
            joint("roll", "lower", "end", LIMIT + '<mimic joint="pan" multiplyer="2"/>'),
            links="base upper lower end",
        ),
        "joint roll: the attribute multiplyer of <mimic> is not read",
    ),
    "a plane without a normal": (
        robot(joint("pan", "base", "upper", "", "planar").replace('<axis xyz="0 0 1"/>', ""), TILT),
        "joint pan: no <axis> is stated; the plane is that of x and y",
    ),
    "a range of a wheel": (
        robot(joint("pan", "base", "upper", kind="continuous"), TILT),
        "joint pan: lower and upper",
    ),
    "limits of a plane": (
        robot(joint("pan", "base", "upper", kind="planar"), TILT),
        "joint pan: <limit> is not held",
    ),
    "limits in space": (
        robot(joint("pan", "base", "upper", kind="floating"), TILT),
        "joint pan: <limit> is not held",
    ),
    "soft limits": (
        robot(
            joint(
                "pan",
                "base",
                "upper",
                LIMIT + '<safety_controller k_velocity="1" soft_lower_limit="-0.5" soft_upper_limit="3"/>',
            ),
            TILT,
        ),
        "joint pan: the soft limits",
    ),
    "a typing error in a tag": (
        robot(joint("pan", "base", "upper", LIMIT + '<limits lower="0"/>'), TILT),
        "joint pan: the element <limits> is not read",
    ),
    "a loop": (robot(PAN, TILT, '<loop_joint name="x"/>'), "the element <loop_joint> is not read"),
    "an element of another program": (
        robot(joint("pan", "base", "upper", LIMIT + '<d:a xmlns:d="http://d"/>'), TILT),
        "joint pan: the element <a> is not read",
    ),
    "a loop of a simulator": (
        robot(PAN, TILT, '<gazebo><joint name="closing" type="revolute"/></gazebo>'),
        "joint 'closing' of <gazebo> is not read",
    ),
    "a coupling of a controller": (
        robot(
            PAN,
            TILT,
            '<ros2_control><joint name="tilt"><param name="mimic">pan</param></joint></ros2_control>',
        ),
        "the couplings of tilt stand in <ros2_control> only",
    ),
    "a capsule": (
        upper('<collision><geometry><capsule radius="1" length="1"/></geometry></collision>'),
        "a collision of link 'upper' has <capsule>, which is no shape of a URDF",
    ),
    "a leader that is not there": (
        robot(PAN, joint("tilt", "upper", "lower", LIMIT + '<mimic joint="knee"/>')),
        "a joint that is mimicked is not there, so that these move by themselves: tilt (of 'knee')",
    ),
}


@pytest.mark.parametrize("kind", DROPPED)
def test_what_does_not_reach_the_robot_is_listed_and_warned_of_once(tmp_path, kind):
    """One sentence in `dropped`, one warning at the line that loads the file."""
    text, said = DROPPED[kind]
    with pytest.warns(DroppedWarning) as warned:
        arm = Robot.from_urdf(written(tmp_path, text))
    assert len(arm.dropped) == 1
    assert arm.dropped[0].startswith(said)
    assert len(warned) == 1
    assert warned[0].filename == __file__
    assert arm.dropped[0] in str(warned[0].message)
    assert arm.lock(["tilt"]).dropped == arm.dropped


def test_a_joint_or_link_that_the_loader_loses_is_named(tmp_path, monkeypatch):
    """Whatever Pinocchio may skip without a word in another version."""
    whole = pin.buildModelFromXML
    shorter = robot(PAN, links="base upper")
    monkeypatch.setattr(pin, "buildModelFromXML", lambda text: whole(shorter))
    with pytest.raises(InvalidValue, match=r"arm\.urdf without tilt, lower"):
        Robot.from_urdf(written(tmp_path, ARM))


def test_what_changes_no_motion_is_not_mentioned(tmp_path):
    """Transmissions, simulators without joints, materials, calibration: the robot moves as without them."""
    inner = LIMIT + '<dynamics damping="1"/><calibration rising="1"/><safety_controller k_velocity="1"/>'
    extra = '<transmission name="t"><joint name="pan"/></transmission><gazebo/><material name="m"/>'
    path = written(tmp_path, robot(joint("pan", "base", "upper", inner), TILT, extra))
    assert Robot.from_urdf(path).dropped == ()


@pytest.mark.parametrize("name", ["panda", "tiago_dual", "kinova", "centauro"])
def test_robots_of_the_extra_are_loaded_without_a_warning(name):
    """They have been looked at; what is true of them stands in `dropped`."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        arm = Robot.load(name)
    assert bool(arm.dropped) is (name != "panda")


@pytest.mark.slow
def test_every_file_of_the_extra_passes_the_check():
    """The check refuses no file that is in use."""
    for name in set(robot_names()) - set(ARMS):
        assert checked_urdf(_path(name)).root.tag == "robot"


@pytest.mark.parametrize("path", [None, 3, "<robot/>", "x\0y"])
def test_a_path_that_is_none_is_refused(path):
    """XML text instead of a path, a number, a null character."""
    with pytest.raises((InvalidValue, MissingFile), match="path"):
        Robot.from_urdf(path)


def test_a_folder_is_no_file(tmp_path):
    """A folder with the name of a file is not there as a file."""
    with pytest.raises(MissingFile, match="no URDF file"):
        Robot.from_urdf(tmp_path)
