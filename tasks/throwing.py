"""A planar arm of three links takes the posture of an arm that throws, while its tip stays in place.

Fig. 3.27 of Siciliano et al.: the arm bears a weight along y and throws it along x. A large transformation
ratio makes both large, so the second level climbs α along y (3.127) and β along x (3.128): the velocity
ellipse lies down, and the force ellipse turns upright.
"""

from taskopt import (
    ForceRatio,
    GradientTask,
    JointPositionLimit,
    JointVelocityLimit,
    PositionTask,
    Scenario,
    Stack,
    VelocityRatio,
    planar_arm,
)

force = ForceRatio("tip", direction=(0.0, 1.0), axes="xy")  # along y, α
velocity = VelocityRatio("tip", direction=(1.0, 0.0), axes="xy")  # along x, β

scenario = Scenario(
    robot=planar_arm([0.5, 0.5, 0.3], lower=[-3.2, -2.6, -1.6], upper=[3.2, 2.6, 1.6], velocity=2.0),
    q0=[-2.5, 1.2, 1.1],
    stack=Stack(
        levels=[
            [PositionTask("tip", gain=50.0, axes="xy")],
            [GradientTask(0.2 * force + velocity, gain=8.0)],
        ],
        limits=[JointPositionLimit(), JointVelocityLimit()],
        damping=None,
    ),
    duration=4.0,
    dt=1e-3,
)
