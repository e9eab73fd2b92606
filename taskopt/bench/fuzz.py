"""Random ticks of random stacks on four robots: is every answer proven, or reported as failed?

A stack is drawn from frame, position, orientation, box, gaze and joint tasks, some twice, in two to four
levels, inside position and velocity limits or limits on acceleration. Ticks go on from one another, so that
the resolver starts from the last active set, or jump to another posture, some of it on its limits, with
targets near, far out of reach, or where the frame is already.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich import box
from rich.table import Table

from taskopt.arrays import Array
from taskopt.configuration import Configuration
from taskopt.controller import Controller
from taskopt.errors import NotSolved
from taskopt.limit import JointAccelerationLimit, JointPositionLimit, JointVelocityLimit, Limit
from taskopt.problem.certificate import TOLERANCE
from taskopt.problem.resolution import Resolution
from taskopt.reference import Latest
from taskopt.robot import Robot, planar_arm
from taskopt.robot.pairs import random_posture
from taskopt.stack import Stack
from taskopt.task import BoxTask, FrameTask, GazeTask, JointTask, OrientationTask, PositionTask, Task

# Frames that a task may be about: a planar arm, seven joints, wheels without end, a floating base.
FRAMES = {
    "planar": ("tip", "joint3"),
    "panda": ("panda_hand", "panda_link4"),
    "tiago": ("arm_tool_link", "arm_4_link", "head_2_link"),
    "talos": ("gripper_left_base_link", "gripper_right_base_link", "left_sole_link", "right_sole_link"),
}
KEPT = 1e-9  # [rad, rad/s] by how much a limit may be missed after the step
RUN = 20  # ticks in a row, on average
STACK = 500  # ticks with one stack, on average


@dataclass
class Fuzzed:
    """What became of the ticks of one robot."""

    robot: str
    ticks: int = 0
    reported: int = 0  # failures that the resolver itself reports
    unproven: int = 0  # said to be solved, and not certified: the one thing that must not be
    certificate: float = 0.0  # the worst of those that are said to be solved
    position: float = 0.0  # [rad, m] worst excess after the step
    velocity: float = 0.0  # [rad/s, m/s] likewise
    bound: int = 0  # ticks with a limit or inequality active

    @property
    def clean(self) -> bool:
        """Whether every answer was proven or reported, and every limit kept."""
        return self.unproven == 0 and max(self.position, self.velocity) <= KEPT


def fuzz(
    name: str, ticks: int, seed: int = 0, resolver: str = "active-set", keep: Path | None = None
) -> Iterator[Fuzzed]:
    """Yield the tally of a robot after each of its ticks; failures are saved as hierarchies in `keep`."""
    robot, rng, tally = fuzz_robot(name), np.random.default_rng([seed, *name.encode()]), Fuzzed(name)
    while tally.ticks < ticks:
        control, targets, dt = _controller(robot, FRAMES[name], rng, resolver)
        q, fresh = random_posture(robot, rng), True
        for _ in range(min(1 + rng.geometric(1.0 / STACK), ticks - tally.ticks)):
            if fresh:
                q = _posture(robot, rng)
                control.plan.moved(np.zeros(robot.nv))
                _aim(targets, robot, q, rng)
            tally.ticks += 1
            try:
                resolution = control.step(q, 0.0)
                q_next = robot.integrate(q, resolution.v, dt)
                _judge(tally, resolution, robot, q_next, keep)
                q, fresh = q_next, rng.random() < 1.0 / RUN
            except NotSolved as error:
                _report(tally, error.resolution, keep)
                fresh = True
            yield tally


def fuzz_robot(name: str) -> Robot:
    """The robot of the table."""
    if name == "planar":
        return planar_arm([0.5, 0.5, 0.5, 0.3], lower=-2.5, upper=2.5, velocity=2.0)
    file = {"talos": "talos_reduced"}.get(name, name)
    return Robot.load(file, lock=("panda_finger_joint1", "panda_finger_joint2") if name == "panda" else ())


def table(tallies: Sequence[Fuzzed]) -> Table:
    """One row a robot."""
    out = Table(title="random ticks", box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("robot", "ticks", "bound", "reported", "unproven", "certificate", "position", "velocity"):
        out.add_column(heading, justify="left" if heading == "robot" else "right")
    for tally in tallies:
        share = f"{100.0 * tally.bound / max(tally.ticks, 1):.0f} %"
        counts = str(tally.ticks), share, str(tally.reported), str(tally.unproven)
        worst = tally.certificate, tally.position, tally.velocity
        out.add_row(tally.robot, *counts, *(f"{value:.1e}" for value in worst))
    return out


def _judge(tally: Fuzzed, resolution: Resolution, robot: Robot, q_next: Array, keep: Path | None) -> None:
    over = np.abs(resolution.v) - robot.velocity_limit
    tally.velocity = max(tally.velocity, float(over.max()))
    limited = robot.position_index >= 0
    at = q_next[robot.position_index[limited]]
    outside = np.maximum(robot.position_lower[limited] - at, at - robot.position_upper[limited])
    tally.position = max(tally.position, float(outside.max(initial=0.0)))
    tally.bound += bool(resolution.state[: robot.nv].any())
    if not resolution.claimed:
        _report(tally, resolution, keep)
        return
    tally.certificate = max(tally.certificate, resolution.certificate.worst)
    if not resolution.certified(TOLERANCE):
        tally.unproven += 1
        _save(tally, resolution, keep)


def _report(tally: Fuzzed, resolution: object, keep: Path | None) -> None:
    tally.reported += 1
    if isinstance(resolution, Resolution):
        _save(tally, resolution, keep)


def _save(tally: Fuzzed, resolution: Resolution, keep: Path | None) -> None:
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
        resolution.problem.save(keep / f"{tally.robot}-{tally.ticks}.npz")


def _controller(
    robot: Robot, frames: Sequence[str], rng: np.random.Generator, resolver: str
) -> tuple[Controller, list[tuple[str, Latest]], float]:
    """A random stack with its targets, each with the frame that it is for, and its period."""
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
    if rng.random() < 0.4:
        limits = [JointAccelerationLimit(rng.choice([2.0, 20.0, 200.0]))]
    return Controller(robot, Stack(levels, limits), resolver, dt), targets, dt


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


def _posture(robot: Robot, rng: np.random.Generator) -> Array:
    """Inside all limits; now and then some joints stand on one, or a hair away."""
    q = random_posture(robot, rng)
    if rng.random() < 0.3:
        for j in np.flatnonzero((robot.position_index >= 0) & (rng.random(robot.nv) < 0.3)):
            low, high = robot.position_lower[j], robot.position_upper[j]
            edge = low if rng.random() < 0.5 else high
            if np.isfinite(edge):
                q[robot.position_index[j]] = np.clip(edge + rng.choice([0.0, 1e-12, -1e-9, 1e-4]), low, high)
    return q


def _aim(targets: Sequence[tuple[str, Latest]], robot: Robot, q: Array, rng: np.random.Generator) -> None:
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
