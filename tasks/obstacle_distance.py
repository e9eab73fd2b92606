"""A planar arm with four links follows a straight line and moves its links away from a circular object.

The gradient of (3.58) with k₀ = 2 in (3.55). With k₀ = 0 the second link would go through the object. The
objective is on the second level: it would not keep the tip off the object if the line led through it. The
scenario `obstacle_first` shows that case.
"""

from taskopt import GradientTask, Line, ObstacleDistance, PositionTask, Scenario, Sphere, Stack, planar_arm

line = Line(by=(0.47, -0.411, 0.0), duration=2.0)  # [m], [s]
away = ObstacleDistance([Sphere((0.687, 0.225, 0.0), 0.1, name="object")])

scenario = Scenario(
    robot=planar_arm([0.4, 0.4, 0.4, 0.4], radius=0.02),
    q0=[0.56, 0.796, 1.289, -1.332],
    stack=Stack(
        levels=[
            [PositionTask("tip", target=line, gain=100.0, axes="xy")],
            [GradientTask(away, gain=2.0)],
        ],
        damping=None,
    ),
    duration=2.5,
    dt=1e-3,
)
