"""A mobile base goes around while the hand stays where it is, as in `mobile_stretch.py` of pink."""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import numpy as np
import pinocchio as pin

from taskopt import (
    Configuration,
    FrameTask,
    Function,
    JointPositionLimit,
    JointVelocityLimit,
    Robot,
    Scenario,
    Stack,
)

arm, dt = Robot.load("tiago_no_hand", lock=("wheel_left_joint", "wheel_right_joint")), 1e-2
ground = pin.Model()
wheels = ground.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "planar")
ground.addFrame(pin.Frame("ground", wheels, 0, pin.SE3.Identity(), pin.FrameType.BODY))
robot = Robot(pin.appendModel(ground, arm.model, ground.getFrameId("ground"), pin.SE3.Identity()))
q0 = robot.posture("middle")
start = np.array(Configuration(robot, q0).pose("base_link"))


def around(t: float) -> np.ndarray:
    """Return the desired pose of the base (4, 4) [m] at t [s]."""
    turn, circle = pin.rpy.rpyToMatrix(0.0, 0.0, 0.5 * np.pi * t), [0.5 * np.cos(t), 0.5 * np.sin(t), 0.0]
    return pin.SE3(start[:3, :3] @ turn, start[:3, 3] + circle).homogeneous


base = FrameTask("base_link", target=Function(around), gain=1.0 / dt, weight=(0.1**2, 1.0))
hand = FrameTask("arm_tool_link", gain=1.0 / dt, weight=(1.0, 1e-4**2))

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[base, hand]], [JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=6.0,
    dt=dt,
)
