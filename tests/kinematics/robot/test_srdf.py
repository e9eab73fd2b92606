"""Postures of an SRDF: every value is a number that fits its joint, and names that are not there are said."""

import numpy as np
import pytest

from taskopt.errors import DroppedWarning, InvalidValue
from taskopt.kinematics.robot import Robot
from tests.helpers.urdf_text import ARM, written


def states(inner: str) -> str:
    """An SRDF with one state."""
    return f'<robot name="arm"><group_state name="home" group="arm">{inner}</group_state></robot>'


def value(joint: str, text: str) -> str:
    """The value of one joint."""
    return f'<joint name="{joint}" value="{text}"/>'


FLAWS = {
    "an expression": (states(value("pan", "${pi/2}")), r"'pan' of the state 'home' .*\$\{pi/2\}.*expand it"),
    "a decimal comma": (
        states(value("tilt", "0,5")),
        "'tilt' of the state 'home' .*'0,5', which is no number",
    ),
    "nothing": (states('<joint name="pan"/>'), "'pan' of the state 'home' has the value ''"),
    "not finite": (states(value("pan", "inf")), "'pan' of the state 'home' has the value 'inf'"),
    "two numbers": (
        states(value("pan", "1 2")),
        "'pan' of the state 'home' has 2 numbers, and the joint takes 1",
    ),
    "two values of one joint": (
        states(value("pan", "1") + value("pan", "2")),
        "'pan' of the state 'home' has two values",
    ),
    "a pair of one link": (
        '<robot name="arm"><disable_collisions link1="base"/></robot>',
        "<disable_collisions> needs two links",
    ),
    "no SRDF": ("<sdf/>", "no SRDF: its root element is <sdf>"),
    "no XML": ("<robot", "not XML"),
}


@pytest.mark.parametrize("flaw", FLAWS)
def test_a_flawed_value_is_named_by_file_state_and_joint(tmp_path, flaw):
    """An error of taskopt's, and never a posture with another number."""
    text, said = FLAWS[flaw]
    written(tmp_path, text, "arm.srdf")
    with pytest.raises(InvalidValue, match=f"arm.srdf.*{said}"):
        Robot.from_urdf(written(tmp_path, ARM), srdf=tmp_path / "arm.srdf")


@pytest.mark.parametrize(
    ("inner", "said"),
    [
        (value("pan", "1") + value("tilt", "1") + value("knee", "1"), "the state 'home' .*not there: knee"),
        (value("knee", "1") + value("hip", "1"), "the state 'home' of the SRDF is left out"),
    ],
)
def test_joints_that_are_not_there_are_said(tmp_path, inner, said):
    """One that is lacking, or nearly all, as in the SRDF of another variant."""
    written(tmp_path, states(inner), "arm.srdf")
    with pytest.warns(DroppedWarning, match=said):
        arm = Robot.from_urdf(written(tmp_path, ARM), srdf=tmp_path / "arm.srdf")
    assert ("home" in arm.postures) is ("tilt" in inner)


def test_a_state_of_all_joints_is_read_as_it_is(tmp_path):
    """Without a warning; a number in exponent notation too."""
    written(tmp_path, states(value("pan", "5e-1") + value("tilt", " 1.0 ")), "arm.srdf")
    arm = Robot.from_urdf(written(tmp_path, ARM), srdf=tmp_path / "arm.srdf")
    np.testing.assert_array_equal(arm.posture("home"), [0.5, 1.0])
    assert arm.dropped == ()
