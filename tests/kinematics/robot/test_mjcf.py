"""MJCF files give the robots that MuJoCo itself sees in them, whatever the file makes use of."""

import pickle
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from taskopt import Controller, Coupling, FrameTask, JointPositionLimit, JointTask, Stack
from taskopt.errors import DroppedWarning, InvalidValue, MissingFile, NotInstalled, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.robot.mjcf import read_mjcf

mujoco = pytest.importorskip("mujoco")
gymnasium = pytest.importorskip("gymnasium")
ASSETS = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
FILES = sorted(ASSETS.glob("*.xml"))
pytestmark = pytest.mark.filterwarnings("ignore::taskopt.errors.DroppedWarning")

BALL = '<geom size="0.05" mass="1"/>'
EVERYTHING = f"""<mujoco><compiler angle="degree" eulerseq="zyx"/>
<default><joint axis="1 0 0"/><default class="slide"><joint type="slide" axis="0 2 1"/></default></default>
<include file="part.xml"/>
<worldbody>
  <geom name="floor" type="plane" size="1 1 1"/>
  <body name="cart" pos="0.1 0.2 0.3" euler="10 20 30">
    <joint name="along" class="slide" ref="0.2" range="-1 2"/>
    <joint name="swing" pos="0.1 0 0.2" axis="0 1 3" ref="30" range="-90 90" limited="true"/>{BALL}
    <site name="tool" pos="0 0 0.1" zaxis="1 1 0"/>
    <body pos="0 0 0.5" axisangle="0 0 1 45"><body name="welded" pos="0 0.1 0" xyaxes="0 1 0 -1 0 0">
      <geom type="capsule" fromto="0 0 0 0 0 0.2" size="0.02" mass="0.5"/></body>
      <frame pos="0 0 0.1" euler="90 0 0">
        <body name="wrist" quat="2 0 1 0"><joint name="wrist" type="ball" pos="0 0.05 0"/>{BALL}</body>
      </frame></body></body>
  <body name="free" pos="1 2 3"><freejoint/>{BALL}</body>
  <body name="marker" mocap="true" pos="0 1 0"/>
</worldbody>
<keyframe><key name="home" qpos="0.3 0.4 0 1 0 0 1 1 2 3 0 1 0 0"/></keyframe></mujoco>"""
PART = f'<mujoco><worldbody><body name="included"><joint name="knee"/>{BALL}</body></worldbody></mujoco>'


def pose_of_pin(compiled, qpos):
    """A `qpos` of MuJoCo with the quaternions of ball and free joints as (x, y, z, w)."""
    q = np.array(qpos)
    for joint in range(compiled.njnt):
        kind, first = compiled.jnt_type[joint], compiled.jnt_qposadr[joint]
        if kind < 2:
            part = slice(first + 3 - 3 * kind, first + 7 - 3 * kind)
            q[part] = np.roll(q[part], -1)
    return q


def random_qpos(compiled, seed: int):
    """Coordinates in −1 to 1, with unit quaternions."""
    data = mujoco.MjData(compiled)
    data.qpos[:] = np.random.default_rng(seed).uniform(-1.0, 1.0, compiled.nq)
    mujoco.mj_normalizeQuat(compiled, data.qpos)
    return data.qpos.copy()


def farthest(path: Path, arm: Robot) -> float:
    """Largest difference of a body's or site's pose from MuJoCo's."""
    compiled = mujoco.MjModel.from_xml_path(str(path))
    data, worst = mujoco.MjData(compiled), 0.0
    for seed in range(3):
        data.qpos[:] = random_qpos(compiled, seed)
        mujoco.mj_kinematics(compiled, data)
        at = Configuration(arm, pose_of_pin(compiled, data.qpos))
        for kind, positions, turns in (
            ("body", data.xpos, data.xmat),
            ("site", data.site_xpos, data.site_xmat),
        ):
            for i in range(kind == "body", getattr(compiled, f"n{kind}")):
                name = getattr(compiled, kind)(i).name or f"body{i}"
                pose = at.pose(name)
                worst = max(worst, np.abs(pose[:3, 3] - positions[i]).max())
                worst = max(worst, np.abs(pose[:3, :3] - turns[i].reshape(3, 3)).max())
    return worst


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    """MuJoCo writes its warnings to a file in the current folder, where the tests call it themselves."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def load(tmp_path) -> Callable[[str], Robot]:
    """Read an MJCF file from a text; "part.xml" is there to be included."""

    def read(text: str, **options) -> Robot:
        (tmp_path / "arm.xml").write_text(text)
        (tmp_path / "part.xml").write_text(PART)
        return Robot.from_mjcf(tmp_path / "arm.xml", **options)

    return read


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_bodies_are_where_mujoco_places_them(path):
    """Poses of all bodies and sites at random coordinates, to 1e-9 of MuJoCo's own kinematics."""
    arm = Robot.from_mjcf(path)
    compiled = mujoco.MjModel.from_xml_path(str(path))
    assert arm.nq == compiled.nq
    assert farthest(path, arm) < 1e-9


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_stack_runs_on_every_file(path):
    """The last body is to stay, the joints are to return: every tick is certified."""
    arm = Robot.from_mjcf(path)
    q, frame = arm.posture("qpos0"), arm.frames[-1]
    stack = Stack(
        [[FrameTask(frame, gain=1.0)], [JointTask(arm.posture("middle"), gain=1.0)]], [JointPositionLimit()]
    )
    controller = Controller(arm, stack, dt=0.01)
    for k in range(5):
        resolution = controller.step(q, 0.01 * k)
        assert resolution.kkt_met()
        q = arm.integrate(q, resolution.v, 0.01)


