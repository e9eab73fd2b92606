"""A seven-joint arm goes round a circle with its hand and keeps clear of a ball; the package alone is enough.

On the second level the arm keeps its posture, as far as the circle, the ball and the limits of speed allow.
"""

from taskopt import (
    Circle,
    JointTask,
    JointVelocityLimit,
    ObstacleLimit,
    PositionTask,
    Robot,
    Scenario,
    Sphere,
    Stack,
)

circle = Circle(radius=0.12, period=4.0)  # [m], [s]
hand = PositionTask("tip", target=circle, gain=10.0, name="hand")
ball = Sphere([0.3, 0.0, 0.36], 0.05)  # centre and radius [m]

scenario = Scenario(
    robot=Robot.load("seven_joint_arm"),
    q0={"joint1": 0.3, "joint2": 0.5, "joint3": 0.2, "joint4": 1.2, "joint5": 0.1, "joint6": 0.8},  # [rad]
    stack=Stack([[hand], [JointTask(name="rest")]], [JointVelocityLimit(velocity=1.5), ObstacleLimit(ball)]),
    duration=4.0,
    dt=2e-3,
)
