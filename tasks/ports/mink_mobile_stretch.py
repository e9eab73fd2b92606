"""A base shuttles between two places no faster than allowed, its hand stays in place.

This is `mobile_stretch.py` of mink.
"""

import numpy as np

from taskopt import (
    Configuration,
    DampingTask,
    FloatingBaseVelocityLimit,
    FrameTask,
    Function,
    JointPositionLimit,
    JointVelocityLimit,
    Robot,
    Scenario,
    Stack,
    WithoutRate,
)

dt = 1e-2
robot = Robot.load(
    "tiago_no_hand",
    lock=("wheel_left_joint", "wheel_right_joint", "head_1_joint", "head_2_joint"),
    floating=True,
)
q0 = robot.posture("middle")
start = Configuration(robot, q0).pose("base_link")


def shuttle(t: float) -> np.ndarray:
    """Return the desired pose of the base (4, 4) [m] at t [s], which jumps from one side to the other."""
    pose = start.copy()
    pose[1, 3] += 0.2 if t % 6.0 < 3.0 else -0.2
    return pose


base = FrameTask("base_link", target=WithoutRate(Function(shuttle)), gain=1.0 / dt)
hand = FrameTask("arm_tool_link", gain=1.0 / dt, weight=20.0**2)
slow = FloatingBaseVelocityLimit(linear=0.2, angular=1.0)  # [m/s], [rad/s]

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack(
        levels=[[base, hand, DampingTask(weight=1e-3)]],
        limits=[slow, JointPositionLimit(), JointVelocityLimit()],
    ),
    duration=6.0,
    dt=dt,
)