def test_a_file_that_makes_use_of_everything_is_right(load, tmp_path):
    """Includes, defaults, frames, references, anchors, several joints of a body, degrees, a second tree."""
    arm = load(EVERYTHING)
    assert farthest(tmp_path / "arm.xml", arm) < 1e-14
    assert arm.joints == ("knee", "along", "swing", "wrist", "free_joint")
    assert arm.velocity_names[1:3] == ("along", "swing")
    assert arm.coordinate_units[:3] == ("rad", "m", "rad")
    np.testing.assert_allclose(
        [arm.position_lower[1:3], arm.position_upper[1:3]], [[-1, -np.pi / 2], [2, np.pi / 2]]
    )
    assert not np.isfinite(arm.velocity_limit).any()


def test_keyframes_and_the_reference_are_postures(load):
    """With MuJoCo's quaternions normalised and put into Pinocchio's order."""
    arm, half = load(EVERYTHING), np.sqrt(0.5)
    home = [0.3, 0.4, 0, 0, 0, half, half, 1, 2, 3, 1, 0, 0, 0]
    np.testing.assert_allclose(arm.posture("home"), home, atol=1e-15)
    np.testing.assert_allclose(arm.posture("qpos0")[:3], [0.0, 0.2, np.pi / 6])


def test_keyframes_that_are_not_as_one_would_expect_are_said(load):
    """One has the name of a posture that every robot has, one lies outside the ranges."""
    text = """<mujoco><worldbody><body><joint name="knee" range="0.2 1" limited="true" axis="0 0 1"/>
      <geom size="0.1"/></body></worldbody><compiler angle="radian"/>
      <keyframe><key name="neutral" qpos="0.5"/><key name="far" qpos="3"/></keyframe></mujoco>"""
    with pytest.warns(DroppedWarning, match="outside the ranges"):
        arm = load(text)
    assert arm.posture("keyframe neutral")[0] == 0.5
    assert arm.posture("neutral")[0] != 0.5
    assert arm.posture("far")[0] == 3.0
    assert [line for line in arm.dropped if "keyframe" in line] == [
        "the keyframe 'neutral' is the posture 'keyframe neutral', since every robot has a 'neutral'",
        "the keyframe 'far' is outside the ranges of the joints",
    ]


def test_mass_and_its_centre_are_those_of_mujoco(load, tmp_path):
    """Welded bodies count; what stands in the world does not."""
    arm = load(EVERYTHING)
    compiled = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    data = mujoco.MjData(compiled)
    data.qpos[:] = random_qpos(compiled, 5)
    mujoco.mj_fwdPosition(compiled, data)
    at = Configuration(arm, pose_of_pin(compiled, data.qpos))
    np.testing.assert_allclose(at.centre_of_mass()[0], data.subtree_com[0], atol=1e-12)
    assert arm.mass == pytest.approx(compiled.body_subtreemass[0])


def test_shapes_are_where_mujoco_places_them(load, tmp_path):
    """Spheres and a capsule, on their joints; the floor is named as no part of the robot."""
    arm = load(EVERYTHING)
    compiled = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    data = mujoco.MjData(compiled)
    data.qpos[:] = random_qpos(compiled, 6)
    mujoco.mj_kinematics(compiled, data)
    places = arm.geometry.createData()
    q = pose_of_pin(compiled, data.qpos)
    pin.updateGeometryPlacements(arm.model, arm.model.createData(), arm.geometry, places, q)
    on_bodies = compiled.geom_bodyid > 0
    np.testing.assert_allclose([p.translation for p in places.oMg], data.geom_xpos[on_bodies], atol=1e-14)
    np.testing.assert_allclose(
        [p.rotation.ravel() for p in places.oMg], data.geom_xmat[on_bodies], atol=1e-14
    )
    assert any("floor" in sentence for sentence in arm.dropped)


