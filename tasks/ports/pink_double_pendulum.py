"""The tip of a double pendulum swings to and fro, as in `double_pendulum.py` of pink."""

import numpy as np

from taskopt import Configuration, FrameTask, Function, JointTask, Scenario, Stack, planar_arm

robot, dt = planar_arm([0.5, 0.5]), 1e-2
start = Configuration(robot, robot.neutral).pose("tip")


def swing(t: float) -> np.ndarray:
    """Return the desired pose of the tip (4, 4) [m] at t [s]."""
    pose = start.copy()
    pose[:2, 3] = start[0, 3] - 0.1, 0.1 * np.sin(t)
    return pose


tip = FrameTask("tip", target=Function(swing), gain=1.0 / dt, weight=(1.0, 1e-3**2))
posture = JointTask(gain=1.0 / dt, weight=1e-2**2)

scenario = Scenario(robot=robot, q0=robot.neutral, stack=Stack([[tip, posture]]), duration=7.0, dt=dt)
