"""The robots that tests are tried on, one frame of each, and postures of them."""

from functools import cache

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import DHRow, Robot, planar_arm

# Planar with limits; seven joints; wheels that turn without end (nq ≠ nv); floating base.
FRAMES = {
    "planar": "tip",
    "panda": "panda_hand",
    "tiago": "arm_tool_link",
    "talos_reduced": "gripper_left_base_link",
}
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")


@cache
def robot(name: str) -> Robot:
    """A robot by name: "planar" has limits and "planar3" has none; the fingers of the Panda are locked.

    The joints of "crane" turn, slide, turn and slide.
    """
    if name == "planar":
        return planar_arm(lower=-3.0, upper=3.0, velocity=2.0, radius=0.02)
    if name == "planar3":
        return planar_arm(radius=0.02)
    if name == "crane":
        turn, slide = DHRow(0.4, 0.5, 0.1, 0.3), DHRow(0.1, -0.7, 0.3, 0.0, "prismatic", lower=0.0, upper=0.6)
        return Robot.from_dh([turn, slide, turn, slide], radius=0.02)
    return Robot.load(name, lock=FINGERS if name == "panda" else ())


def generic_q(of: Robot, seed: int, spread: float = 0.3) -> Array:
    """A posture near the middle, generic in every coordinate of the manifold."""
    v = np.random.default_rng(seed).normal(size=of.nv)
    return of.integrate(of.posture("middle"), spread * v, 1.0)


def random_configuration(name: str, seed: int) -> Configuration:
    """Away from the middle in every joint, wheels and base turned by up to 1 rad."""
    arm = robot(name)
    step = np.random.default_rng(seed).uniform(-1.0, 1.0, arm.nv)
    return Configuration(arm, arm.integrate(arm.posture("middle"), step, 1.0))
