"""Of all joint velocities that keep the tip on its circle, the arm takes the smallest (3.51).

Sect. 3.7.5 of Siciliano et al., Fig. 3.17: redundancy is not used for anything else, and the arm is in
another posture after each of the two turns.
"""

import numpy as np

from taskopt import Circle, PositionTask, Scenario, Stack, planar_arm

circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0), turns=2)  # [m], [s]

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.5]),
    q0=[np.pi, -np.pi / 2, -np.pi / 2],
    stack=Stack(levels=[[PositionTask("tip", target=circle, gain=500.0, axes="xy")]], damping=None),
    duration=4.0,
    dt=1e-3,
)
