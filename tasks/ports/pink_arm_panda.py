"""A Panda's tool follows a target that the user drags, as in `arm_panda.py` of pink; here it moves by itself.

Frame, posture and damping share one level; `--set` changes their weights as the sliders there do.
"""

from taskopt import (
    DampedTask,
    DampingTask,
    FrameTask,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Line,
    Robot,
    Scenario,
    Stack,
)

dt = 5e-3
drag = Line(by=(0.1, 0.3, -0.2), duration=2.0)  # [m], [s]
tool = DampedTask(FrameTask("panda_hand_tcp", target=drag, gain=1.0 / dt), factor=1.0, name="tool")
posture = JointTask(gain=1.0 / dt, weight=1e-3**2)
damping = DampingTask(weight=1e-3**2)

scenario = Scenario(
    robot=Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2")),
    q0=[0.0, -0.785398, 0.0, -2.35619, 0.0, 1.5708, 0.785398],
    stack=Stack([[tool, posture, damping]], [JointPositionLimit(0.5), JointVelocityLimit()]),
    duration=3.0,
    dt=dt,
)
