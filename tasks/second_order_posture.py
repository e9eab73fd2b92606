"""The tip of a planar arm draws a circle twice by accelerations, near the posture of its start.

The arm of Sect. 3.7.5 of Siciliano et al. at second order, (3.104): the secondary objective is the posture,
K_D ė + K_P e, on the second level. It is served as far as the circle allows, so that the arm ends where it
started, and not in another posture as in `second_order_circle.py`.
"""

import numpy as np

from taskopt import Circle, JointTask, PositionTask, Scenario, Stack, planar_arm

circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2, timing="quintic")
tip = PositionTask("tip", target=circle, gain=50.0, axes="xy")  # K [1/s]: K_P = K², K_D = 2 K
posture = JointTask([np.pi, -np.pi / 2, -np.pi / 2], gain=8.0)  # [rad]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5]),
    q0=[np.pi, -np.pi / 2, -np.pi / 2],
    stack=Stack(levels=[[tip], [posture]], order=2),
    duration=4.0,
    dt=1e-3,
)
