"""A pendulum takes the short way to its goal and is stopped by its joint limit.

This is `simple_pendulum_configuration_limit.py` of pink. The joint may turn from 0 to 2π, begins at 0.5 rad,
and its goal is at 5.5 rad: the way through 0 is shorter, but barred. `solve_pose` with several starts finds
the other way.
"""

import numpy as np

from taskopt import Configuration, FrameTask, JointPositionLimit, Scenario, Stack, planar_arm

robot, dt = planar_arm([1.0], lower=0.0, upper=2.0 * np.pi), 1e-2
goal = Configuration(robot, [5.5]).pose("tip")
tip = FrameTask("tip", target=goal, gain=1.0 / dt, weight=(1.0, 0.61**2))

scenario = Scenario(
    robot=robot, q0=[0.5], stack=Stack([[tip]], [JointPositionLimit(0.5)]), duration=2.0, dt=dt
)
