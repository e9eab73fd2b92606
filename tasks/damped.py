"""A two-link arm passes its own base at 3 cm, where it is almost folded; damping keeps the joints slow.

Damped least squares (3.59): the task of the tip and q̇ = 0 share one level, so that their cost is
½‖v − J q̇‖² + ½ k² ‖q̇‖² with k = 0.1. Without the second task the first joint would turn by nearly
half a turn while the tip passes.
"""

from taskopt import DampingTask, Line, PositionTask, Scenario, Stack, planar_arm

past = Line(by=(-1.2, 0.0, 0.0), duration=3.0)  # [m], [s]
k = 0.1

scenario = Scenario(
    robot=planar_arm([0.5, 0.5]),
    q0=[-0.8764, 1.8527],
    stack=Stack(
        levels=[[PositionTask("tip", target=past, gain=10.0, axes="xy"), DampingTask(weight=k**2)]],
        damping=None,
    ),
    duration=4.0,
    dt=1e-3,
)
