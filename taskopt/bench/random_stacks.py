"""Random stacks with obstacles and limits, postures and targets for the fuzz run."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.collision.pairs import random_posture
from taskopt.kinematics.collision.shapes import Box, Capsule, HalfSpace, Shape, Sphere
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import JointAccelerationLimit, JointPositionLimit, JointVelocityLimit, Limit
from taskopt.kinematics.limit.obstacle import ObstacleLimit
from taskopt.kinematics.limit.self_collision import SelfCollisionLimit
from taskopt.kinematics.robot import Robot, planar_arm
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

# Frames that a task may be about: a planar arm, seven joints, wheels without end, a floating base.
FRAMES = {
    "planar": ("tip", "joint3"),
    "panda": ("panda_hand", "panda_link4"),
    "tiago": ("arm_tool_link", "arm_4_link", "head_2_link"),
    "talos": ("gripper_left_base_link", "gripper_right_base_link", "left_sole_link", "right_sole_link"),
}


@dataclass(frozen=True, eq=False)
class Draw:
    """A stack, its targets with the frame that each is for, its period [s], and whether v = 0 is allowed."""

    stack: Stack
    targets: list[tuple[str, Latest]]
    dt: float
    rests: bool


def fuzz_robot(name: str) -> Robot:
    """The robot of the table."""
    if name == "planar":
        return planar_arm([0.5, 0.5, 0.5, 0.3], lower=-2.5, upper=2.5, velocity=2.0, radius=0.02)
    file = {"talos": "talos_reduced"}.get(name, name)
    return Robot.load(file, lock=("panda_finger_joint1", "panda_finger_joint2") if name == "panda" else ())


def random_stack(robot: Robot, frames: Sequence[str], rng: np.random.Generator) -> Draw:
    """Two to four levels inside limits; in four of five stacks, distances to obstacles and to itself too."""
    targets: list[tuple[str, Latest]] = []
    dt = float(rng.choice([1e-3, 5e-3, 2e-2]))
    levels = [
        [_task(frames, rng, targets, dt) for _ in range(rng.integers(1, 3))]
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
    return Draw(Stack(levels, limits + _distance_limits(robot, rng)), targets, dt, rests)


def random_start(robot: Robot, rng: np.random.Generator) -> Array:
    """A posture inside all limits; now and then some joints stand on one, or a hair away."""
    q = random_posture(robot, rng)
    if rng.random() < 0.3:
        for j in np.flatnonzero((robot.position_index >= 0) & (rng.random(robot.nv) < 0.3)):
            low, high = robot.position_lower[j], robot.position_upper[j]
            edge = low if rng.random() < 0.5 else high
            if np.isfinite(edge):
                q[robot.position_index[j]] = np.clip(edge + rng.choice([0.0, 1e-12, -1e-9, 1e-4]), low, high)
    return q


def aim(targets: Sequence[tuple[str, Latest]], robot: Robot, q: Array, rng: np.random.Generator) -> None:
    """Targets where the frames are, near by, or out of reach."""
    at = Configuration(robot, q)
    for frame, target in targets:
        pose = at.pose(frame)
        pose[:3, 3] += rng.choice([0.0, 0.05, 3.0], p=[0.2, 0.5, 0.3]) * rng.normal(size=3)
        if rng.random() < 0.5:
            pose[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            pose[:3, 0] *= np.sign(np.linalg.det(pose[:3, :3]))
        velocity = 0.3 * rng.normal(size=6) if rng.random() < 0.5 else None
        target.set(pose, velocity)


def _distance_limits(robot: Robot, rng: np.random.Generator) -> list[Limit]:
    """Up to three obstacles beside the links of some posture, and the robot itself, in any combination."""
    limits: list[Limit] = []
    solids = [_beside(robot, rng) for _ in range(rng.integers(0, 4))]
    for kind in (ObstacleLimit, SelfCollisionLimit):
        margin = float(rng.choice([0.0, 0.005, 0.02]))
        numbers = margin, margin + float(rng.choice([0.02, 0.1])), float(rng.choice([0.1, 1.0]))
        if kind is ObstacleLimit and solids:
            limits.append(ObstacleLimit(solids, *numbers))
        elif kind is SelfCollisionLimit and rng.random() < 0.5:
            limits.append(SelfCollisionLimit(*numbers))
    return limits


def _beside(robot: Robot, rng: np.random.Generator) -> Shape:
    at, shapes = Configuration(robot, random_posture(robot, rng)), robot.geometry.geometryObjects
    link = shapes[int(rng.integers(len(shapes)))]
    place = (at.joint_poses()[link.parentJoint] @ link.placement.homogeneous)[:3, 3]
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
    frames: Sequence[str], rng: np.random.Generator, targets: list[tuple[str, Latest]], dt: float
) -> Task:
    frame, gain, target = str(rng.choice(frames)), rng.uniform(0.1, 0.5) / dt, Latest()
    kind = rng.choice(["pose", "position", "orientation", "box", "gaze"], p=[0.3, 0.25, 0.15, 0.2, 0.1])
    expressed, weight = rng.choice(["own", "world"]), 10.0 ** rng.uniform(-1, 1)
    if kind == "box":
        centre, reach = rng.normal(0.3, 0.3, 3), rng.uniform(0.05, 0.5, 3)
        return BoxTask(frame, centre - reach, centre + reach, gain=gain, weight=weight)
    targets.append((frame, target))
    if kind == "gaze":
        return GazeTask(
            frame, target, rng.uniform(0.1, 1.0), axis=rng.normal(size=3), gain=gain, weight=weight
        )
    named = {"reference": target, "gain": gain, "weight": weight, "expressed": expressed}
    if kind == "pose":
        return FrameTask(frame, axes=rng.choice(["xyzrpy", "xyz", "xy y", "z rp"]), **named)
    return PositionTask(frame, **named) if kind == "position" else OrientationTask(frame, **named)
