"""The base of a biped is asked to be 2 m farther and goes there no faster than allowed.

This is `floating_base_velocity_limit.py` of pink.
"""

from taskopt import Configuration, FloatingBaseVelocityLimit, FrameTask, Robot, Scenario, Stack

robot, dt = Robot.load("bolt"), 0.1
q0 = robot.posture("standing")
far = Configuration(robot, q0).pose("base_link")
far[0, 3] += 2.0  # [m]

scenario = Scenario(
    robot=robot,
    q0=q0,
    stack=Stack(
        levels=[[FrameTask("base_link", target=far, gain=1.0 / dt)]],
        limits=[FloatingBaseVelocityLimit(linear=(0.3, 0.3, 0.2), angular=0.8)],  # [m/s], [rad/s]
    ),
    duration=1.0,
    dt=dt,
)
