"""An unknown name is answered with names of the same meaning, from one table."""

import re

import pytest

import taskopt
from taskopt.errors import UnknownName
from taskopt.resolver.registry import resolver_names
from taskopt.synonyms import SYNONYMS, by_meaning, near_names
from tests.helpers.robots import robot

PARAMETERS = ("hand.gain", "hand.weight", "hand.target", "hand.enabled", "posture.gain", "posture.weight")


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("EndEffectorTask", "FrameTask"),
        ("ik", "solve_pose"),
        ("solve_ik", "solve_pose"),
        ("InverseKinematics", "solve_pose"),
        ("nullspace", "JointTask"),
        ("PostureTask", "JointTask"),
        ("ComTask", "CentreOfMassTask"),
        ("CenterOfMassTask", "CentreOfMassTask"),
        ("ConfigurationLimit", "JointPositionLimit"),
        ("MaxVelocity", "JointVelocityLimit"),
        ("CollisionAvoidanceLimit", "SelfCollisionLimit"),
        ("pinv", "PseudoInverse"),
        ("LevenbergMarquardt", "DampedLeastSquares"),
        ("dls", "DampedLeastSquares"),
        ("JacobianTranspose", "Transpose"),
        ("EqualityConstraintTask", "LoopTask"),
        ("PositionBarrier", "BoxTask"),
        ("Trajectory", "Target"),
        ("load_robot_description", "Robot"),
    ],
)
def test_a_public_name_is_found_by_its_meaning(said: str, meant: str) -> None:
    """What others call it leads to our name, which stands first in the message."""
    with pytest.raises(AttributeError, match=rf"did you mean {meant}\b"):
        getattr(taskopt, said)


def test_the_public_name_of_a_velocity_limit_is_among_those_that_are_suggested() -> None:
    """`VelocityLimit` is a part of three names, all of which are suggested."""
    with pytest.raises(AttributeError, match="JointVelocityLimit"):
        getattr(taskopt, "VelocityLimit")  # noqa: B009 (checkers know that there is no such name)


@pytest.mark.parametrize(
    ("kind", "said", "known", "meant"),
    [
        ("frame", "end_effector", robot("panda").frames, "panda_hand"),
        ("frame", "tool0", robot("panda").frames, "panda_hand"),
        ("posture", "home", robot("panda").postures, "default"),
        ("resolver", "damped least squares", resolver_names(), "dls"),
        ("resolver", "pseudoinverse", resolver_names(), "pinv"),
        ("resolver", "jacobian-transpose", resolver_names(), "transpose"),
        ("robot", "franka", ("planar2", "panda", "ur5_robot"), "panda"),
        ("parameter", "hand.kp", PARAMETERS, "hand.gain"),
        ("parameter", "posture.cost", PARAMETERS, "posture.weight"),
        ("policy for a conflict", "slack", ("raise", "relax", "brake"), "relax"),
    ],
)
def test_names_of_all_kinds_are_found_by_their_meaning(
    kind: str, said: str, known: tuple[str, ...], meant: str
) -> None:
    """Frames, postures, resolvers, robots, parameters and policies use the same table."""
    assert re.search(rf"did you mean {re.escape(meant)}[,?]", str(UnknownName(kind, said, known)))


def test_a_slip_is_answered_by_its_letters() -> None:
    """One wrong letter outweighs a meaning: the frame with the tool point is meant, not the hand."""
    frames = ("panda_hand", "panda_hand_tcp")
    assert by_meaning("panda_hnd_tcp", frames)[0] == "panda_hand"
    assert near_names("panda_hnd_tcp", frames, 0.5)[0] == "panda_hand_tcp"


def test_nothing_is_suggested_without_a_meaning() -> None:
    """A name without a row gets no names by meaning, nor does a row whose names are not known."""
    assert by_meaning("xyzzy", taskopt.__all__) == []
    assert by_meaning("solve_ik", ("panda", "ur5_robot")) == []


def forgotten(rows: tuple[tuple[str, str], ...]) -> list[str]:
    """Capitalised names of the table that are not public, and rows that say a phrase twice."""
    names = [name for _, ours in rows for name in ours.split() if name[0].isupper()]
    twice = [said for said, _ in rows if len(set(said.split(", "))) < len(said.split(", "))]
    return [*(name for name in names if name not in taskopt.__all__), *twice]


def test_the_table_names_what_there_is() -> None:
    """Every class in the table is public; a name that is gone and a phrase said twice are caught."""
    assert forgotten(SYNONYMS) == []
    assert forgotten((("a, b", "FrameTask GoneTask"), ("c, c", "Robot"))) == ["GoneTask", "c, c"]
