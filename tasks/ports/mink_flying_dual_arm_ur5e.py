"""Two UR5 arms on a flying body hold their flanges on moving targets.

This is `flying_dual_arm_ur5e.py` of mink.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import numpy as np
import pinocchio as pin

from taskopt import (
    Configuration,
    DampingTask,
    FrameTask,
    Function,
    JointPositionLimit,
    JointVelocityLimit,
    Robot,
    Scenario,
    Stack,
)

model, dt = pin.Model(), 5e-3
body = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "flight")
model.addFrame(pin.Frame("base", body, 0, pin.SE3.Identity(), pin.FrameType.BODY))
for side, x in (("left", 0.3), ("right", -0.3)):
    arm = Robot.load("ur5_robot").model.copy()
    for frame in arm.frames:
        frame.name = f"{side}_{frame.name}"
    for joint in range(1, arm.njoints):
        arm.names[joint] = f"{side}_{arm.names[joint]}"
    model = pin.appendModel(model, arm, model.getFrameId("base"), pin.SE3(np.eye(3), np.array([x, 0.0, 0.0])))

robot = Robot(model)
q0 = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, *2 * (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)])
at = Configuration(robot, q0)


def hover(t: float) -> np.ndarray:
    """Return the desired pose of the body (4, 4) [m] at t [s]."""
    pose = np.eye(4)
    pose[2, 3] = 0.3 * np.sin(2.0 * t)
    return pose


def swing(frame: str) -> Function:
    """Return the target of a flange."""
    start = at.pose(frame)

    def pose(t: float) -> np.ndarray:
        desired = start.copy()
        desired[1:3, 3] = 0.5 + 0.2 * np.sin(2.0 * t), 0.2
        return desired

    return Function(pose)


base = FrameTask("base", target=Function(hover), gain=1.0 / dt)
hands = [FrameTask(frame, target=swing(frame), gain=1.0 / dt) for frame in ("left_ee_link", "right_ee_link")]

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[*hands, base, DampingTask(weight=1e-2)]], [JointPositionLimit(), JointVelocityLimit()]),
    duration=5.0,
    dt=dt,
)
