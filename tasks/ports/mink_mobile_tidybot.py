"""An arm on a mobile base reaches a target; later the base stands still.

This is `mobile_tidybot.py` of mink.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import numpy as np
import pinocchio as pin

from taskopt import (
    DampedTask,
    DampingTask,
    During,
    FrameTask,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Line,
    Robot,
    Scenario,
    Stack,
)

model, dt, up = pin.Model(), 5e-3, pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.5]))
for name, axis in (("x", pin.JointModelPX()), ("y", pin.JointModelPY()), ("turn", pin.JointModelRZ())):
    model.addJoint(model.njoints - 1, axis, pin.SE3.Identity(), f"joint_{name}")
model.addFrame(pin.Frame("platform", model.njoints - 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
robot = Robot(pin.appendModel(model, Robot.load("kinova").model, model.getFrameId("platform"), up))

drag = Line(by=(1.0, 0.5, -0.1), duration=2.0)  # [m], [s]
hand = DampedTask(FrameTask("j2s6s200_end_effector", target=drag, gain=1.0 / dt), factor=1.0)
posture = JointTask(gain=1.0 / dt, weight=np.repeat([0.0, 1e-3**2], [2, robot.nv - 2]))
still = During(DampingTask(weight=np.repeat([100.0**2, 0.0], [3, robot.nv - 3])), begin=2.2)

scenario = Scenario(
    robot=robot,
    q0=robot.posture("middle"),
    stack=Stack([[hand, posture, still]], [JointPositionLimit(), JointVelocityLimit()]),
    duration=3.0,
    dt=dt,
)
