"""TALOS reaches to a shelf by accelerations: both feet stay, then the right hand, then the posture.

The base floats, and the feet are the first level, so that the legs help the arm to reach. Accelerations,
speeds and ranges of all joints are limited. The hand turns, too, and stops at its goal.
"""

import numpy as np

from taskopt import FrameTask, JointAccelerationLimit, JointTask, Line, Robot, Scenario, Stack

talos = Robot.load("talos_reduced", floating=True)
q0 = talos.posture("half_sitting")
bent = ["gripper_left_joint", "gripper_right_joint", "arm_left_4_joint", "arm_right_4_joint"]
at = [talos.position_index[talos.velocity_index(joint).start] for joint in bent]
q0[at] = [-0.1, -0.1, -1.3, -1.3]  # [rad], joints that would start on a limit

reach = Line(by=(0.25, 0.1, 0.35, 0.0, 0.0, 0.6), duration=2.0, timing="quintic")  # [m, rad]
feet = [FrameTask(foot, gain=10.0) for foot in ("left_sole_link", "right_sole_link")]  # K [1/s]
hand = FrameTask("gripper_right_base_link", target=reach, gain=10.0, name="hand")
posture = JointTask(joints=[joint for joint in talos.joints if joint != talos.joints[0]], gain=4.0)
strongest = np.concatenate([np.full(6, np.inf), np.full(talos.nv - 6, 6.0)])  # [rad/s²], the base has none

scenario = Scenario(
    robot=talos,
    q0=q0,
    stack=Stack(levels=[feet, [hand], [posture]], limits=[JointAccelerationLimit(strongest)], order=2),
    trails=["base_link"],
    duration=3.0,
    dt=2e-3,
)
