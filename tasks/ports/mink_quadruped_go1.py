"""A Go1 bows and turns its trunk on four fixed feet, as in `quadruped_go1.py` of mink."""

import numpy as np

from taskopt import (
    Configuration,
    FrameTask,
    JointPositionLimit,
    JointTask,
    Line,
    PositionTask,
    Robot,
    Scenario,
    Stack,
)

robot, dt = Robot.load("go1"), 2e-3
q0 = robot.posture("standing")
bow = np.array(Configuration(robot, q0).pose("trunk"))
bow[:3, :3] @= [[np.cos(0.2), 0.0, np.sin(0.2)], [0.0, 1.0, 0.0], [-np.sin(0.2), 0.0, np.cos(0.2)]]
bow[:3, 3] += 0.03, 0.02, -0.05  # [m]

trunk = FrameTask("trunk", target=Line(to=bow, duration=1.0), gain=1.0 / dt)
feet = [PositionTask(f"{leg}_foot", gain=1.0 / dt) for leg in ("FL", "FR", "RR", "RL")]
posture = JointTask(joints=robot.joints[1:], gain=1.0 / dt, weight=1e-5**2)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack([[trunk, *feet, posture]], [JointPositionLimit(0.5)]),
    duration=1.5,
    dt=dt,
)
