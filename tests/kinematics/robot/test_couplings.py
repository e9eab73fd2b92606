"""Joints that mimic others follow them: in postures, in every stack, and when one of them is locked."""

import numpy as np
import pytest

from taskopt import (
    Controller,
    FrameTask,
    JointAccelerationLimit,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Stack,
)
from taskopt.errors import InvalidValue
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.robot.couplings import Coupling
from taskopt.testing import check_limit, check_task
from tests.helpers.urdf_text import LIMIT, PAN, joint, robot, written


def mimic(leader: str, multiplier: float = 1.0, offset: float = 0.0, limit: str = LIMIT) -> str:
    """A limit and the element that couples a joint."""
    return limit + f'<mimic joint="{leader}" multiplier="{multiplier}" offset="{offset}"/>'


def finger(name: str, inner: str, parent: str = "upper") -> str:
    """A joint with a link of its own."""
    return joint(name, parent, f"{name}_link", inner, axis="0 1 0")


def gripper(*followers: tuple[str, str]) -> str:
    """A joint "pan" and fingers on the link that it carries."""
    links = " ".join(f"{name}_link" for name, _ in followers)
    return robot(PAN, *(finger(name, inner) for name, inner in followers), links=f"base upper {links}")


@pytest.fixture
def load(tmp_path):
    """Read a URDF from a text."""
    return lambda text, **options: Robot.from_urdf(written(tmp_path, text), **options)


CHAIN = (
    ("a", mimic("pan", -2.0, 0.5)),
    ("b", mimic("a", 0.5, 0.1)),
)  # a = −2 p + ½, b = ½ a + 0.1 = −p + 0.35


def test_a_mimic_of_a_mimic_leads_to_the_joint_that_moves(load):
    """Composition of linear maps, with a negative factor and two offsets, in either order of the file."""
    for followers in (CHAIN, CHAIN[::-1]):
        arm = load(gripper(*followers))
        found = {c.follower: c for c in arm.couplings}
        assert set(found) == {"a", "b"}
        assert found["a"] == Coupling("a", "pan", multiplier=-2.0, offset=0.5)
        b = found["b"]
        np.testing.assert_allclose([b.multiplier, b.offset], [-1.0, 0.35])
        assert b.leader == "pan"


def test_every_named_posture_satisfies_the_couplings(load, tmp_path):
    """Neutral, middle, and a posture of the SRDF that states a wrong value of a follower."""
    values = '<joint name="pan" value="0.5"/><joint name="a" value="0.9"/>'
    srdf = f'<robot name="arm"><group_state name="home">{values}</group_state></robot>'
    arm = load(gripper(*CHAIN), srdf=written(tmp_path, srdf, "arm.srdf"))
    for q in arm.postures.values():
        np.testing.assert_allclose(q[1:], [-2.0 * q[0] + 0.5, -q[0] + 0.35], atol=1e-15)
    assert arm.posture("home")[0] == 0.5
    assert arm.outside(arm.posture("middle")) == ()


def test_the_range_of_a_leader_is_where_all_followers_are_in_theirs(load):
    """Each range is −1 to 2: a = −2 p + ½ allows p from −0.75 to 0.75, b = −p + 0.35 from −1.65 to 1.35."""
    arm = load(gripper(*CHAIN))
    np.testing.assert_allclose([arm.position_lower[0], arm.position_upper[0]], [-0.75, 0.75])


def test_ranges_that_contradict_each_other_are_said(load):
    """An offset beyond the follower's range leaves the leader nothing: its own range stays."""
    with pytest.warns(UserWarning, match="joint a mimics pan beyond its own range"):
        arm = load(gripper(("a", mimic("pan", 1.0, 9.0))))
    assert (arm.position_lower[0], arm.position_upper[0]) == (-1.0, 2.0)


def test_every_stack_holds_the_couplings(load):
    """A task that pulls one finger alone moves all of them, proven, with rows named after the followers."""
    arm = load(gripper(*CHAIN))
    q = arm.posture("middle")
    stack = Stack(
        [[JointTask([1.0], joints=["a"], gain=2.0)], [JointTask(gain=1.0)]],
        [JointPositionLimit(), JointVelocityLimit()],
    )
    controller = Controller(arm, stack, dt=0.01)
    for k in range(100):
        resolution = controller.step(q, 0.01 * k)
        v = resolution.v
        assert resolution.kkt_met()
        np.testing.assert_allclose(v[1:], [-2.0 * v[0], -v[0]], atol=1e-12)
        q = arm.integrate(q, v, 0.01)
    assert abs(q[1] - 1.0) < 0.1
    np.testing.assert_allclose(q, arm.coupled(q), atol=1e-12)
    block = next(block for block in resolution.problem.layout.blocks if block.name == "coupling")
    assert (block.level, block.row_names) == (0, ("a", "b"))


