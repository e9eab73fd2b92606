"""Limits of planar and floating joints that no stack holds are named."""

import numpy as np
import pinocchio as pin
import pytest

from taskopt.kinematics.robot import Robot


def base(kind: pin.JointModel, lower: object, upper: object) -> pin.Model:
    """A model with a moving base and one more joint."""
    model = pin.Model()
    first = model.addJoint(0, kind, pin.SE3.Identity(), "base")
    model.addJoint(first, pin.JointModelRZ(), pin.SE3.Identity(), "arm")
    model.lowerPositionLimit[: len(lower)], model.upperPositionLimit[: len(upper)] = lower, upper
    return model


@pytest.mark.parametrize(
    ("kind", "lower", "upper", "said"),
    [
        (pin.JointModelPlanar(), [-1, -2], [1, 2], "joint base: the position limits of x, y are not held"),
        (pin.JointModelPlanar(), [-np.inf, -2], [np.inf, np.inf], "joint base: the position limits of y are"),
        (
            pin.JointModelFreeFlyer(),
            [-1e308, -1e308, 0],
            3 * [1e308],
            "joint base: the position limits of z are",
        ),
    ],
)
def test_stated_limits_are_named_once(kind, lower, upper, said):
    """Also after a joint is locked, which makes a new robot of the parts."""
    robot = Robot(base(kind, lower, upper))
    assert len(robot.dropped) == 1
    assert robot.dropped[0].startswith(said)
    assert robot.lock(["arm"]).dropped == robot.dropped


@pytest.mark.parametrize("value", [np.inf, 1.01, 1.797e308])
def test_what_means_no_limit_is_not_named(value):
    """As Pinocchio writes it: infinity, the largest number, and 1.01 as for a cosine."""
    assert Robot(base(pin.JointModelFreeFlyer(), 3 * [-value], 3 * [value])).dropped == ()
    assert Robot.load("talos_reduced").dropped == ()
