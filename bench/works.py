"""The works that are timed: robot, start, stack and target path, the same for every library.

W1: Panda, fingers locked, hand on a circle of radius 0.1 m in 2 s at dt 2 ms, gain 1 per tick; posture
with weight 1e-6, damping 1e-12, position limits (half of what is left per tick) and velocity limits, of
which none binds on this path. W1v: the same with velocity limits scaled so that one binds on about a
third of the ticks.
"""

from dataclasses import dataclass

import numpy as np

from taskopt import (
    Configuration,
    DampingTask,
    FrameTask,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Latest,
    Robot,
    Stack,
)
from taskopt.arrays import Array

DT, PERIOD, RADIUS = 0.002, 2.0, 0.1  # [s], [s], [m]
POSTURE_WEIGHT, DAMPING, KAPPA = 1e-6, 1e-12, 0.5
HAND = "panda_hand_tcp"
VELOCITY_SCALE = {"W1": 1.0, "W1v": 0.51}  # of the robot's own velocity limits


@dataclass(frozen=True, eq=False)
class Work:
    """One job: where it starts, where the hand goes, and the stack that says so."""

    name: str
    robot: Robot
    q0: Array
    hand: Latest
    stack: Stack
    poses: list[Array]  # one (4, 4) a tick, the first one tick ahead


def work(name: str, ticks: int) -> Work:
    """The work by name, with a target for each of `ticks` ticks."""
    robot = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    start = Configuration(robot, q0).pose(HAND)
    hand = Latest(start)
    stack = Stack(
        levels=[
            [
                FrameTask(HAND, reference=hand, gain=1.0 / DT),
                JointTask(gain=1.0 / DT, weight=POSTURE_WEIGHT),
                DampingTask(weight=DAMPING),
            ]
        ],
        limits=[JointPositionLimit(gain=KAPPA), JointVelocityLimit(scale=VELOCITY_SCALE[name])],
    )
    return Work(name, robot, q0, hand, stack, circle(start, ticks))


def circle(start: Array, ticks: int) -> list[Array]:
    """Poses on a circle through `start` in the world's y-z plane."""
    poses = np.repeat(start[None], ticks, axis=0)
    phase = 2.0 * np.pi / PERIOD * DT * np.arange(1, ticks + 1)
    poses[:, 1, 3] += RADIUS * np.sin(phase)
    poses[:, 2, 3] += RADIUS * (1.0 - np.cos(phase))
    return list(poses)
