"""Xacro files are expanded, with arguments, relative files and packages, and then checked as a URDF."""

import sys

import pytest

from taskopt.errors import InvalidValue, MissingFile, NotInstalled, UnknownName
from taskopt.kinematics.robot import Robot

pytest.importorskip("xacrodoc")
SPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
PARTS = f"""<robot {SPACE}><xacro:macro name="segment" params="name parent upper:=1.5">
<link name="${{name}}_link"/><joint name="${{name}}" type="revolute"><parent link="${{parent}}"/>
<child link="${{name}}_link"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="${{upper * 2}}" velocity="1" effort="1"/></joint></xacro:macro></robot>"""
ARM = f"""<robot name="arm" {SPACE}><xacro:arg name="gripper" default="true"/>
<xacro:include filename="FILE"/><link name="base"/><xacro:segment name="pan" parent="base" upper="1"/>
<xacro:if value="$(arg gripper)"><xacro:segment name="grip" parent="pan_link"/></xacro:if></robot>"""


@pytest.fixture
def package(tmp_path):
    """A package of ROS with a file that others include."""
    folder = tmp_path / "my_arm"
    (folder / "urdf").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>my_arm</name></package>")
    (folder / "urdf" / "parts.xacro").write_text(PARTS)
    return folder


@pytest.mark.parametrize("file", ["parts.xacro", "$(find my_arm)/urdf/parts.xacro"])
@pytest.mark.parametrize(("args", "joints"), [(None, ("pan", "grip")), ({"gripper": False}, ("pan",))])
def test_a_file_is_expanded_with_its_arguments(package, file, args, joints):
    """Includes beside the file and in a package; a truth value is written as xacro reads it."""
    path = package / "urdf" / "arm.urdf.xacro"
    path.write_text(ARM.replace("FILE", file))
    arm = Robot.from_xacro(path, args)
    assert arm.joints == joints
    assert arm.position_upper.tolist() == [2.0, 3.0][: len(joints)]


def test_a_package_elsewhere_is_found_in_the_folders_given(package, tmp_path):
    """package_dirs serves $(find …), too."""
    path = tmp_path / "elsewhere.xacro"
    path.write_text(ARM.replace("FILE", "$(find my_arm)/urdf/parts.xacro"))
    assert Robot.from_xacro(path, package_dirs=tmp_path).nv == 2


def test_a_package_of_another_file_is_not_remembered(package, tmp_path):
    """Two checkouts with one package name: each file gets the parts of its own."""
    for k, folder in enumerate((package, tmp_path / "second" / "my_arm")):
        (folder / "urdf").mkdir(parents=True, exist_ok=True)
        (folder / "package.xml").write_text("<package><name>my_arm</name></package>")
        (folder / "urdf" / "parts.xacro").write_text(PARTS.replace("upper * 2", f"upper * {2 + k}"))
        path = folder / "urdf" / "arm.xacro"
        path.write_text(ARM.replace("FILE", "$(find my_arm)/urdf/parts.xacro"))
        assert Robot.from_xacro(path).position_upper[0] == 2.0 + k


def test_values_of_arguments_are_written_as_on_the_command_line(package):
    """A truth value in lower case, a number as it is."""
    path = package / "urdf" / "arm.xacro"
    joint = (
        '<joint name="j" type="continuous"><parent link="base"/><child link="l_$(arg a)_$(arg b)"/></joint>'
    )
    args = '<xacro:arg name="a" default=""/><xacro:arg name="b" default=""/>'
    path.write_text(
        f'<robot name="a" {SPACE}>{args}<link name="base"/><link name="l_$(arg a)_$(arg b)"/>{joint}</robot>'
    )
    assert "l_false_0.5" in Robot.from_xacro(path, {"a": False, "b": 0.5}).frames


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ARM.replace("FILE", "not_here.xacro"), r"cannot be expanded: .*not_here\.xacro"),
        (ARM.replace("FILE", "$(find no_such_package)/a.xacro"), "no_such_package"),
        (f'<robot name="a" {SPACE}><link name="${{nope}}"/></robot>', "cannot be expanded: name 'nope'"),
        (f'<robot name="a" {SPACE}><link name="${{1/0}}"/></robot>', "cannot be expanded"),
        (f'<robot name="a" {SPACE}><link name="base"/></robot>', "no joint that moves"),
        ("<robot", "cannot be expanded"),
        ("", "cannot be expanded"),
    ],
)
def test_a_file_that_cannot_be_expanded_is_refused(package, text, said):
    """By an error of taskopt's that names the file, also where the URDF is flawed."""
    path = package / "urdf" / "arm.xacro"
    path.write_text(text)
    with pytest.raises(InvalidValue, match=f"(?s)arm.xacro.*{said}"):
        Robot.from_xacro(path)


def test_an_argument_that_the_file_does_not_have_is_refused(package):
    """With the names that it has; one that only an included file declares is accepted."""
    path = package / "urdf" / "arm.xacro"
    path.write_text(ARM.replace("FILE", "parts.xacro"))
    (package / "urdf" / "parts.xacro").write_text(
        PARTS.replace("<xacro:macro", '<xacro:arg name="length" default="1"/><xacro:macro')
    )
    assert Robot.from_xacro(path, {"length": 2.0}).nv == 2
    with pytest.raises(UnknownName, match=r"no argument of arm\.xacro named 'griper'; did you mean gripper"):
        Robot.from_xacro(path, {"griper": False})


def test_arguments_that_are_none_are_refused(package):
    """A list in place of a mapping; a file that is not there."""
    with pytest.raises(InvalidValue, match=r"args of .* must be a mapping"):
        Robot.from_xacro(package / "urdf" / "parts.xacro", ["gripper:=false"])
    with pytest.raises(MissingFile, match="no xacro file"):
        Robot.from_xacro(package / "urdf" / "arm.xacro")


def test_without_xacrodoc_the_extra_is_named(package, monkeypatch):
    """The error has the line that installs it."""
    monkeypatch.setitem(sys.modules, "xacrodoc", None)
    with pytest.raises(NotInstalled, match=r"xacrodoc.*pip install 'taskopt\[xacro\]'"):
        Robot.from_xacro(package / "urdf" / "parts.xacro")
