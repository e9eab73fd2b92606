"""The tip of a planar arm draws a circle twice, commanded by accelerations; redundancy is not used.

The arm of Sect. 3.7.5 of Siciliano et al. at second order, (3.102) and (3.104), with self-motion damped. As
with velocities (Fig. 3.17), the arm is in another posture after each turn.
"""

import numpy as np

from taskopt import Circle, PositionTask, Scenario, Stack, planar_arm

circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2, timing="quintic")
tip = PositionTask("tip", target=circle, gain=50.0, axes="xy")  # K [1/s]: K_P = K², K_D = 2 K

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5]),
    q0=[np.pi, -np.pi / 2, -np.pi / 2],
    stack=Stack(levels=[[tip]], order=2),
    duration=4.0,
    dt=1e-3,
)
