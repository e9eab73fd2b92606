"""Two limits contradict each other on purpose: an arm cannot brake in time before an obstacle.

The limit of the obstacle needs harder brakes than the motors have, so that two hard limits contradict each
other for some ticks. With `on_conflict="raise"` the run would end there with a message that names the limits
and the least relaxation. Here the arm brakes as hard as it may, and the summary says so.
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
        damping=None,
    ),
    duration=2.0,
    dt=2e-3,
    on_conflict="brake",
)
