"""A UR5's target swings out of the corridor in which the flange has to stay.

This is `barriers/arm_ur5.py` of pink. The corridor is an inequality on the first level; what the target asks
beyond it is given up.
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
    Robot,
    Scenario,
    Stack,
)

robot, dt, inf = Robot.load("ur5_robot"), 5e-3, np.inf
q0 = [1.27153374, -0.87988708, 1.89104795, 1.73996951, -0.24610945, -0.74979019]
start = Configuration(robot, q0).pose("ee_link")


def swing(t: float) -> np.ndarray:
    """Return the desired pose of the flange (4, 4) [m] at t [s]."""
    pose = start.copy()
    pose[1:3, 3] = 0.65 * np.sin(t / 4.0), 0.5
    return pose


corridor = BoxTask("ee_link", lower=(-inf, -0.4, -inf), upper=(inf, 0.6, inf), gain=100.0)
hand = FrameTask("ee_link", target=Function(swing), gain=1.0 / dt, weight=(10.0**2, 1.0))

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack(
        levels=[[corridor], [hand, JointTask(gain=1.0 / dt, weight=1e-3**2)]],
        limits=[JointPositionLimit(0.5), JointVelocityLimit()],
    ),
    duration=12.0,
    dt=dt,
)
