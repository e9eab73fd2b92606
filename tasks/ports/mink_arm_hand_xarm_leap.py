"""A hand goes along on an arm, its fingertips keep their places in the palm.

This is `arm_hand_xarm_leap.py` of mink.
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
    Line,
    RelativeFrameTask,
    Robot,
    Scenario,
    Stack,
)

dt, arm = 5e-3, Robot.load("xarm7").model
hand, palm = Robot.load("allegro_right_hand").model, pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.1]))
robot = Robot(pin.appendModel(arm, hand, arm.getFrameId("link_eef"), palm))
q0 = robot.posture("middle")

drag = Line(by=(0.0, 0.15, 0.1), duration=1.0)  # [m], [s]
eef = DampedTask(FrameTask("link_eef", target=drag, gain=1.0 / dt), factor=1.0)
tips = [
    DampedTask(RelativeFrameTask(f"link_{tip}_tip", root="palm_link", axes="xyz", gain=1.0 / dt), factor=1e-3)
    for tip in ("3.0", "7.0", "11.0", "15.0")
]
posture = JointTask(gain=1.0 / dt, weight=5e-2**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[eef, *tips, posture]], [JointPositionLimit()]),
    duration=1.5,
    dt=dt,
)
