"""Robots with one more frame, or with tighter limits."""

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

from taskopt import Configuration, InvalidValue, PositionTask, Robot, SelfCollisionLimit, Stack, UnknownName
from tests.helpers.robots import FRAMES, generic_q, robot

SHIFT = np.array([0.02, -0.03, 0.2])
TURN = pin.utils.rotate("x", 0.3) @ pin.utils.rotate("z", -1.1)
QUATERNION = pin.Quaternion(TURN).coeffs()  # x, y, z, w
PLACE = pin.SE3(TURN, SHIFT)


@pytest.mark.parametrize("name", FRAMES)
@pytest.mark.parametrize(
    "pose",
    [
        PLACE,
        PLACE.homogeneous,
        (SHIFT, QUATERNION),
        [*SHIFT, *QUATERNION],
        (SHIFT.tolist(), QUATERNION.tolist()),
    ],
)
def test_a_tool_stands_where_it_was_put(name: str, pose: object) -> None:
    """The new frame is the parent's pose times the given one, in whatever form that is written."""
    of, parent = robot(name), FRAMES[name]
    tool = of.with_frame("tool", parent, pose)
    at = Configuration(tool, generic_q(of, 4))
    np.testing.assert_allclose(at.pose("tool"), at.pose(parent) @ PLACE.homogeneous, atol=1e-12)
    assert "tool" not in of.frames
    assert len(tool.geometry.geometryObjects) == len(of.geometry.geometryObjects)
    h = Stack([[PositionTask("tool")]]).at(at, 0.01)
    arm = at.pose("tool")[:3, 3] - at.pose(parent)[:3, 3]
    J = at.jacobian(parent)
    np.testing.assert_allclose(h.A, J[:3] - np.cross(arm, J[3:], axisa=0, axisb=0, axisc=0), atol=1e-12)


def test_a_position_leaves_the_axes_of_the_parent() -> None:
    """Three numbers are a position; the new frame has the parent's axes."""
    at = Configuration(robot("panda").with_frame("tool", "panda_hand", SHIFT), generic_q(robot("panda"), 4))
    np.testing.assert_allclose(at.pose("tool")[:3, :3], at.pose("panda_hand")[:3, :3], atol=1e-12)


def test_limits_become_tighter_and_nothing_else_changes() -> None:
    """Ranges, speeds and margins hold where they were named; the original robot keeps its own."""
    of = robot("panda")
    tight = of.with_limits(
        position={"panda_joint2": (-0.5, 0.25)}, velocity={"panda_joint3": 1.5}, margin={"panda_joint1": 0.4}
    )
    np.testing.assert_allclose(
        tight.position_lower[:3], [of.position_lower[0] + 0.4, -0.5, of.position_lower[2]]
    )
    np.testing.assert_allclose(
        tight.position_upper[:3], [of.position_upper[0] - 0.4, 0.25, of.position_upper[2]]
    )
    assert tight.velocity_limit[2] == 1.5
    np.testing.assert_array_equal(tight.position_upper[3:], of.position_upper[3:])
    np.testing.assert_array_equal(np.delete(tight.velocity_limit, 2), np.delete(of.velocity_limit, 2))
    assert not tight.outside(tight.posture("default"))
    every = of.with_limits(margin=0.05)
    np.testing.assert_allclose(every.position_lower, of.position_lower + 0.05)
    np.testing.assert_allclose(every.position_upper, of.position_upper - 0.05)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"position": {"panda_joint1": (-9.0, 1.0)}}, "panda_joint1 must lie inside"),
        ({"position": {"panda_joint1": (1.0, -1.0)}}, "panda_joint1 must lie inside"),
        ({"velocity": {"panda_joint1": 9.0}}, "at most 2.175"),
        ({"velocity": {"panda_joint1": 0.0}}, "must be > 0"),
        ({"acceleration": {"panda_joint1": 0.0}}, "panda_joint1 must be > 0 and a number"),
        ({"acceleration": {"panda_joint1": float("nan")}}, "acceleration limit of panda_joint1 has NaN$"),
        ({"velocity": 0.5}, "velocity must be a mapping such as .*elbow.*got 0.5"),
        (
            {"velocity": {"panda_joint1": "fast"}},
            "velocity limit of panda_joint1 must be numbers, got 'fast'",
        ),
        ({"acceleration": [1.0, 2.0]}, "acceleration must be a mapping"),
        ({"position": (-1.0, 1.0)}, "position must be a mapping"),
        (
            {"position": {"panda_joint1": 1.0}},
            "range .* of panda_joint1 must have shape 2, got a single number",
        ),
        ({"margin": 3.0}, "panda_joint1 must lie inside"),
        ({"margin": {"panda_joint1": -0.1}}, "margin of panda_joint1 must be ≥ 0"),
        ({"margin": {"panda_joint1": float("nan")}}, "margin of panda_joint1 must be ≥ 0"),
    ],
)
def test_what_is_no_tighter_limit_is_refused(changes: dict, message: str) -> None:
    """What is no tightening is refused by the name of the joint."""
    with pytest.raises(InvalidValue, match=message):
        robot("panda").with_limits(**changes)


