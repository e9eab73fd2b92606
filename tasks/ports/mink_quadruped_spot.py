"""A quadruped with an arm reaches out on four fixed feet, as in `quadruped_spot.py` of mink."""

from taskopt import FrameTask, JointPositionLimit, JointTask, Line, PositionTask, Robot, Scenario, Stack

robot, dt = Robot.load("b1-z1"), 2e-3
lower, reach = Line(by=(0.0, 0.0, -0.05), duration=1.0), Line(by=(0.05, 0.05, -0.1), duration=1.0)  # [m], [s]

hand = FrameTask("gripperStator", target=reach, gain=1.0 / dt)
trunk = FrameTask("trunk", target=lower, gain=1.0 / dt)
feet = [PositionTask(f"{leg}_foot", gain=1.0 / dt) for leg in ("FL", "FR", "RR", "RL")]
posture = JointTask(joints=robot.joints[1:], gain=1.0 / dt, weight=1e-5**2)

scenario = Scenario(
    robot=robot,
    q0=robot.posture("standing_with_arm_up"),
    stack=Stack([[hand, trunk, *feet, posture]], [JointPositionLimit(0.5)]),
    duration=1.5,
    dt=dt,
)
