"""Problem 3.21: the tip of a planar three-link arm goes down a straight line past a circular object.

Link lengths 0.5, 0.3, 0.3 m; from (0.8, 0.2) to (0.8, -0.2) m in 2 s with a sinusoidal timing law; the
object has its centre in (0.3, 0) m and a radius of 0.1 m; Euler integration (3.48) at 1 ms. The links
are segments, 2 mm thick so that they can be seen. From this start the plain pseudo-inverse moves the first
link into the object; the limit keeps all links out, and the tip still follows its line.
"""

import numpy as np

from taskopt import Line, ObstacleLimit, PositionTask, Scenario, Sphere, Stack, planar_arm

theta_1 = np.radians(30.0)
reach = 0.8 + 0.2j - 0.5 * np.exp(1j * theta_1)  # what links 2 and 3 must span, as x + iy
bend = np.arccos(abs(reach) / 0.6)  # equal links: an isosceles triangle, elbow on the left

scenario = Scenario(
    robot=planar_arm([0.5, 0.3, 0.3], radius=0.001),
    q0=[theta_1, np.angle(reach) - bend - theta_1, 2.0 * bend],
    stack=Stack(
        levels=[
            [
                PositionTask(
                    "tip",
                    target=Line(by=[0.0, -0.4, 0.0], duration=2.0, timing="sinusoidal"),
                    gain=100.0,
                    axes="xy",
                )
            ]
        ],
        limits=[ObstacleLimit([Sphere([0.3, 0.0, 0.0], 0.1, name="circle")], margin=0.005, gain=0.05)],
        damping=None,
    ),
    duration=2.0,
    dt=1e-3,
)
