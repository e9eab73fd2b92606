"""A UR3 draws a circle, as in `arm_ur3_sparse_solver.py` of pink, which uses a sparse solver for it.

`--resolver hqp/clarabel` gives the same problem to a sparse interior-point solver.
"""

import numpy as np

from taskopt import (
    Configuration,
    FrameTask,
    Function,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Robot,
    Scenario,
    Stack,
)

robot, dt = Robot.load("ur3_robot"), 1e-2
start = Configuration(robot, robot.neutral).pose("tool0")


def circle(t: float) -> np.ndarray:
    """Return the desired pose of the tool (4, 4) [m] at t [s]."""
    pose = start.copy()
    pose[:3, 3] = 0.3 + 0.15 * np.cos(t), 0.15 * np.sin(t), 0.515
    return pose


hand = FrameTask("tool0", target=Function(circle), gain=1.0 / dt, weight=(1.0, 0.1**2))
posture = JointTask(gain=1.0 / dt, weight=1e-3**2)

scenario = Scenario(
    robot=robot,
    q0=robot.neutral,
    stack=Stack([[hand, posture]], [JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=7.0,
    dt=dt,
)
