"""Places beside a link of a robot, and what solids there are."""

from collections.abc import Callable

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Box, Capsule, HalfSpace, Shape, Sphere
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.robot.random_posture import random_posture

# Textbook capsules, hulls and boxes, cylinders, a floating base.
NAMES = ("planar3", "panda", "ur5_robot", "talos_reduced")

SOLIDS: dict[str, Callable[[Array], Shape]] = {
    "sphere": lambda p: Sphere(p, 0.06),
    "capsule": lambda p: Capsule(p, np.add(p, [0.1, 0.2, 0.05]), 0.04),
    "box": lambda p: Box(p, [0.1, 0.15, 0.2]),
    "half-space": lambda p: HalfSpace(p, 0.9 * float(np.linalg.norm(p))),
}


def beside(of: Robot, rng: np.random.Generator, scatter: float = 0.12) -> tuple[Configuration, Array]:
    """A random posture, and a point near one of the links."""
    at = Configuration(of, random_posture(of, rng))
    shapes = of.geometry.geometryObjects
    shape = shapes[int(rng.integers(0, len(shapes)))]
    centre = (at.joint_poses()[shape.parentJoint] @ shape.placement.homogeneous)[:3, 3]
    away = rng.normal(0.0, scatter, 3)
    if of.name.startswith("planar"):
        away[2] = 0.0
    return at, centre + away


def circle_clearance(lengths: Array, q: Array, centre: Array, radius: float) -> Array:
    """(n,) from each segment of a planar arm to a circle, negative inside: elementary geometry."""
    angle = np.cumsum(q)
    steps = lengths[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    begins = np.cumsum(steps, axis=0) - steps
    share = np.clip(((centre - begins) * steps).sum(axis=1) / lengths**2, 0.0, 1.0)
    return np.linalg.norm(begins + share[:, None] * steps - centre, axis=1) - radius
