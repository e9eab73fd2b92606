"""A robot as plain data: made again, it has the same joints, frames and limits, to the last bit."""

import json

import numpy as np
import pytest

from taskopt import Robot, planar_arm, scara
from taskopt.errors import BadLog
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot.tree import robot_of, tree_of

ROBOTS = {
    "panda": lambda: Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2")),
    "tiago": lambda: Robot.load("tiago_dual"),
    "walker": lambda: Robot.load("talos_reduced"),
    "arm": lambda: planar_arm([0.5, 0.4, 0.3], lower=-3.0, upper=2.0, radius=0.01),
    "scara": lambda: scara(0.5, 0.5, height=1.0, velocity=1.5),
}


def through_json(robot: Robot) -> Robot:
    return robot_of(json.loads(json.dumps(tree_of(robot))))


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_frames_are_where_they_were_and_limits_are_the_same(name: str) -> None:
    """At random postures, all frames of the robot."""
    robot = ROBOTS[name]()
    again = through_json(robot)
    assert again.velocity_names == robot.velocity_names
    for limit in ("position_lower", "position_upper", "velocity_limit", "position_index"):
        np.testing.assert_array_equal(getattr(again, limit), getattr(robot, limit))
    rng = np.random.default_rng(1)
    for _ in range(5):
        q = robot.integrate(robot.neutral, rng.normal(size=robot.nv), 1.0)
        one, other = Configuration(robot, q), Configuration(again, q)
        for frame in robot.frames:
            np.testing.assert_array_equal(one.pose(frame), other.pose(frame))


def test_an_arm_made_in_code_keeps_its_capsules() -> None:
    """Radius, length, place and colour of each."""
    robot = ROBOTS["arm"]()
    again = through_json(robot)
    for old, new in zip(robot.visual.geometryObjects, again.visual.geometryObjects, strict=True):
        one, other = old.geometry, new.geometry
        assert (one.radius, one.halfLength) == (other.radius, other.halfLength)
        np.testing.assert_array_equal(old.placement.homogeneous, new.placement.homogeneous)
        np.testing.assert_array_equal(old.meshColor, new.meshColor)


def test_a_robot_of_unknown_name_gets_a_capsule_along_each_link() -> None:
    """Not the meshes of another robot; a Panda with another name, and one whose link is longer."""
    tree = tree_of(Robot.load("panda"))
    renamed = robot_of({**tree, "name": "mine"})
    longer = json.loads(json.dumps(tree))
    longer["joints"][3]["pose"][1][3] += 0.01
    for robot in (renamed, robot_of(longer)):
        assert {type(shape.geometry).__name__ for shape in robot.visual.geometryObjects} == {"Capsule"}


def test_a_kind_of_joint_that_is_not_known_is_refused() -> None:
    """By its name, and that of its joint."""
    tree = tree_of(ROBOTS["arm"]())
    tree["joints"][1]["kind"] = "JointModelHinge"
    with pytest.raises(BadLog, match="joint2 is a JointModelHinge"):
        robot_of(tree)
