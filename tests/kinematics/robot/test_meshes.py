"""Meshes are found wherever ROS finds them, and a file that is no mesh is named."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue, MissingFile
from taskopt.kinematics.robot import Robot
from tests.helpers.urdf_text import ARM, written

TETRAHEDRON = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def shaped(collision: str, visual: str | None = None) -> str:
    """The two-joint arm with shapes on its middle link."""
    inner = f"<collision><geometry>{collision}</geometry></collision>"
    inner += f"<visual><geometry>{visual or collision}</geometry></visual>"
    return ARM.replace('<link name="upper"/>', f'<link name="upper">{inner}</link>')


def meshed(name: str) -> str:
    """The arm with one mesh."""
    return shaped(f'<mesh filename="{name}"/>')


@pytest.fixture
def apart(tmp_path, monkeypatch):
    """Two folders that have nothing to do with each other, and no variable of ROS."""
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
    return tmp_path / "here", tmp_path / "there"


def put(folder, content: str = TETRAHEDRON):
    """Write a mesh into a folder that is made."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "link.obj").write_text(content)
    return folder / "link.obj"


def test_a_package_is_found_under_the_prefixes_of_ros_2(apart, monkeypatch):
    """$AMENT_PREFIX_PATH/share/<package>; without the variable the mesh is missing."""
    here, there = apart
    put(there / "share" / "arm_description" / "meshes")
    path = written(here, meshed("package://arm_description/meshes/link.obj"))
    with pytest.raises(MissingFile, match=r"package://arm_description/meshes/link.obj"):
        Robot.from_urdf(path)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{there}")
    assert Robot.from_urdf(path).geometry.ngeoms == 1


def test_a_package_is_found_under_the_folders_of_ros_1(apart, monkeypatch):
    """An entry of $ROS_PACKAGE_PATH holds packages, or is the package itself."""
    here, there = apart
    put(there / "arm_description")
    path = written(here, meshed("package://arm_description/link.obj"))
    for entry in (there, there / "arm_description"):
        monkeypatch.setenv("ROS_PACKAGE_PATH", str(entry))
        assert Robot.from_urdf(path).visual.ngeoms == 1
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    assert Robot.from_urdf(path, package_dirs=[there / "arm_description"]).visual.ngeoms == 1


@pytest.mark.parametrize("form", ["file://{}", "file://localhost{}", "{}"])
def test_an_absolute_name_is_found_in_each_form(apart, form):
    """With and without a scheme and a host; a blank may be written as %20."""
    here, there = apart
    mesh = put(there / "with blank")
    for name in (str(mesh), str(mesh).replace(" ", "%20")):
        assert Robot.from_urdf(written(here, meshed(form.format(name)))).geometry.ngeoms == 1


def test_a_name_relative_to_the_file_is_found(apart):
    """As editors without packages write it, and above the file too."""
    here, _ = apart
    put(here / "meshes")
    assert Robot.from_urdf(written(here, meshed("meshes/link.obj"))).geometry.ngeoms == 1
    below = here / "urdf"
    below.mkdir()
    assert Robot.from_urdf(written(below, meshed("../meshes/link.obj"))).geometry.ngeoms == 1


def test_a_mesh_of_the_network_is_missing(apart):
    """No other scheme is fetched."""
    with pytest.raises(MissingFile, match=r"http://there/link.obj"):
        Robot.from_urdf(written(apart[0], meshed("http://there/link.obj")))


NO_MESH = {
    "a pointer of Git LFS": (
        "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 5\n",
        "Git LFS.*git lfs pull",
    ),
    "an empty file": ("", "is empty"),
    "words": ("this is no mesh at all, whatever it is called\n" * 9, "cannot be read"),
    "a point out of range": ("v 0 0 0\nf 1 2 9\n", "cannot be read: .*out of range"),
    "points at infinity": ("v inf 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
    "points alone": ("v 0 0 0\nv 1 0 0\n", "cannot be read"),
}


@pytest.mark.parametrize("kind", NO_MESH)
@pytest.mark.parametrize("part", ["geometry", "visual"])
def test_a_file_that_is_no_mesh_is_named(apart, kind, part):
    """By an error of taskopt's, on loading or when the shapes are first used."""
    content, said = NO_MESH[kind]
    put(apart[0], content)
    with pytest.raises(InvalidValue, match=f"link.obj.*arm.urdf.*{said}"):
        getattr(Robot.from_urdf(written(apart[0], meshed("link.obj"))), part)


def test_without_meshes_the_simple_shapes_stay(apart):
    """meshes=False: a sphere that collides is kept, the mesh that is drawn is left out and listed."""
    path = written(apart[0], shaped('<sphere radius="0.05"/>', '<mesh filename="package://not_here/a.dae"/>'))
    with pytest.raises(MissingFile, match=r"not_here/a\.dae.*meshes=False"):
        Robot.from_urdf(path)
    arm = Robot.from_urdf(path, meshes=False)
    assert (arm.geometry.ngeoms, arm.visual.ngeoms) == (1, 0)
    assert arm.dropped == ("meshes are left out, as meshes=False asks for: package://not_here/a.dae",)


def test_meshes_lie_where_the_file_places_them(apart):
    """The corner of a mesh that is scaled and placed: origin and scale of the shape are kept."""
    put(apart[0])
    text = (
        meshed("link.obj")
        .replace("<geometry>", '<origin xyz="1 0 0"/><geometry>')
        .replace("<mesh ", '<mesh scale="2 2 2" ')
    )
    shape = Robot.from_urdf(written(apart[0], text)).geometry.geometryObjects[0]
    np.testing.assert_allclose(shape.placement.translation, [1.0, 0.0, 0.0])
    shape.geometry.computeLocalAABB()
    np.testing.assert_allclose(shape.geometry.aabb_local.max_, [0.2, 0.2, 0.2])


@pytest.mark.parametrize("folders", [3, [3]])
def test_folders_that_are_none_are_refused(apart, folders):
    """A number in place of a list, and in the list."""
    with pytest.raises(InvalidValue, match="package_dirs must be a list of folders"):
        Robot.from_urdf(written(apart[0], ARM), package_dirs=folders)