def test_unknown_names_and_false_poses_are_refused() -> None:
    """The error names the joint, the frame, or the form of a pose that is expected."""
    of = robot("panda")
    with pytest.raises(UnknownName, match="elbow"):
        of.with_limits(velocity={"elbow": 1.0})
    with pytest.raises(InvalidValue, match="JointModelFreeFlyer with 7 coordinates"):
        robot("talos_reduced").with_limits(position={"root_joint": (0.0, 1.0)})
    with pytest.raises(UnknownName, match="panda_hand"):
        of.with_frame("tool", "panda_hnd", SHIFT)
    with pytest.raises(InvalidValue, match="already"):
        of.with_frame("panda_hand", "panda_link8", SHIFT)
    for wrong, message in (
        ([1.0, 2.0], r"pair \(position, quaternion"),
        ("here", r"pair \(position, quaternion"),
        (([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 2.0]), "norm 1, got 2"),
        (2.0 * np.eye(4), "not a rotation"),
        ([0.0, 0.0, np.nan], "NaN"),
    ):
        with pytest.raises(InvalidValue, match=message):
            of.with_frame("tool", "panda_hand", wrong)


def links(of: Robot) -> set[frozenset[str]]:
    """The pairs of links that a self-collision limit keeps apart."""
    limit = SelfCollisionLimit()
    names = [shape.name.rsplit("_", 1)[0] for shape in of.geometry.geometryObjects]
    return {frozenset((names[i], names[j])) for i, j in limit.choice(of).pairs}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "tiago"])
def test_pairs_that_are_left_out_are_not_kept_apart(name: str) -> None:
    """A pair of links that is named is left out, and so are all pairs of a link that is named alone."""
    of = robot(name)
    before = links(of)
    first, *_, last = sorted(sorted(pair) for pair in before)
    assert links(of.without_collision(tuple(first))) == before - {frozenset(first)}
    alone = last[0]
    after = links(of.without_collision(tuple(first), alone))
    assert after == {pair for pair in before - {frozenset(first)} if alone not in pair}
    assert links(of) == before


def test_false_names_of_links_are_refused() -> None:
    """The error names the link, or the form that is expected."""
    with pytest.raises(UnknownName, match="panda_link5"):
        robot("panda").without_collision(("panda_link55", "panda_link7"))
    with pytest.raises(InvalidValue, match="pairs of names"):
        robot("panda").without_collision(("panda_link5", "panda_link6", "panda_link7"))  # type: ignore[arg-type]


ACCELERATIONS = {"panda_joint2": 7.5, "panda_joint7": 20.0}


@pytest.mark.parametrize(
    "change",
    [
        lambda of: of,
        lambda of: pickle.loads(pickle.dumps(of)),
        copy.deepcopy,
        lambda of: of.with_frame("tool", "panda_hand", SHIFT),
        lambda of: of.without_collision("panda_link5"),
        lambda of: of.with_limits(velocity={"panda_joint1": 1.0}),
        lambda of: of.with_limits(acceleration={"panda_joint1": 9.0}),
        lambda of: of.lock(("panda_joint1", "panda_joint3")),
    ],
)
def test_acceleration_limits_stay_with_their_joints(change: Callable[[Robot], Robot]) -> None:
    """Whatever is made of the robot, each joint has the limit that was named for it, and others have none."""
    of = change(robot("panda").with_limits(acceleration=ACCELERATIONS))
    for joint in set(of.joints) - {"panda_joint1"}:
        limit = of.acceleration_limit[of.velocity_index(joint)]
        np.testing.assert_array_equal(limit, ACCELERATIONS.get(joint, np.inf))
    assert np.isposinf(robot("panda").acceleration_limit).all()
    with pytest.raises(ValueError, match="read-only"):
        of.acceleration_limit[0] = 1.0


def test_a_joint_with_several_velocities_has_one_acceleration_limit_for_each() -> None:
    """All six of a floating base; a limit can be tightened again, and not widened."""
    of = robot("talos_reduced").with_limits(acceleration={"root_joint": 2.0})
    np.testing.assert_array_equal(of.acceleration_limit[:6], 2.0)
    assert np.isposinf(of.acceleration_limit[6:]).all()
    np.testing.assert_array_equal(
        of.with_limits(acceleration={"root_joint": 1.0}).acceleration_limit[:6], 1.0
    )
    with pytest.raises(InvalidValue, match="acceleration limit of root_joint must be > 0 and at most 2"):
        of.with_limits(acceleration={"root_joint": 3.0})
    with pytest.raises(UnknownName, match="root_joint"):
        of.with_limits(acceleration={"root_joiny": 1.0})


def test_no_names_to_lock_are_refused() -> None:
    """None, or a number, is no list of names; the way out is to leave it out."""
    for wrong in (None, 3):
        with pytest.raises(
            InvalidValue, match=r"lock must be names of joints, got .*; leave it out for none"
        ):
            Robot.load("planar3", lock=wrong)  # type: ignore[arg-type]
