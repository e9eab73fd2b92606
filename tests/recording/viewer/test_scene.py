"""The 3D scene: robots where their kinematics says, apart from each other, paths and ellipsoids exact."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt import InvalidValue, Line, ObstacleLimit, Sphere, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.pose import exp3
from taskopt.kinematics.robot import Robot
from taskopt.loop.run import run
from taskopt.recording.log import Log
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.arrangement import Arrangement
from taskopt.recording.viewer.ellipsoids import quaternion as quaternion_of
from taskopt.recording.viewer.robot3d import RobotDrawing
from taskopt.recording.viewer.robot3d import triangles as triangles_of
from taskopt.recording.viewer.scene import desired_paths
from taskopt.resolver.registry import resolver
from tests.helpers.rrd import batches, entities, rows_of

WORLD = "/world/active-set"


def turned(quaternion):
    """(3, 3) of a unit quaternion xyzw."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


@given(st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3), st.booleans())
def test_the_axes_of_an_ellipsoid_survive_as_a_quaternion(omega, mirrored):
    """R diag(s²) Rᵀ is the same from the quaternion, for proper rotations and for mirrored axes."""
    R = exp3(np.array(omega))
    axes = R * [1.0, 1.0, -1.0] if mirrored else R
    shape = np.diag([4.0, 2.0, 1.0])
    quaternion = quaternion_of(axes)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-12)
    Q = turned(quaternion)
    np.testing.assert_allclose(Q @ shape @ Q.T, axes @ shape @ axes.T, atol=1e-9)


@pytest.mark.equation("3.123", "3.126")
def test_the_ellipsoids_are_those_of_velocity_and_force(folder, steps, info):
    """Semi-axes are proportional to σ and 1/σ of the positional Jacobian, centred on the frame, along U.

    The numbers that a selection shows are the semi-axes themselves, their directions, and w.
    """
    for name, power in (("velocity", 1.0), ("force", -1.0)):
        rows = rows_of(folder / "run.rrd", f"{WORLD}/ellipsoid/{name}")
        shown = next(rows[key] for key in rows if key.startswith("semi_axes"))
        assert len(rows["tick"]) > 5
        scales = []
        for k, tick in enumerate(rows["tick"]):
            at = Configuration(info.scenario.robot, steps["active-set"][tick].q)
            J = at.jacobian("tip")[:3]
            sigma = np.linalg.svd(J, compute_uv=False)[:2]  # the planar arm cannot move along z
            scales.append(rows["half_sizes"][k][0][0] / sigma[0] ** power)
            np.testing.assert_allclose(np.array(shown[k])[:2], sigma**power, rtol=1e-9)
            axes = np.reshape(rows["axes"][k], (3, 3)).T[:, :2]
            np.testing.assert_allclose(axes @ np.diag(sigma**2) @ axes.T, J @ J.T, atol=1e-9)
            np.testing.assert_allclose(rows["centers"][k][0], at.pose("tip")[:3, 3], atol=1e-6)
        if name == "velocity":
            np.testing.assert_allclose(scales, scales[0], rtol=1e-5)
            np.testing.assert_allclose(np.ravel(rows["manipulability"]), 0.0, atol=1e-12)


@pytest.mark.slow
@pytest.mark.figure("3.7")
def test_the_trail_of_an_elbow_is_its_path(info, tmp_path):
    """Segments join the places of the frame at the ticks that are drawn, end to end."""
    scenario = replace(info.scenario, trails=["joint3"])
    made = RunInfo(scenario, ("active-set",))
    taken = []
    with Log(made, tmp_path) as log:
        for step in run(scenario, resolver("active-set")):
            taken.append(step.q.copy())
            log.write(step)
    rows = rows_of(tmp_path / "run.rrd", f"{WORLD}/trail/joint3")
    strips = np.array([strip[0] for strip in rows["strips"]])
    assert len(strips) > 5
    np.testing.assert_allclose(strips[1:, 0], strips[:-1, 1], atol=1e-6)
    for tick, strip in zip(rows["tick"], strips, strict=True):
        elbow = Configuration(scenario.robot, taken[tick]).pose("joint3")[:3, 3]
        np.testing.assert_allclose(strip[1], elbow, atol=1e-6)


def test_an_obstacle_that_moves_is_drawn_where_it_is(info, tmp_path):
    """At each drawn tick the ball is where its target puts it; a rock has one pose for good."""
    ball, rock = Sphere([2.0, 0.0, 0.0], 0.1, name="ball"), Sphere([0.0, 2.0, 0.0], 0.1, name="rock")
    limit = ObstacleLimit([ball, rock], moving={"ball": Line(by=[0.0, 0.5, 0.0], duration=0.2)})
    stack = replace(info.scenario.stack, limits=[limit])
    scenario = replace(info.scenario, stack=stack, duration=0.2)
    with Log(RunInfo(scenario, ("active-set",)), tmp_path) as log:
        for step in run(scenario, resolver("active-set")):
            log.write(step)
    rows = rows_of(tmp_path / "run.rrd", f"{WORLD}/obstacle/ball")
    shares = np.array(rows["tick"]) * scenario.dt / 0.2
    way = 0.5 * shares**2 * (3.0 - 2.0 * shares)
    drawn = np.array(rows["translation"]).reshape(-1, 3)
    np.testing.assert_allclose(drawn, np.column_stack([np.full_like(way, 2.0), way, 0.0 * way]), atol=1e-6)
    assert drawn[-1, 1] > 0.4
    for name, stands in (("ball", False), ("rock", True)):
        sent = [b.schema.names for b in batches(tmp_path / "run.rrd", f"{WORLD}/obstacle/{name}")]
        static = [column for names in sent if "tick" not in names for column in names]
        assert ("Transform3D:translation" in static) == stands
        assert any("colors" in column for column in static)


