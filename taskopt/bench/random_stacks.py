"""Random stacks with obstacles and limits, random postures and targets, for the fuzz run."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Box, Capsule, HalfSpace, Shape, Sphere
from taskopt.kinematics.limit import (
    JointAccelerationLimit,
    JointPositionLimit,
    JointVelocityLimit,
    Limit,
    ObstacleLimit,
    SelfCollisionLimit,
)
from taskopt.kinematics.robot import Robot, planar_arm
from taskopt.kinematics.robot.random_posture import random_posture
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Latest
from taskopt.kinematics.task import (
    BoxTask,
    FrameTask,
    GazeTask,
    JointTask,
    OrientationTask,
    PositionTask,
    Task,
)

# Frames that a task may have: of a planar arm, an arm with seven joints, a mobile base on wheels, and a
# walking robot with a floating base.
FRAMES = {
    "planar": ("tip", "joint3"),
    "panda": ("panda_hand", "panda_link4"),
    "tiago": ("arm_tool_link", "arm_4_link", "head_2_link"),
    "talos": ("gripper_left_base_link", "gripper_right_base_link", "left_sole_link", "right_sole_link"),
}


_SHARES = {1: [0.3, 0.25, 0.15, 0.2, 0.1], 2: [0.4, 0.35, 0.25, 0.0, 0.0]}  # of kinds of tasks, by order


@dataclass(frozen=True, eq=False)
class Draw:
    """A random stack.

    Attributes:
        stack: The stack.
        targets: The frame and the target of each task that has one.
        dt: Period [s].
        rests: True if v = 0, at order 2 v⁺ = 0, keeps all limits, so that they cannot contradict each
            other.
    """

    stack: Stack
    targets: list[tuple[str, Latest]]
    dt: float
    rests: bool


def fuzz_robot(name: str) -> Robot:
    """Load a robot.

    Args:
        name: A key of `FRAMES`.

    Returns:
        The robot; the fingers of the Panda are locked.
    """
    if name == "planar":
        return planar_arm([0.5, 0.5, 0.5, 0.3], lower=-2.5, upper=2.5, velocity=2.0, radius=0.02)
    file = {"talos": "talos_reduced"}.get(name, name)
    return Robot.load(file, lock=("panda_finger_joint1", "panda_finger_joint2") if name == "panda" else ())


def random_stack(robot: Robot, frames: Sequence[str], rng: np.random.Generator, order: int = 1) -> Draw:
    """Draw a stack of two to four levels inside limits; most stacks also keep distances.

    Args:
        robot: The robot.
        frames: Frames that tasks may have.
        rng: Source of random numbers.
        order: Order of the stack; at order 2 there are no boxes and cones.

    Returns:
        The stack; its targets must then be set by `aim`.
    """
    targets: list[tuple[str, Latest]] = []
    dt = float(rng.choice([1e-3, 5e-3, 2e-2]))
    levels = [
        [_task(frames, rng, targets, dt, order) for _ in range(rng.integers(1, 3))]
        for _ in range(rng.integers(1, 4))
    ]
    if rng.random() < 0.2:
        levels[-1].append(levels[0][0])
    if rng.random() < 0.7:
        levels.append([JointTask(gain=rng.uniform(0.1, 5.0))])
    limits: list[Limit] = [JointPositionLimit(rng.choice([0.05, 0.5, 1.0])), JointVelocityLimit()]
    rests = rng.random() >= 0.3
    if not rests:
        limits = [JointAccelerationLimit(rng.choice([2.0, 20.0, 200.0]))]
    stack = Stack(levels, limits + _distance_limits(robot, rng), damping=None, order=order)
    return Draw(stack, targets, dt, rests)


def random_start(robot: Robot, rng: np.random.Generator) -> Array:
    """Draw a posture inside all position limits; three of ten have joints at a limit or very near one.

    Args:
        robot: The robot.
        rng: Source of random numbers.

    Returns:
        (nq,) [rad, m].
    """
    q = random_posture(robot, rng)
    if rng.random() < 0.3:
        for j in np.flatnonzero((robot.position_index >= 0) & (rng.random(robot.nv) < 0.3)):
            lower, upper = robot.position_lower[j], robot.position_upper[j]
            edge = lower if rng.random() < 0.5 else upper
            if np.isfinite(edge):
                q[robot.position_index[j]] = np.clip(
                    edge + rng.choice([0.0, 1e-12, -1e-9, 1e-4]), lower, upper
                )
    return q


def aim(targets: Sequence[tuple[str, Latest]], robot: Robot, q: Array, rng: np.random.Generator) -> None:
    """Set targets where the frames are, near them, or out of reach.

    Args:
        targets: The frame and the target of each task.
        robot: The robot.
        q: Its posture, (nq,) [rad, m].
        rng: Source of random numbers.
    """
    configuration = Configuration(robot, q)
    for frame, target in targets:
        pose = configuration.pose(frame)
        pose[:3, 3] += rng.choice([0.0, 0.05, 3.0], p=[0.2, 0.5, 0.3]) * rng.normal(size=3)
        if rng.random() < 0.5:
            pose[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            pose[:3, 0] *= np.sign(np.linalg.det(pose[:3, :3]))
        velocity = 0.3 * rng.normal(size=6) if rng.random() < 0.5 else None
        target.set(pose, velocity)


def _distance_limits(robot: Robot, rng: np.random.Generator) -> list[Limit]:
    """Draw limits on distances to up to three obstacles and between the links of the robot."""
    limits: list[Limit] = []
    solids = [_beside(robot, rng) for _ in range(rng.integers(0, 4))]
    for kind in (ObstacleLimit, SelfCollisionLimit):
        margin = float(rng.choice([0.0, 0.005, 0.02]))
        influence, gain = margin + float(rng.choice([0.02, 0.1])), float(rng.choice([0.1, 1.0]))
        if kind is ObstacleLimit and solids:
            limits.append(ObstacleLimit(solids, margin, influence=influence, gain=gain))
        elif kind is SelfCollisionLimit and rng.random() < 0.5:
            limits.append(SelfCollisionLimit(margin, influence=influence, gain=gain))
    return limits


def _beside(robot: Robot, rng: np.random.Generator) -> Shape:
    """Draw an obstacle beside a link of the robot at a random posture."""
    configuration, shapes = Configuration(robot, random_posture(robot, rng)), robot.geometry.geometryObjects
    link = shapes[int(rng.integers(len(shapes)))]
    place = (configuration.joint_poses()[link.parentJoint] @ link.placement.homogeneous)[:3, 3]
    flat = np.array([1.0, 1.0, 0.0 if robot.name.startswith("planar") else 1.0])
    place = place + flat * rng.normal(0.0, 0.2, 3)
    match rng.integers(4):
        case 0:
            return Sphere(place, rng.uniform(0.02, 0.2))
        case 1:
            return Capsule(place, place + flat * rng.normal(0.0, 0.2, 3), rng.uniform(0.01, 0.1))
        case 2:
            return Box(place, rng.uniform(0.02, 0.3, 3))
        case _:
            normal = flat * rng.normal(size=3)
            normal /= np.linalg.norm(normal)
            return HalfSpace(normal, float(normal @ place) - rng.uniform(0.0, 0.5))


def _task(
    frames: Sequence[str], rng: np.random.Generator, targets: list[tuple[str, Latest]], dt: float, order: int
) -> Task:
    """Draw a task, and append its target if it has one."""
    frame, gain, target = str(rng.choice(frames)), rng.uniform(0.1, 0.5) / dt, Latest()
    kind = rng.choice(["pose", "position", "orientation", "box", "gaze"], p=_SHARES[order])
    expressed, weight = rng.choice(["own", "world"]), 10.0 ** rng.uniform(-1, 1)
    if kind == "box":
        centre, reach = rng.normal(0.3, 0.3, 3), rng.uniform(0.05, 0.5, 3)
        return BoxTask(frame, centre - reach, centre + reach, gain=gain, weight=weight)
    targets.append((frame, target))
    if kind == "gaze":
        return GazeTask(
            frame, target, rng.uniform(0.1, 1.0), axis=rng.normal(size=3), gain=gain, weight=weight
        )
    named = {"target": target, "gain": gain, "weight": weight, "expressed": expressed}
    if kind == "pose":
        return FrameTask(frame, axes=rng.choice(["xyzrpy", "xyz", "xy y", "z rp"]), **named)
    return PositionTask(frame, **named) if kind == "position" else OrientationTask(frame, **named)
