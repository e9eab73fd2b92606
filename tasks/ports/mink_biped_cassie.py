"""A humanoid holds one bar with both hands, a closed chain, and shifts its weight.

This is `biped_cassie.py` of mink. Cassie has closed chains in its legs. Here the ends of the bar are two
frames that the loop keeps together.
"""

import numpy as np

from taskopt import (
    CentreOfMassTask,
    Configuration,
    DampedTask,
    DampingTask,
    FrameTask,
    JointPositionLimit,
    JointTask,
    Line,
    LoopTask,
    OrientationTask,
    Robot,
    Scenario,
    Stack,
)

talos, dt = Robot.load("talos_reduced"), 5e-3
K, q0, right = 1.0 / dt, talos.posture("half_sitting"), "gripper_right_base_link"
at = Configuration(talos, q0)
bar = np.linalg.inv(at.pose("gripper_left_base_link")) @ at.pose(right)
robot = talos.with_frame("bar_end", "gripper_left_base_link", bar)

loop = LoopTask("bar_end", right, axes="xyzrpy", gain=0.5 / dt, weight=500.0**2)
centre = CentreOfMassTask(Line(by=(0.02, 0.03, -0.03), duration=1.0), gain=K, weight=200.0**2)
feet = [
    DampedTask(FrameTask(f"{side}_sole_link", gain=K, weight=(200.0**2, 10.0**2)), factor=1.0)
    for side in ("left", "right")
]
pelvis = OrientationTask("base_link", gain=K, weight=10.0**2)
posture = JointTask(joints=robot.joints[1:], gain=K)

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack(
        levels=[[centre, loop, *feet, pelvis, posture, DampingTask(weight=0.1)]],
        limits=[JointPositionLimit()],
    ),
    duration=1.5,
    dt=dt,
)
