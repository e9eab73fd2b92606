"""A base on two wheels rolls forward without slip, as in `upkie_rolling.py` of pink.

Rolling stands on the first level, as the equality constraints do there.
"""

import numpy as np

from taskopt import (
    Configuration,
    DampingTask,
    FrameTask,
    Function,
    JointPositionLimit,
    JointVelocityLimit,
    Robot,
    RollingTask,
    Scenario,
    Stack,
)

robot, dt = Robot.load("tiago_no_hand", floating=True), 5e-3
q0 = robot.posture("middle")
at = Configuration(robot, q0)
q0[2] += 0.0985 - at.pose("wheel_left_link")[2, 3]  # the wheels stand on the ground
start = Configuration(robot, q0).pose("base_link")


def forward(t: float) -> np.ndarray:
    """Return the desired pose of the base (4, 4) [m] at t [s]."""
    pose = start.copy()
    pose[0, 3] += 0.1 * t
    return pose


wheels = [RollingTask(f"wheel_{side}_link", radius=0.0985, gain=1.0 / dt) for side in ("left", "right")]
base = FrameTask("base_link", target=Function(forward), gain=1.0 / dt)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([wheels, [base, DampingTask(weight=1e-3)]], [JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=4.0,
    dt=dt,
)
