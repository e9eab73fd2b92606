"""A Go2 sways and squats on its four feet beside a wall and below a ceiling.

This is `barriers/go2_squat.py` of pink.
"""

import numpy as np

from taskopt import (
    BoxTask,
    Configuration,
    FrameTask,
    Function,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    PositionTask,
    Robot,
    Scenario,
    Stack,
)

robot, dt, inf = Robot.load("go2"), 5e-3, np.inf
q0 = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0, *4 * (0.0, 0.8, -1.57)])
start = Configuration(robot, q0).pose("base")


def sway(t: float) -> np.ndarray:
    """Return the desired pose of the base (4, 4) [m] at t [s]: 4 s sideways, then 4 s up and down."""
    pose, wave = start.copy(), np.sin(0.5 * np.pi * t)
    up = t // 4.0 % 2
    pose[1:3, 3] = 0.1 * (1 - up) * wave, 0.3 + 0.2 * up * wave
    return pose


room = BoxTask("base", lower=(-inf,) * 3, upper=(inf, 0.0, 0.35), gain=100.0)
base = FrameTask("base", target=Function(sway), gain=1.0 / dt, weight=(50.0**2, 1.0))
feet = [PositionTask(f"{leg}_foot", gain=1.0 / dt, weight=200.0**2) for leg in ("FL", "FR", "RL", "RR")]
posture = JointTask(joints=robot.joints[1:], gain=1.0 / dt, weight=1e-5**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[room], [base, *feet, posture]], [JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=8.0,
    dt=dt,
)
