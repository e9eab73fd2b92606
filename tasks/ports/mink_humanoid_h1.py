"""A humanoid with weights that hold hands as firmly as feet leans and reaches.

This is `humanoid_h1.py` of mink.
"""

from taskopt import (
    CentreOfMassTask,
    DampedTask,
    DampingTask,
    FrameTask,
    JointPositionLimit,
    JointTask,
    Line,
    OrientationTask,
    PositionTask,
    Robot,
    Scenario,
    Stack,
)

robot, dt = Robot.load("icub_reduced"), 5e-3
K = 1.0 / dt
drag, shift = Line(by=(0.0, 0.0, 0.05), duration=1.0), Line(by=(0.0, 0.02, 0.0), duration=1.0)  # [m], [s]

centre = CentreOfMassTask(shift, gain=K, weight=200.0**2)
feet = [
    DampedTask(FrameTask(f"{side}_sole", gain=K, weight=(200.0**2, 10.0**2)), factor=1.0) for side in "rl"
]
hands = [
    DampedTask(PositionTask(f"{side}_hand", target=drag, gain=K, weight=200.0**2), factor=1.0)
    for side in "rl"
]
pelvis = OrientationTask("root_link", gain=K, weight=10.0**2)
posture = JointTask(joints=robot.joints[1:], gain=K, weight=1.0)

scenario = Scenario(
    robot=robot,
    q0=robot.posture("half_sitting"),
    stack=Stack(
        levels=[[*hands, centre, *feet, pelvis, posture, DampingTask(weight=0.1)]],
        limits=[JointPositionLimit()],
    ),
    duration=1.5,
    dt=dt,
)
