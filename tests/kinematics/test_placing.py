"""Compiled forward kinematics and integration give what Pinocchio gives."""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import numpy as np
import pinocchio as pin
import pytest

from taskopt import Robot
from taskopt.arrays import Array
from taskopt.kinematics.placing import joint_tables, move_joints, place_joints

ROBOTS = {"panda": False, "tiago_dual": False, "talos_reduced": True}
OBLIQUE = np.array([0.6, 0.0, 0.8])


def every_kind() -> pin.Model:
    """A chain of all joints that the kernels know, about axes of their own and oblique ones."""
    model = pin.Model()
    joints = [
        pin.JointModelRUBX(),
        pin.JointModelPY(),
        pin.JointModelRZ(),
        pin.JointModelRevoluteUnaligned(OBLIQUE),
    ]
    joints += [pin.JointModelPrismaticUnaligned(OBLIQUE), pin.JointModelRUBY(), pin.JointModelFreeFlyer()]
    for i, joint in enumerate(joints):
        model.addJoint(model.njoints - 1, joint, pin.SE3.Random(), f"joint{i}")
    return model


def robots() -> list[Robot]:
    """The robots that are compared."""
    known = [Robot.load(name, floating=floats) for name, floats in ROBOTS.items()]
    return [*known, Robot(every_kind(), name="every kind")]


@pytest.mark.parametrize("robot", robots(), ids=lambda robot: robot.name)
def test_place_and_move(robot: Robot) -> None:
    """Poses, Jacobians and postures after a step are those of Pinocchio, also for turns of more than π."""
    tables = joint_tables(robot)
    assert tables is not None
    rng, model, data = np.random.default_rng(0), robot.model, robot.model.createData()
    placements, jacobians = np.zeros((model.njoints, 12)), np.zeros((robot.nv, 6)).T
    placements[0, [0, 4, 8]] = 1.0
    for size in (0.0, 1e-9, 1e-3, 0.3, 4.0):
        q, v = pin.integrate(model, pin.neutral(model), rng.normal(size=robot.nv)), rng.normal(size=robot.nv)
        pin.computeJointJacobians(model, data, q)
        place_joints(*tables, q, placements, jacobians)
        expected = np.array([[*pose.rotation.T.ravel(), *pose.translation] for pose in data.oMi])
        assert apart(placements, expected) < 1e-13
        assert apart(jacobians, data.J) < 1e-13
        moved = np.zeros(robot.nq)
        move_joints(tables[0], q, v, size, moved)
        assert apart(moved, pin.integrate(model, q, v * size)) < 1e-13


def apart(a: Array, b: Array) -> float:
    """Largest difference, relative to the largest number."""
    return float(np.abs(a - b).max() / np.abs(b).max())


@pytest.mark.parametrize("joint", [pin.JointModelSpherical(), pin.JointModelRevoluteUnboundedUnaligned()])
def test_unknown_joint(joint: object) -> None:
    """Other joints are not known, and Pinocchio goes on placing such a robot."""
    model = pin.Model()
    model.addJoint(0, joint, pin.SE3.Identity(), "joint")
    assert joint_tables(Robot(model)) is None
