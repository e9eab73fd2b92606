"""The tip of a planar arm moves past its base on a straight line, and the arm stays as dexterous as it can.

Redundancy is used to increase w = √det(J Jᵀ) (3.56), with k₀ = 10 in (3.55). With k₀ = 0, w would fall to
0.08 m² on the way, near a singularity; here it stays above 0.33 m².
"""

from taskopt import GradientTask, Line, Manipulability, PositionTask, Scenario, Stack, planar_arm

past = Line(by=(-0.754, -0.357, 0.0), duration=2.0)  # [m], [s]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5]),
    q0=[0.415, 0.655, -1.706],
    stack=Stack(
        levels=[
            [PositionTask("tip", target=past, gain=100.0, axes="xy")],
            [GradientTask(Manipulability("tip", axes="xy"), gain=10.0)],
        ],
        damping=None,
    ),
    duration=2.5,
    dt=1e-3,
)
