"""The arm of `damped` passes its base again, with damping only where it is needed.

Damping by a policy: k² of (3.59) grows from zero as the smallest singular value falls below 0.15
(Chiaverini, Siciliano and Egeland 1994), and acts along the singular direction only. Before and after, the
tip follows its line exactly; with a constant k it would not do so anywhere.
"""

from taskopt import LevelDamping, Line, NumericalFiltering, PositionTask, Scenario, Stack, planar_arm

past = Line(by=(-1.2, 0.0, 0.0), duration=3.0)  # [m], [s]
policy = NumericalFiltering(k_max=0.1, epsilon=0.15)

scenario = Scenario(
    robot=planar_arm([0.5, 0.5]),
    q0=[-0.8764, 1.8527],
    stack=Stack(
        levels=[[PositionTask("tip", target=past, gain=10.0, axes="xy"), LevelDamping(policy)]],
        damping=None,
    ),
    duration=4.0,
    dt=1e-3,
)
