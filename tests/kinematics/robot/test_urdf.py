"""Reading URDF and SRDF: what is found, and what is said about what is not."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue, MissingFile
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.robot.named import _path

URDF = """<robot name="two">
  <link name="base"/>
  <link name="upper"><visual><geometry><{shape}/></geometry></visual>
    <collision><geometry><{shape}/></geometry></collision></link>
  <link name="lower"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/></joint>
  <joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="1 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="2" velocity="3" effort="1"/></joint>
</robot>"""
SPHERE = 'sphere radius="0.1"'
SRDF = """<robot name="two">
  <group_state name="bent" group="a"><joint name="bend" value="1.5"/></group_state>
  <group_state name="bent" group="b"><joint name="turn" value="0.5"/></group_state>
  <group_state name="floating"><joint name="root_joint" value="1 2 3 0 0 0.6 0.8"/>
    <joint name="bend" value="1.0"/><joint name="turn" value="0.1"/></group_state>
  <group_state name="of_another_robot"><joint name="knee" value="1"/>
    <joint name="bend" value="1"/></group_state>
</robot>"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "two.urdf").write_text(URDF.format(shape=SPHERE))
    (tmp_path / "two.srdf").write_text(SRDF)
    return tmp_path


def test_a_file_gives_tree_shapes_and_postures(folder):
    """A continuous joint's angle becomes cosine and sine; states of one name over groups are merged."""
    arm = Robot.from_urdf(folder / "two.urdf", srdf=folder / "two.srdf")
    assert (arm.name, arm.nq, arm.nv) == ("two", 3, 2)
    assert arm.geometry.ngeoms == arm.visual.ngeoms == 1
    np.testing.assert_allclose(arm.posture("bent"), [np.cos(0.5), np.sin(0.5), 1.5])
    assert set(arm.postures) == {"neutral", "middle", "bent", "floating"}


def test_a_floating_base_is_put_below_and_takes_its_place_from_the_posture(folder):
    """Seven more numbers, six more velocities; on a fixed base the root of a posture is left out."""
    arm = Robot.from_urdf(folder / "two.urdf", floating=True, srdf=folder / "two.srdf")
    assert (arm.nq, arm.nv, arm.joints[0]) == (10, 8, "root_joint")
    np.testing.assert_allclose(arm.posture("floating")[:7], [1, 2, 3, 0, 0, 0.6, 0.8])
    fixed = Robot.from_urdf(folder / "two.urdf", srdf=folder / "two.srdf")
    np.testing.assert_allclose(fixed.posture("floating")[2], 1.0)


def test_joints_are_locked_on_loading(folder):
    """lock= by name."""
    assert Robot.from_urdf(folder / "two.urdf", lock=["turn"]).joints == ("bend",)


@pytest.mark.parametrize(
    ("options", "error", "said"),
    [
        (
            {"path": "three.urdf"},
            MissingFile,
            "no URDF file .*three.urdf; in that folder: broken.urdf, two.urdf",
        ),
        ({"path": "nowhere/two.urdf"}, MissingFile, "no URDF file .*; check the path"),
        ({"path": "two.urdf", "srdf": "three.srdf"}, MissingFile, "no SRDF file .*in that folder: two.srdf"),
        ({"path": "broken.urdf"}, InvalidValue, "broken.urdf is not XML"),
        ({"path": "broken.urdf", "meshes": False}, InvalidValue, "broken.urdf is not XML"),
    ],
)
def test_files_that_are_missing_or_broken_are_named(folder, options, error, said):
    """Each with the way out: what the folder does hold."""
    (folder / "broken.urdf").write_text("<robot name='broken'><link")
    paths = {key: folder / value if isinstance(value, str) else value for key, value in options.items()}
    with pytest.raises(error, match=said):
        Robot.from_urdf(**paths)


def test_a_missing_mesh_is_named_at_once_and_can_be_done_without(folder):
    """Not when a viewer first asks for it; meshes=False gives the kinematics alone."""
    path = folder / "meshed.urdf"
    path.write_text(URDF.format(shape='mesh filename="package://pack/arm.stl"'))
    with pytest.raises(MissingFile, match=r"package://pack/arm.stl.*package_dirs=.*meshes=False"):
        Robot.from_urdf(path)
    arm = Robot.from_urdf(path, meshes=False)
    assert arm.nv == 2
    assert arm.geometry.ngeoms == 0


@pytest.mark.parametrize(
    "written", ["package://pack/arm.stl", "pack/arm.stl", "package:///pack/arm.stl", "file://"]
)
def test_meshes_are_found_in_the_folders_given_or_above_the_file(folder, written):
    """Names of any kind are looked for where Pinocchio looks: in package_dirs, or above the URDF."""
    nested = folder / "pack" / "urdf"
    nested.mkdir(parents=True)
    mesh = folder / "pack" / "arm.stl"
    mesh.write_text(
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
        "endfacet\nendsolid a\n"
    )
    name = f"file://{mesh}" if written == "file://" else written
    (nested / "meshed.urdf").write_text(URDF.format(shape=f'mesh filename="{name}"'))
    assert Robot.from_urdf(nested / "meshed.urdf").geometry.ngeoms == 1
    assert Robot.from_urdf(nested / "meshed.urdf", package_dirs=folder).visual.ngeoms == 1
    mesh.unlink()
    with pytest.raises(MissingFile, match=r"arm.stl.*looked in: /nowhere"):
        Robot.from_urdf(nested / "meshed.urdf", package_dirs=["/nowhere"])


def test_a_file_of_the_extra_is_the_robot_of_that_name():
    """from_urdf on the Panda's own file needs no package_dirs, and gives what load does."""
    path = _path("panda")
    by_file, by_name = Robot.from_urdf(path), Robot.load("panda")
    assert by_file.joints == by_name.joints
    assert by_file.geometry.ngeoms == by_name.geometry.ngeoms > 10