def test_a_gap_that_is_measured_stays_and_blocks_nothing(load):
    """From a posture that contradicts the coupling, the joints still move together."""
    arm = load(gripper(("a", mimic("pan"))))
    q = np.array([0.2, 0.9])
    v = Controller(arm, Stack([[JointTask(np.array([0.5, 1.2]), gain=1.0)]]), dt=0.01).step(q, 0.0).v
    assert v[0] > 0.1
    assert abs(v[1] - v[0]) < 1e-12


@pytest.mark.parametrize("locked", ["pan", "a", "b"])
def test_locking_one_joint_of_a_coupling_locks_all(load, locked):
    """The followers are held where the leader puts them."""
    arm = load(
        robot(
            PAN,
            *(finger(*f) for f in CHAIN),
            finger("free", LIMIT),
            links="base upper a_link b_link free_link",
        )
    )
    q = arm.coupled(np.array([0.3, 0.0, 0.0, 0.1]))
    still = arm.lock([locked], q)
    assert (still.joints, still.couplings) == (("free",), ())
    for frame in ("a_link", "b_link"):
        pose = Configuration(arm, q).pose(frame)
        np.testing.assert_allclose(Configuration(still, [0.1]).pose(frame), pose, atol=1e-14)


def test_a_joint_that_follows_a_fixed_one_is_fixed(load):
    """The coordinate of a fixed joint is 0: who follows stands at the offset, and so does its follower."""
    held = joint("held", "base", "held_link", "", "fixed")
    fingers = [finger("a", mimic("held", 3.0, 0.4), "base"), finger("b", mimic("a", 2.0), "base")]
    arm = load(robot(PAN, held, *fingers, links="base upper held_link a_link b_link"))
    assert (arm.joints, arm.couplings) == (("pan",), ())
    turned = Configuration(arm, [0.0]).pose("b_link")[:3, :3]
    np.testing.assert_allclose(turned[0, 2], np.sin(0.8))


def test_wheels_and_slides_are_coupled(load):
    """A continuous joint that follows a slide: its angle stands in q as cosine and sine."""
    rack = joint("rack", "base", "upper", LIMIT, "prismatic")
    wheel = joint("wheel", "upper", "lower", '<mimic joint="rack" multiplier="10"/>', "continuous", "0 1 0")
    arm = load(robot(rack, wheel))
    q = arm.coupled(np.array([0.05, 1.0, 0.0]))
    np.testing.assert_allclose(q, [0.05, np.cos(0.5), np.sin(0.5)])
    v = (
        Controller(
            arm, Stack([[FrameTask("upper", axes="z", target=np.array([0, 0, 0.36]), gain=1.0)]]), dt=0.01
        )
        .step(q, 0.0)
        .v
    )
    np.testing.assert_allclose(v, [0.01, 0.1], atol=1e-12)
    moved = arm.integrate(q, v, 0.01)
    np.testing.assert_allclose(moved, arm.coupled(moved), atol=1e-12)


def test_a_circle_of_mimics_is_refused(load):
    """No joint of it leads."""
    with pytest.raises(InvalidValue, match="joint 'a' mimics itself, through a, b"):
        load(gripper(("a", mimic("b")), ("b", mimic("a"))))


def test_the_fingers_of_the_panda_close_together():
    """A robot of the extra: one coupling, and a task for one finger moves both."""
    arm = Robot.load("panda")
    assert arm.couplings == (Coupling("panda_finger_joint2", "panda_finger_joint1"),)
    task = JointTask(np.array([0.01]), joints=["panda_finger_joint1"], gain=1.0)
    v = Controller(arm, Stack([[task]]), dt=0.01).step(arm.posture("middle"), 0.0).v
    np.testing.assert_allclose(v[7:], [-0.01, -0.01], atol=1e-12)


@pytest.mark.slow
def test_own_tasks_and_limits_are_checked_on_a_robot_with_couplings():
    """The rows of the couplings are not taken for those of the task or limit that is checked."""
    arm = Robot.load("panda")
    check_task(FrameTask("panda_hand", gain=1.0), arm)
    check_limit(JointPositionLimit(), arm)
    check_limit(JointAccelerationLimit(5.0), arm)
