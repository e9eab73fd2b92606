"""Central differences on the manifold, and robots of four kinds to take them on."""

from collections.abc import Callable
from functools import cache

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot, planar_arm

STEP = 1e-5  # the error of a central difference is about STEP² + 1e-16 / STEP, near 1e-10

# A frame of each: fixed base, seven joints, wheels that turn without end (nq ≠ nv), floating base.
FRAMES = {
    "planar3": "tip",
    "panda": "panda_hand",
    "tiago": "arm_tool_link",
    "talos_reduced": "gripper_left_base_link",
}


@cache
def robot(name: str) -> Robot:
    return planar_arm() if name == "planar3" else Robot.load(name)


def random_configuration(name: str, seed: int) -> Configuration:
    """Away from the middle in every joint, wheels and base turned by up to 2 rad."""
    arm = robot(name)
    rng = np.random.default_rng(seed)
    return Configuration(arm, arm.integrate(arm.posture("middle"), rng.uniform(-1.0, 1.0, arm.nv), 1.0))


def derivative(function: Callable[[Configuration], Array | float], at: Configuration) -> Array:
    """∂f/∂q: the shape of f, then nv."""
    arm = at.robot
    columns = []
    for step in np.eye(arm.nv) * STEP:
        ahead = np.asarray(function(Configuration(arm, arm.integrate(at.q, step, 1.0))))
        behind = np.asarray(function(Configuration(arm, arm.integrate(at.q, step, -1.0))))
        columns.append((ahead - behind) / (2.0 * STEP))
    return np.stack(columns, axis=-1)
