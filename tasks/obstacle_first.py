"""A circular object is in the path of the tip; with inverted priorities the arm goes around it.

Footnote 7 of Sect. 3.5.1: the first level keeps a distance (3.58) of at least 2 cm for every link, and the
path is second. Where the two conflict, the tip leaves its path, and it returns behind the object. With the
two levels exchanged the tip would go through the object. Where both levels ask for the same direction, which
is an algorithmic singularity, damping (3.59) of the path keeps the joints slow.
"""

import numpy as np

from taskopt import (
    DampingTask,
    Line,
    ObjectiveTask,
    ObstacleDistance,
    PositionTask,
    Scenario,
    Sphere,
    Stack,
    planar_arm,
)

line = Line(by=(0.0, -0.8, 0.0), duration=3.0)  # [m], [s]
away = ObstacleDistance([Sphere((1.05, 0.0, 0.0), 0.1, name="object")])
clear = ObjectiveTask(away, at_least=0.02, gain=10.0, name="clear")
path = PositionTask("tip", target=line, gain=5.0, axes="xy", name="path")

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.3], radius=0.02),
    q0=np.radians([65.0, -70.0, 10.0]),
    stack=Stack(levels=[[clear], [path, DampingTask(weight=0.003)]], damping=None),
    duration=4.0,
    dt=1e-3,
)
