"""A biped on its hip, with a fixed base, draws up its feet and lowers them.

This is `upkie_crouching.py` of pink.
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

robot, dt = Robot.load("bolt", lock=("root_joint",)), 5e-3
q0 = robot.posture("standing")
at = Configuration(robot, q0)


def crouch(foot: str) -> Function:
    """Return the target of a foot, which rises by 0.1 (1 - cos t) [m]."""
    return Function(lambda t: at.pose(foot)[:3, 3] + [0.0, 0.0, 0.1 * (1.0 - np.cos(t))])


feet = [
    FrameTask(foot, target=crouch(foot), gain=1.0 / dt, weight=0.1**2, axes="xz", expressed="world")
    for foot in ("FL_FOOT", "FR_FOOT")
]
posture = JointTask(gain=1.0 / dt, weight=1e-3**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[*feet, posture]], [JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=7.0,
    dt=dt,
)
