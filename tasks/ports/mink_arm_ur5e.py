"""A UR5's flange follows its target until the floor and a wall are in the way.

This is `arm_ur5e.py` of mink.
"""

import numpy as np

from taskopt import (
    DampedTask,
    FrameTask,
    HalfSpace,
    JointPositionLimit,
    JointVelocityLimit,
    Line,
    ObstacleLimit,
    Robot,
    Scenario,
    Stack,
)

dt = 2e-3
drag = Line(by=(0.2, 0.1, -0.7), duration=2.0)  # [m], [s], through the floor
flange = DampedTask(FrameTask("ee_link", target=drag, gain=1.0 / dt), factor=1.0)
scene = [HalfSpace((0.0, 0.0, 1.0), 0.0, name="floor"), HalfSpace((-1.0, 0.0, 0.0), -0.9, name="wall")]

scenario = Scenario(
    robot=Robot.load("ur5_robot"),
    q0=[0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, 0.0],
    stack=Stack(
        levels=[[flange]],
        limits=[
            ObstacleLimit(scene, links=["wrist_3_link"]),
            JointPositionLimit(),
            JointVelocityLimit(velocity=np.pi),  # [rad/s]
        ],
    ),
    duration=3.0,
    dt=dt,
)