GEOMS = {
    "one": '<geom type="sphere" size="0.1"/><geom type="capsule" size="0.1 0.2"/>',
    "two": '<geom type="cylinder" size="0.1 0.2"/><geom type="box" size="0.1 0.2 0.3"/>',
    "three": '<geom type="ellipsoid" size="0.1 0.2 0.3"/><geom type="mesh" mesh="wedge"/>',
}
BODIES = "".join(f'<body name="{name}"><joint type="slide"/>{geoms}</body>' for name, geoms in GEOMS.items())
APART = '<exclude body1="one" body2="two"/><exclude body1="three" body2="one"/>'
SHAPES = f"""<mujoco><asset><mesh name="wedge" vertex="0 0 0 0.1 0 0 0 0.2 0 0 0 0.3"/></asset>
<worldbody>{BODIES}</worldbody><contact>{APART}</contact></mujoco>"""


def test_shapes_have_the_size_that_mujoco_gives_them(load, tmp_path):
    """The box around each solid in its own axes, as MuJoCo compiled it."""
    arm = load(SHAPES)
    compiled = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    assert arm.geometry.ngeoms == compiled.ngeom == 6
    for shape, box in zip(arm.geometry.geometryObjects, compiled.geom_aabb, strict=True):
        shape.geometry.computeLocalAABB()
        bounds = np.array([shape.geometry.aabb_local.min_, shape.geometry.aabb_local.max_])
        np.testing.assert_allclose(bounds, [box[:3] - box[3:], box[:3] + box[3:]], atol=1e-6)


def test_pairs_are_those_that_the_file_does_not_exclude(load):
    """Bodies two and three may touch: four pairs of shapes."""
    names = ("one", "two", "three")
    arm = load(SHAPES)
    shapes = [shape.parentJoint for shape in arm.geometry.geometryObjects]
    pairs = {(names[shapes[p.first] - 1], names[shapes[p.second] - 1]) for p in arm.geometry.collisionPairs}
    assert pairs == {("two", "three")}
    assert len(arm.geometry.collisionPairs) == 4


def fingers(equality: str, joints: str = "a b c") -> str:
    """Hinges side by side and an equality."""
    bodies = "".join(
        f'<body name="{j}"><joint name="{j}" ref="0.1" range="-1 1"/>{BALL}</body>' for j in joints.split()
    )
    inner = f"<worldbody>{bodies}</worldbody><equality>{equality}</equality>"
    return f'<mujoco><compiler angle="radian"/>{inner}</mujoco>'


def test_linear_equalities_of_joints_are_couplings(load):
    """b − ref = 0.2 + 2 (a − ref), and c follows b: both lead to a, with their references."""
    of_b = '<joint joint1="b" joint2="a" polycoef="0.2 2 0 0 0"/>'
    arm = load(fingers(of_b + '<joint joint1="c" joint2="b" polycoef="0 -1 0 0 0"/>'))
    b, c = arm.couplings
    assert (b.follower, b.leader, c.follower, c.leader) == ("b", "a", "c", "a")
    np.testing.assert_allclose([b.multiplier, b.offset, c.multiplier, c.offset], [2.0, 0.1, -2.0, 0.1])
    v = Controller(arm, Stack([[JointTask([0.3], joints=["a"], gain=1.0)]]), dt=0.01).step(arm.neutral, 0.0).v
    np.testing.assert_allclose(v, [0.3, 0.6, -0.6], atol=1e-12)


def test_a_joint_that_an_equality_holds_is_fixed(load):
    """At its reference and the constant of the polynomial; an equality that is switched off does nothing."""
    arm = load(
        fingers('<joint joint1="a" polycoef="0.2 0 0 0 0"/><joint joint1="b" joint2="c" active="false"/>')
    )
    assert (arm.joints, arm.couplings) == (("b", "c"), ())
    turn = Configuration(arm, arm.neutral).pose("a")[:3, :3]
    np.testing.assert_allclose(turn[1, 0], np.sin(0.2))


@pytest.mark.parametrize(
    ("equality", "said"),
    [
        ('<joint joint1="a" joint2="b" polycoef="0 1 0.5 0 0"/>', "joint a follows a polynomial"),
        ('<connect body1="a" body2="b" anchor="0 0 0"/>', r"a loop of bodies .*LoopTask"),
        ('<weld body1="a" body2="b"/>', r"a loop of bodies .*LoopTask"),
    ],
)
def test_equalities_that_are_not_held_are_said(load, equality, said):
    """One that is no line, and the two that close loops."""
    with pytest.warns(DroppedWarning, match=said):
        assert load(fingers(equality)).couplings == ()


