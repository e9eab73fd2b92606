"""An arm with a hand on a mobile base reaches a target; its fingertips keep their places in the palm.

This is `mobile_kinova_leap.py` of mink.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import numpy as np
import pinocchio as pin

from taskopt import (
    DampedTask,
    FrameTask,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Line,
    RelativeFrameTask,
    Robot,
    Scenario,
    Stack,
)

model, dt, up = pin.Model(), 2e-2, pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.5]))
for name, axis in (("x", pin.JointModelPX()), ("y", pin.JointModelPY()), ("turn", pin.JointModelRZ())):
    model.addJoint(model.njoints - 1, axis, pin.SE3.Identity(), f"joint_{name}")
model.addFrame(pin.Frame("platform", model.njoints - 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
arm, hand, wrist = Robot.load("kinova").model, Robot.load("allegro_right_hand").model, "j2s6s200_end_effector"
model = pin.appendModel(model, arm, model.getFrameId("platform"), up)
robot = Robot(pin.appendModel(model, hand, model.getFrameId(wrist), pin.SE3.Identity()))

drag = Line(by=(0.5, 0.3, -0.1), duration=2.0)  # [m], [s]
reach = DampedTask(FrameTask(wrist, target=drag, gain=1.0 / dt), factor=1.0)
tips = [
    DampedTask(RelativeFrameTask(f"link_{tip}_tip", root="palm_link", axes="xyz", gain=1.0 / dt), factor=1e-3)
    for tip in ("3.0", "7.0", "11.0", "15.0")
]
kept = ("joint_turn", *(joint for joint in robot.joints if "." in joint))  # the base, and the fingers
posture = JointTask(joints=kept, gain=1.0 / dt, weight=1e-3**2)

scenario = Scenario(
    robot=robot,
    q0=robot.posture("middle"),
    stack=Stack([[reach, *tips, posture]], [JointPositionLimit(), JointVelocityLimit()]),
    duration=3.0,
    dt=dt,
)