def test_trails_are_frames_of_the_robot(info):
    """A name that is none, and a name in place of a list."""
    with pytest.raises(UnknownName, match="elbow"):
        replace(info.scenario, trails=["elbow"])
    with pytest.raises(InvalidValue, match=r"write \['joint3'\]"):
        replace(info.scenario, trails="joint3")


def test_links_are_drawn_where_the_kinematics_puts_them(folder, steps, info):
    """The pose of each joint in the recording is the configuration's, at 100 Hz."""
    robot = info.scenario.robot
    names = [name for name in robot.joints if f"{WORLD}/robot/{name}" in entities(folder / "run.rrd")]
    assert names
    for name in names:
        rows = rows_of(folder / "run.rrd", f"{WORLD}/robot/{name}")
        moving = [k for k, tick in enumerate(rows["tick"]) if tick > 0]
        for k in moving:
            at = Configuration(robot, steps["active-set"][rows["tick"][k]].q)
            pose = at.joint_poses()[robot.joint_id(name)]
            np.testing.assert_allclose(rows["translation"][k][0], pose[:3, 3], atol=1e-6)
            np.testing.assert_allclose(np.reshape(rows["mat3x3"][k][0], (3, 3)).T, pose[:3, :3], atol=1e-6)
        gaps = np.diff([rows["sim_time"][k] for k in moving])
        assert set(gaps) == {10_000_000}


def test_the_trail_is_one_unbroken_path_of_the_frame(folder, steps):
    """Each segment begins where the one before it ended, and ends where the frame is."""
    rows = rows_of(folder / "run.rrd", f"{WORLD}/task/tip\\ position/actual")
    segments = [np.array(strip[0]) for strip in rows["strips"]]
    for before, after in pairwise(segments):
        np.testing.assert_array_equal(before[1], after[0])
    for tick, segment in zip(rows["tick"], segments, strict=True):
        actual = steps["active-set"][tick].actual["tip position"][:3, 3]
        np.testing.assert_allclose(segment[1], actual, atol=1e-6)


def test_the_desired_path_is_the_circle(info):
    """Known before the run: all its points are 0.2 m from one centre."""
    path = desired_paths(info)[0]["tip position"][:, :2]
    rows = np.c_[2 * path, np.ones(len(path))]
    centre = np.linalg.lstsq(rows, (path**2).sum(axis=1), rcond=None)[0][:2]
    np.testing.assert_allclose(np.linalg.norm(path - centre, axis=1), 0.2, atol=1e-9)


@given(
    count=st.integers(1, 9),
    span=st.tuples(*[st.floats(0.2, 3.0)] * 3),
    flat=st.booleans(),
)
def test_no_two_robots_share_their_room(count, span, flat):
    """The boxes of any two places are apart."""
    size = np.array(span)
    place = Arrangement(-0.5 * size, 0.5 * size, flat, count if count <= 3 else -(-count // 2))
    offsets = [place.offset(i) for i in range(count)]
    for i in range(count):
        for j in range(i):
            assert (np.abs(offsets[i] - offsets[j])[:2] >= size[:2]).any()


@pytest.mark.slow
def test_a_mesh_becomes_triangles_with_unit_normals():
    """Of the Panda's hand: every index is a vertex, every used vertex has a normal of length 1, outward."""
    robot = Robot.load("panda")
    form = next(s.geometry for s in robot.visual.geometryObjects if "hand" in s.name)
    vertices, triangles, normals = triangles_of(form)
    assert triangles.min() >= 0
    assert triangles.max() < len(vertices)
    used = np.unique(triangles)
    np.testing.assert_allclose(np.linalg.norm(normals[used], axis=1), 1.0, atol=1e-9)
    outward = ((vertices - vertices.mean(axis=0)) * normals).sum(axis=1)
    assert (outward[used] > 0).mean() > 0.6


@pytest.mark.slow
def test_every_robot_shape_has_a_drawing():
    """Capsules, meshes, boxes, cylinders and spheres all become something that can be seen."""
    drawn: list[str] = []

    class Paper:
        def log_static(self, path, *archetypes):
            drawn.append(path)

    for name in ("panda", "tiago"):
        robot = Robot.load(name)
        for colour in (None, 0x5AA9FFFF):
            drawn.clear()
            RobotDrawing(robot).draw(Paper(), "/robot", colour)
            assert len(set(drawn)) == len(robot.visual.geometryObjects)
