"""The benchmark cases: robot, start posture, stack and path of the target, the same for every library.

    W1    Panda with locked fingers; the hand draws a circle of radius 0.1 m in 2 s, dt 2 ms, gain 1 per tick;
          posture with weight 1e-6, damping 1e-12; limits on position (half of what is left per tick) and on
          velocity, of which none binds on this path
    W1v   the same with velocity limits scaled by 0.51, so that one binds on a third of the ticks
    W2    TALOS with its floating base, 38 unknowns: both feet (weight 100), right hand on the circle (1),
          centre of mass (1), posture (1e-4), the same limits

Letters after the number change the case:

    s     strict levels, which no peer can state: hand above posture; feet above hand and centre of mass above
          posture
    h     the feet as hard equalities
    x     saturated: the circle lies 1 m ahead and cannot be reached, and with a gain of 1 per tick up to 30
          joints run into their bounds and back on every tick
"""

from dataclasses import dataclass

import numpy as np

from taskopt import (
    CentreOfMassTask,
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
from taskopt.kinematics.limit import Limit
from taskopt.kinematics.task import BoundTask, Task

DT, PERIOD, RADIUS = 0.002, 2.0, 0.1  # [s], [s], [m]
GAIN, DAMPING, POSITION_GAIN = 1.0 / DT, 1e-12, 0.5
NAMES = ("W1", "W1v", "W1s", "W1x", "W1xs", "W2", "W2s", "W2h", "W2x", "W2xs", "W2xh")
OUT_OF_REACH = np.array([1.0, 0.0, 0.0])  # [m] from the circle of W1 and W2
VELOCITY_SCALE = {"W1v": 0.51}  # of the robot's own velocity limits
FEET = ("left_sole_link", "right_sole_link")
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
BENT = {  # [rad], joints of TALOS that would start on a limit
    "gripper_left_joint": -0.1,
    "gripper_right_joint": -0.1,
    "arm_left_4_joint": -1.3,
    "arm_right_4_joint": -1.3,
}


@dataclass(frozen=True, eq=False)
class BenchmarkCase:
    """One benchmark case.

    Attributes:
        name: One of `NAMES`.
        robot: The robot.
        q0: Start posture, (nq,) [rad, m].
        frame: The frame that follows the path.
        hand: Its target; the benchmark sets the pose of each tick.
        stack: Tasks and limits.
        poses: Pose of the target at each tick, (4, 4) in the world, the first one tick ahead.
    """

    name: str
    robot: Robot
    q0: Array
    frame: str
    hand: Latest
    stack: Stack
    poses: list[Array]


@dataclass(frozen=True)
class HardFrame(Limit):
    """A limit that holds a frame where it is at the start posture, by hard rows.

    Attributes:
        frame: The frame.
        q0: Start posture, (nq,) [rad, m].
        name: Name of the limit.
    """

    frame: str
    q0: Array
    name: str

    def bind(self, robot: Robot, dt: float) -> BoundTask:  # noqa: ARG002 (protocol)
        """Return the rows of a frame task whose target is the pose at the start."""
        bound = FrameTask(self.frame, gain=GAIN).bind(robot, self.name)
        bound.start(Configuration(robot, self.q0), 0.0)
        return bound


def benchmark_case(name: str, ticks: int) -> BenchmarkCase:
    """Make a benchmark case.

    Args:
        name: One of `NAMES`.
        ticks: How many poses its target has.

    Returns:
        The case.
    """
    robot, q0, frame = panda() if name.startswith("W1") else talos()
    start = Configuration(robot, q0).pose(frame)
    hand = Latest(start)
    levels = panda_levels(hand) if name.startswith("W1") else talos_levels(hand)
    hard = [HardFrame(foot, q0, f"{foot} stays") for foot in FEET] if "h" in name else []
    levels = levels[1:] if hard else levels
    if "s" not in name:
        levels = [[*(task for level in levels for task in level), DampingTask(weight=DAMPING)]]
    scale = VELOCITY_SCALE.get(name, 1.0)
    limits = [JointPositionLimit(gain=POSITION_GAIN), JointVelocityLimit(scale=scale), *hard]
    poses = circle(start, ticks)
    if "x" in name:
        for pose in poses:
            pose[:3, 3] += OUT_OF_REACH
    return BenchmarkCase(name, robot, q0, frame, hand, Stack(levels=levels, limits=limits), poses)


def weights(name: str) -> dict[str, float]:
    """Return the weight of each task of a case, the factor of ½‖·‖²."""
    posture = 1e-6 if name.startswith("W1") else 1e-4
    return {"feet": 100.0, "hand": 1.0, "centre of mass": 1.0, "posture": posture}


def panda() -> tuple[Robot, Array, str]:
    """Return the Panda, its start posture (7,) [rad] and the frame of its hand."""
    q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    return Robot.load("panda", lock=FINGERS), q0, "panda_hand_tcp"


def panda_levels(hand: Latest) -> list[list[Task]]:
    """Return the strict levels of W1s."""
    levels: list[list[Task]] = [
        [FrameTask("panda_hand_tcp", target=hand, gain=GAIN)],
        [JointTask(gain=GAIN, weight=weights("W1")["posture"])],
    ]
    return levels


def talos() -> tuple[Robot, Array, str]:
    """Return TALOS on a floating base, its start posture (39,) [m, rad] and the frame of its hand."""
    robot = Robot.load("talos_reduced", floating=True)
    q0 = robot.posture("half_sitting")
    for joint, angle in BENT.items():
        q0[robot.position_index[robot.velocity_index(joint).start]] = angle
    return robot, q0, "gripper_right_base_link"


def talos_levels(hand: Latest) -> list[list[Task]]:
    """Return the strict levels of W2s."""
    feet = [FrameTask(foot, gain=GAIN, weight=weights("W2")["feet"]) for foot in FEET]
    levels: list[list[Task]] = [
        [*feet],
        [FrameTask("gripper_right_base_link", target=hand, gain=GAIN), CentreOfMassTask(gain=GAIN)],
        [JointTask(gain=GAIN, weight=weights("W2")["posture"])],
    ]
    return levels


def circle(start: Array, ticks: int) -> list[Array]:
    """Return poses (4, 4) on a circle through `start` in the y-z plane of the world."""
    poses = np.repeat(start[None], ticks, axis=0)
    phase = 2.0 * np.pi / PERIOD * DT * np.arange(1, ticks + 1)
    poses[:, 1, 3] += RADIUS * np.sin(phase)
    poses[:, 2, 3] += RADIUS * (1.0 - np.cos(phase))
    return list(poses)
