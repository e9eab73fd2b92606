"""An arm of seven joints follows a target with its hand and keeps its posture a little.

This is `arm_iiwa.py` of mink.
"""

from taskopt import DampedTask, FrameTask, JointPositionLimit, JointTask, Line, Robot, Scenario, Stack

robot, dt = Robot.load("xarm7"), 2e-3
drag = Line(by=(0.0, 0.1, -0.1), duration=1.0)  # [m], [s]
hand = DampedTask(FrameTask("link_eef", target=drag, gain=1.0 / dt), factor=1e-3)
posture = JointTask(gain=1.0 / dt, weight=0.1**2)

scenario = Scenario(
    robot=robot,
    q0=robot.posture("hold-up"),
    stack=Stack([[hand, posture]], [JointPositionLimit(0.5)]),
    duration=1.5,
    dt=dt,
)
