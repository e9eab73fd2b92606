"""A G1 stands on its feet, moves its hands and shifts its centre of mass, as in `humanoid_g1.py` of mink."""

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

robot, dt = Robot.load("g1_29dof_rev_1_0"), 2e-3
K = 1.0 / dt
drag, shift = Line(by=(0.1, 0.0, 0.1), duration=1.0), Line(by=(0.0, 0.03, -0.02), duration=1.0)  # [m], [s]

centre = CentreOfMassTask(shift, gain=K, weight=200.0**2)
feet = [
    DampedTask(FrameTask(f"{side}_ankle_roll_link", gain=K, weight=(200.0**2, 10.0**2)), factor=1.0)
    for side in ("right", "left")
]
hands = [
    DampedTask(PositionTask(f"{side}_rubber_hand", target=drag, gain=K, weight=4.0**2), factor=1.0)
    for side in ("right", "left")
]
pelvis = OrientationTask("pelvis", gain=K, weight=10.0**2)
posture = JointTask(joints=robot.joints[1:], gain=K, weight=0.1**2)

scenario = Scenario(
    robot=robot,
    q0=robot.neutral,
    stack=Stack(
        levels=[[*hands, centre, *feet, pelvis, posture, DampingTask(weight=0.1)]],
        limits=[JointPositionLimit()],
    ),
    duration=1.5,
    dt=dt,
)
