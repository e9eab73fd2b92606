"""A Panda goes to a pose beside it as dexterously as it can.

This is `arm_panda_manipulability_comparison.py` of pink. There manipulability has a cost beside the hand's;
here it climbs on the level below, so that it never costs accuracy. The same motion without it is this stack
without its second level.
"""

import numpy as np

from taskopt import (
    DampingTask,
    FrameTask,
    GradientTask,
    JointPositionLimit,
    JointVelocityLimit,
    Line,
    Manipulability,
    Robot,
    Scenario,
    Stack,
)

dt, tool = 5e-3, "panda_hand_tcp"
aside = np.diag([1.0, -1.0, -1.0, 1.0])
aside[:3, 3] = 0.444, 0.234, 0.035  # [m], the first of the poses there

scenario = Scenario(
    robot=Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2")),
    q0=[0.0, -0.785398, 0.0, -2.35619, 0.0, 1.5708, 0.785398],
    stack=Stack(
        levels=[
            [FrameTask(tool, target=Line(to=aside, duration=3.0), gain=20.0)],
            [GradientTask(Manipulability(tool), gain=5.0), DampingTask(weight=0.1**2)],
        ],
        limits=[JointPositionLimit(0.5), JointVelocityLimit()],
    ),
    duration=5.0,
    dt=dt,
)