def test_that_no_velocities_and_accelerations_are_limited_is_said_once(load):
    """In `dropped` and in the one warning, at the line that reads the file."""
    with pytest.warns(DroppedWarning) as warned:
        arm = load(fingers(""))
    assert len(warned) == 1
    assert len(arm.dropped) == 1
    assert "no velocity limits and no acceleration limits" in arm.dropped[0]


@pytest.mark.parametrize(
    ("text", "error", "said"),
    [
        ("<mujoco", InvalidValue, "not XML"),
        ("<robot name='a'/>", InvalidValue, r"root element is <robot>.*Robot\.from_urdf"),
        (
            "<mujoco><worldbody><body><geom size='1'/></body></worldbody></mujoco>",
            InvalidValue,
            "no joint that moves",
        ),
        ("<mujoco><worldbody><body><joint type='screw'/></body></worldbody></mujoco>", InvalidValue, "screw"),
        ("<mujoco><include file='not_here.xml'/></mujoco>", MissingFile, r"not_here\.xml"),
        (
            fingers('<joint joint1="a" joint2="b"/><joint joint1="b" joint2="a"/>'),
            InvalidValue,
            "mimics itself",
        ),
    ],
)
def test_a_file_that_cannot_be_read_is_refused(load, text, error, said):
    """By errors of taskopt's that name the file."""
    with pytest.raises(error, match=f"arm.xml.*{said}"):
        load(text)


def test_a_joint_can_be_locked_on_loading(load):
    """And one that is not there is unknown."""
    assert load(fingers(""), lock=["b"]).joints == ("a", "c")
    with pytest.raises(UnknownName, match="joint named 'd'"):
        load(fingers(""), lock=["d"])


def test_without_mujoco_the_extra_is_named(load, monkeypatch):
    """The error has the line that installs it."""
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(NotInstalled, match=r"mujoco.*pip install 'taskopt\[mujoco\]'"):
        load(EVERYTHING)


def test_couplings_that_do_not_fit_are_refused():
    """A name that is not there, something else than a coupling, a joint with several axes."""
    model = pin.Model()
    for i, kind in enumerate((pin.JointModelRX(), pin.JointModelSpherical())):
        model.addJoint(i, kind, pin.SE3.Identity(), "ab"[i])
    for couplings, error in (
        ([Coupling("a", "c")], UnknownName),
        (["a"], InvalidValue),
        ([Coupling("a", "b")], InvalidValue),
    ):
        with pytest.raises(error, match=r"'c'|Coupling|several axes"):
            Robot(model, couplings=couplings)


def test_what_mujoco_warns_of_is_said_and_leaves_no_file(load, tmp_path, monkeypatch):
    """An attribute that is going out of use: MuJoCo would append to a log in the current folder."""
    monkeypatch.chdir(tmp_path)
    arm = load(fingers("").replace("<compiler ", '<compiler settotalmass="3" '))
    assert any(s.startswith("MuJoCo warns: ") and "settotalmass" in s for s in arm.dropped)
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_shapes_survive_a_pickle_of_the_parts(load):
    """The compiled file goes along, so that another process has the shapes without the file."""
    load(SHAPES)
    parts = read_mjcf("arm.xml")
    again = pickle.loads(pickle.dumps(parts.geometry))
    for one, other in zip(again().geometryObjects, parts.geometry().geometryObjects, strict=True):
        assert (one.name, one.parentJoint) == (other.name, other.parentJoint)
        np.testing.assert_array_equal(one.placement.homogeneous, other.placement.homogeneous)


def test_shapes_stay_where_they_are_when_a_joint_is_locked(load):
    """Also on a body that shares its name with its joint."""
    arm = load(EVERYTHING)
    q = arm.posture("home")
    still = arm.lock(["swing"], q)
    centres = []
    for robot, at in ((arm, q), (still, np.delete(q, 2))):
        places = robot.geometry.createData()
        pin.updateGeometryPlacements(robot.model, robot.model.createData(), robot.geometry, places, at)
        centres.append(
            {s.name: p.translation for s, p in zip(robot.geometry.geometryObjects, places.oMg, strict=True)}
        )
    assert centres[0].keys() == centres[1].keys()
    for name, centre in centres[0].items():
        np.testing.assert_allclose(centres[1][name], centre, atol=1e-14)
