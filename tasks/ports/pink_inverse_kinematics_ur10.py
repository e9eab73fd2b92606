"""A UR10 goes to a pose that is drawn at random, as in `inverse_kinematics_ur10.py` of pink.

For the posture alone `solve_pose(robot, {"tool0": goal})` is one line, with restarts and a verdict.
"""

import numpy as np

from taskopt import (
    Configuration,
    FrameTask,
    JointPositionLimit,
    JointVelocityLimit,
    Robot,
    Scenario,
    Stack,
)

robot, dt = Robot.load("ur10_robot"), 1e-2
drawn = np.random.default_rng(0).uniform(robot.position_lower, robot.position_upper)
goal = Configuration(robot, drawn).pose("tool0")

scenario = Scenario(
    robot=robot,
    q0=robot.neutral,
    stack=Stack(
        levels=[[FrameTask("tool0", target=goal, gain=1.0 / dt)]],
        limits=[JointPositionLimit(0.5), JointVelocityLimit()],
    ),
    duration=5.0,
    dt=dt,
)
