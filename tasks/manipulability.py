"""The tip of a planar arm moves out on a straight line; redundancy keeps the arm as dexterous as it can be.

The gradient of w = √det(J Jᵀ) (3.56) with k₀ = 20. With k₀ = 0 the arm arrives with a manipulability
that is smaller.
"""

from taskopt import GradientTask, Line, Manipulability, PositionTask, Scenario, Stack
from taskopt.robot import planar_arm

out = Line(by=(0.6, 0.3, 0.0), duration=3.0)  # [m], [s]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5]),
    q0=[0.2, 1.9, 0.3],
    stack=Stack(
        levels=[
            [PositionTask("tip", reference=out, gain=100.0, axes="xy")],
            [GradientTask(Manipulability("tip", axes="xy"), gain=20.0)],
        ]
    ),
    duration=4.0,
    dt=1e-3,
)
