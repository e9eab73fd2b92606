"""A Kinova Gen2 arm holds its hand on a target that swings sideways, as in `arm_kinova_gen2.py` of pink."""

import numpy as np

from taskopt import (
    Configuration,
    FrameTask,
    Function,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Robot,
    Scenario,
    Stack,
)

robot, dt, hand = Robot.load("kinova"), 5e-3, "j2s6s200_end_effector"
q0 = robot.integrate(robot.neutral, np.array([0.0, 1.0, 1.0, 0.0, 1.0, 0.0]), 1.0)
start = Configuration(robot, q0).pose(hand)


def swing(t: float) -> np.ndarray:
    """Return the desired pose of the hand (4, 4) [m] at t [s]."""
    pose = start.copy()
    pose[1:3, 3] = 0.8 + 0.1 * np.sin(2.0 * t), 0.2
    return pose


scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack(
        levels=[
            [
                FrameTask(hand, target=Function(swing), gain=1.0 / dt),
                JointTask(gain=1.0 / dt, weight=1e-3**2),
            ]
        ],
        limits=[JointPositionLimit(0.5), JointVelocityLimit()],
    ),
    duration=5.0,
    dt=dt,
)
