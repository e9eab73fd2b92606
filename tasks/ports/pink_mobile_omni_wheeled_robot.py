"""An omnidirectional base goes to and fro between two poses, on screw paths.

This is `mobile_omni_wheeled_robot.py` of pink.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import numpy as np
import pinocchio as pin

from taskopt import FrameTask, Function, Robot, Scenario, Stack, WithoutRate

model, dt = pin.Model(), 1e-2
base = model.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "wheels")
model.addFrame(pin.Frame("base", base, 0, pin.SE3.Identity(), pin.FrameType.BODY))


def jump(t: float) -> np.ndarray:
    """Return the desired pose of the base (4, 4) [m] at t [s]."""
    back = t % 4.0 > 2.0
    return pin.SE3(
        pin.rpy.rpyToMatrix(0.0, 0.0, -np.pi * back), np.array([-0.2 * back, 0.0, 0.0])
    ).homogeneous


goto = FrameTask("base", target=WithoutRate(Function(jump)), gain=0.05 / dt, weight=(1.0, 1e-5**2))

scenario = Scenario(robot=Robot(model), q0=[0.0, 0.0, 1.0, 0.0], stack=Stack([[goto]]), duration=8.0, dt=dt)
