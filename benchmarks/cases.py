"""The works that are timed: robot, start, stack and target path, the same for every library.

W1: Panda, fingers locked, hand on a circle of radius 0.1 m in 2 s at dt 2 ms, gain 1 per tick; posture
with weight 1e-6, damping 1e-12, position limits (half of what is left per tick) and velocity limits, of
which none binds on this path. W1v: velocity limits scaled so that one binds on a third of the ticks.
W2: TALOS with its floating base, 38 unknowns; both feet (weight 100), right hand on the circle (1),
centre of mass (1), posture (1e-4), the same limits.

Letters after the number: s, strict levels, which no peer here can state (hand above posture; feet above hand
and centre of mass above posture); h, the feet as hard equalities; x, saturated: the circle lies 1 m ahead,
out of reach, and with a gain of 1 per tick up to 30 joints run into their bounds and back on every tick.
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
from taskopt.kinematics.limit import RowLimit
from taskopt.kinematics.task import CentreOfMassTask

DT, PERIOD, RADIUS = 0.002, 2.0, 0.1  # [s], [s], [m]
GAIN, DAMPING, KAPPA = 1.0 / DT, 1e-12, 0.5
NAMES = ("W1", "W1v", "W1s", "W1x", "W1xs", "W2", "W2s", "W2h", "W2x", "W2xs", "W2xh")
OUT_OF_REACH = np.array([1.0, 0.0, 0.0])  # [m] from the circle of W1 and W2
VELOCITY_SCALE = {"W1v": 0.51}  # of the robot's own velocity limits
FEET = ("left_sole_link", "right_sole_link")
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
BENT = {
    "gripper_left_joint": -0.1,
    "gripper_right_joint": -0.1,
    "arm_left_4_joint": -1.3,
    "arm_right_4_joint": -1.3,
}


@dataclass(frozen=True, eq=False)
class Work:
    """One job: where it starts, where the hand goes, and the stack that says so."""

    name: str
    robot: Robot
    q0: Array
    frame: str
    hand: Latest
    stack: Stack
    poses: list[Array]  # one (4, 4) a tick, the first one tick ahead


@dataclass(frozen=True)
class Hard:
    """A frame held where it is at the start posture, as hard rows: a limit, not a task."""

    frame: str
    q0: Array
    name: str

    def bind(self, robot: Robot, dt: float) -> RowLimit:  # noqa: ARG002 (protocol)
        bound = FrameTask(self.frame, gain=GAIN).bind(robot, self.name)
        bound.start(Configuration(robot, self.q0), 0.0)
        return bound


def work(name: str, ticks: int) -> Work:
    """The work by name, with a target for each of `ticks` ticks."""
    robot, q0, frame = panda() if name.startswith("W1") else talos()
    start = Configuration(robot, q0).pose(frame)
    hand = Latest(start)
    levels = panda_levels(hand) if name.startswith("W1") else talos_levels(hand)
    hard = [Hard(foot, q0, f"{foot} stays") for foot in FEET] if "h" in name else []
    levels = levels[1:] if hard else levels
    if "s" not in name:
        levels = [[*(task for level in levels for task in level), DampingTask(weight=DAMPING)]]
    scale = VELOCITY_SCALE.get(name, 1.0)
    limits = [JointPositionLimit(gain=KAPPA), JointVelocityLimit(scale=scale), *hard]
    poses = circle(start, ticks)
    if "x" in name:
        for pose in poses:
            pose[:3, 3] += OUT_OF_REACH
    return Work(name, robot, q0, frame, hand, Stack(levels=levels, limits=limits), poses)


def weights(name: str) -> dict[str, float]:
    """Factors of ½‖·‖² of the tasks."""
    posture = 1e-6 if name.startswith("W1") else 1e-4
    return {"feet": 100.0, "hand": 1.0, "centre of mass": 1.0, "posture": posture}


def panda() -> tuple[Robot, Array, str]:
    q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    return Robot.load("panda", lock=FINGERS), q0, "panda_hand_tcp"


def panda_levels(hand: Latest) -> list[list]:
    return [
        [FrameTask("panda_hand_tcp", target=hand, gain=GAIN)],
        [JointTask(gain=GAIN, weight=weights("W1")["posture"])],
    ]


def talos() -> tuple[Robot, Array, str]:
    robot = Robot.load("talos_reduced", floating=True)
    q0 = robot.posture("half_sitting")
    for joint, angle in BENT.items():
        q0[robot.position_index[robot.velocity_index(joint).start]] = angle
    return robot, q0, "gripper_right_base_link"


def talos_levels(hand: Latest) -> list[list]:
    feet = [FrameTask(foot, gain=GAIN, weight=weights("W2")["feet"]) for foot in FEET]
    return [
        feet,
        [FrameTask("gripper_right_base_link", target=hand, gain=GAIN), CentreOfMassTask(gain=GAIN)],
        [JointTask(gain=GAIN, weight=weights("W2")["posture"])],
    ]


def circle(start: Array, ticks: int) -> list[Array]:
    """Poses on a circle through `start` in the world's y-z plane."""
    poses = np.repeat(start[None], ticks, axis=0)
    phase = 2.0 * np.pi / PERIOD * DT * np.arange(1, ticks + 1)
    poses[:, 1, 3] += RADIUS * np.sin(phase)
    poses[:, 2, 3] += RADIUS * (1.0 - np.cos(phase))
    return list(poses)
