"""Which pairs of shapes are kept apart, and what is said about the others."""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import numpy as np
import pinocchio as pin
import pytest

from taskopt import SelfCollisionLimit
from taskopt.errors import InvalidValue
from taskopt.kinematics.collision import always_near as proof
from taskopt.kinematics.collision.choice import choose_pairs, named_choice
from taskopt.kinematics.geometry.coal import solid
from taskopt.kinematics.robot import Robot, planar_arm
from taskopt.kinematics.robot.random_posture import random_posture
from tests.helpers.robots import robot


def joints_of(of, pairs):
    """The joints that carry the shapes of some pairs."""
    shapes = of.geometry.geometryObjects
    return {(shapes[i].parentJoint, shapes[j].parentJoint) for i, j in pairs}


def left_out(choice, reason):
    """The pairs that a choice left out for a reason."""
    return next((pairs for text, pairs in choice.left_out if text.startswith(reason)), ())


def test_the_panda_has_the_44_pairs_of_its_srdf():
    """Whatever else is a neighbour or on one body is disabled there, too; locking the fingers keeps them."""
    choice = choose_pairs(Robot.load("panda"))
    assert len(choice.pairs) == 44
    assert str(choice).startswith("44 of 136 pairs of shapes; left out: 55 disabled by the robot, ")
    assert len(choose_pairs(robot("panda")).pairs) == 44


def test_neighbours_are_left_out():
    """An arm of five links has all pairs but the four of neighbours."""
    of = planar_arm([0.3] * 5, radius=0.01)
    choice = choose_pairs(of)
    assert joints_of(of, choice.pairs) == {(1, 3), (1, 4), (1, 5), (2, 4), (2, 5), (3, 5)}
    assert str(choice) == "6 of 10 pairs of shapes; left out: 4 of neighbours"


def test_links_between_which_there_is_no_shape_are_neighbours():
    """A wrist of three axes at one place has shapes on its last body only."""
    of = planar_arm([0.3] * 5, radius=0.01)
    few = pin.GeometryModel()
    for shape in of.geometry.geometryObjects:
        if shape.parentJoint != 3:
            few.addGeometryObject(shape)
    bare = Robot(of.model, few)
    assert joints_of(bare, choose_pairs(bare).pairs) == {(1, 4), (1, 5), (2, 5)}


def test_pairs_that_always_overlap_are_left_out():
    """Links 1 and 3 with a stub between them that is shorter than they are thick always overlap."""
    of = planar_arm([0.5, 0.01, 0.5, 0.5], radius=0.03)
    choice = choose_pairs(of)
    assert joints_of(of, choice.pairs) == {(1, 4), (2, 4)}
    assert joints_of(of, left_out(choice, "within 0 m in every posture")) == {(1, 3)}


def farthest(of, pairs, count):
    """The largest distance of each pair in random postures, measured by Coal on the shapes themselves."""
    shapes, data, rng = solid(of.geometry), of.model.createData(), np.random.default_rng(3)
    for pair in pairs:
        shapes.addCollisionPair(pin.CollisionPair(*pair))
    memory, out = shapes.createData(), np.full(len(pairs), -np.inf)
    for _ in range(count):
        pin.computeDistances(of.model, data, shapes, memory, random_posture(of, rng))
        out = np.maximum(out, [result.min_distance for result in memory.distanceResults])
    return out


@pytest.mark.parametrize(("name", "clearance"), [("tiago", 0.01), ("tiago", 0.03), ("talos_reduced", 0.05)])
def test_what_is_proven_to_be_near_is_near_in_random_postures(name, clearance):
    """The bound from lengths is above every distance that Coal measures, and it is no empty claim."""
    of = Robot.load(name)
    pairs = left_out(choose_pairs(of, clearance), "within")
    assert len(pairs) >= 2
    assert (farthest(of, pairs, 100) <= clearance + 1e-6).all()


def test_a_bound_from_wrong_lengths_is_caught(monkeypatch):
    """Without the way from joint to joint, pairs that come apart would pass for near ones."""
    between = proof._Chains.between

    def without_way(self, first, second):
        start, _, stop = between(self, first, second)
        return start, 0.0, stop

    monkeypatch.setattr(proof._Chains, "between", without_way)
    of = Robot.load("tiago")
    assert farthest(of, left_out(choose_pairs(of, 0.01), "within"), 20).max() > 0.1


def test_a_sliding_joint_is_as_long_as_its_range():
    """Nothing is proven near across a slide without a limit."""
    of = robot("tiago_dual")
    chains = proof._Chains(of)
    torso = of.joint_id("torso_lift_joint")
    start, length, stop = chains.between(0, torso)
    lift = max(abs(of.position_lower[of.velocity_index("torso_lift_joint")]), of.position_upper[12])
    assert length == pytest.approx(float(lift))
    np.testing.assert_array_equal(start, of.model.jointPlacements[torso].translation)
    np.testing.assert_array_equal(stop, np.zeros(3))


def test_a_sample_is_taken_only_if_asked_for_and_is_told():
    """The box around a hand of TIAGo holds its fingers, which no length proves."""
    of = Robot.load("tiago")
    choice = choose_pairs(of, 0.01)
    assert "sampled" not in str(choice)
    asked = SelfCollisionLimit(sampled=50, seed=4).choice(of)
    near = left_out(asked, "within 0.01 m in 50 sampled postures (seed 4), at most ")
    assert near
    assert set(choice.pairs) - set(asked.pairs) == set(near)
    assert (farthest(of, near, 20) <= 0.01).all()


def test_named_pairs_say_how_many_are_left():
    """Eight pairs of the hand's fingers and the base."""
    of = Robot.load("panda")
    names = [("panda_link0", "panda_leftfinger"), ("panda_link0", "panda_rightfinger")]
    assert str(named_choice(of, names)) == "8 of 136 pairs of shapes; left out: 128 not named"
    with pytest.raises(InvalidValue, match="sampled must be a number of postures"):
        SelfCollisionLimit(sampled=-1)
