"""Of all accelerations that keep the tip on its circle, the arm takes the least in the norm of its inertia.

Local minimisation of ½ q̈ᵀ M(q) q̈ alone diverges: self-motion is never braked, energy gathers in it from
turn to turn, and in the sixth turn the arm whips at 79 rad/s and throws its tip 3 cm off the circle
(Hollerbach and Suh 1987, IEEE Journal of Robotics and Automation 3(4)). `--set self-motion.gain=5` damps the
self-motion: no joint exceeds 5 rad/s then. The arm has three uniform rods of 1 m and 10 kg.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import numpy as np
import pinocchio as pin

from taskopt import Circle, PositionTask, Robot, Scenario, Stack, planar_arm

links = planar_arm([1.0, 1.0, 1.0])  # [m]
model = links.model.copy()
about_centre = np.diag([0.0, 10.0 / 12.0, 10.0 / 12.0])  # [kg m²]
rod = pin.Inertia(10.0, np.array([0.5, 0.0, 0.0]), about_centre)  # [kg], [m]
model.appendBodyToJoint(1, rod, pin.SE3.Identity())
model.appendBodyToJoint(2, rod, pin.SE3.Identity())
model.appendBodyToJoint(3, rod, pin.SE3.Identity())

circle = Circle(radius=0.3, period=1.0, toward=(1, 0, 0), along=(0, 1, 0), turns=6)  # [m], [s]

scenario = Scenario(
    robot=Robot(model, links.geometry),
    q0=[0.5, 1.2, 0.8],
    stack=Stack(
        levels=[[PositionTask("tip", target=circle, gain=20.0, axes="xy")]],
        norm="inertia",
        order=2,
        self_motion=1e-6,  # K_v [1/s], nothing
    ),
    duration=6.0,
    dt=2e-3,
)
