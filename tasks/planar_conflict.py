"""A deliberate conflict: an arm that cannot brake in time is to stop before an obstacle.

The limit of the obstacle asks for brakes harder than the motors have, so that two hard limits contradict
each other for some ticks. With `on_conflict="raise"` the run ends there with a sentence that names them
and the least that would have to give way; here the arm brakes as hard as it may, and says so.
"""

from taskopt import JointAccelerationLimit, ObstacleLimit, PositionTask, Scenario, Sphere, Stack, planar_arm

ball = Sphere([0.75, 0.75, 0.0], 0.15)  # [m]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5], lower=-3.0, upper=3.0, velocity=3.0, radius=0.02),
    q0=[-0.9, 0.5, 0.4],
    stack=Stack(
        levels=[[PositionTask("tip", target=(0.3, 1.2, 0.0), gain=8.0, axes="xy")]],
        limits=[
            JointAccelerationLimit(10.0, velocity=1.0),  # [rad/s²], [rad/s]
            ObstacleLimit(ball, margin=0.05, influence=0.2, gain=0.05),  # [m]
        ],
    ),
    duration=2.0,
    dt=2e-3,
    on_conflict="brake",
)
