"""Random still targets at which a robot that is commanded by accelerations must come to rest.

    python benchmarks/accept/rest_of_accelerations.py    # 100 targets a robot; rewrites its .txt
    python benchmarks/accept/rest_of_accelerations.py --targets 12 --robot panda   # to the terminal only

The stack is [[FrameTask], [JointTask]] of order 2 with a `JointAccelerationLimit` of 10 rad/s², which keeps
ranges and speeds, too; gains are 8 1/s and 4 1/s, Δt is 10 ms. A third of the targets each is

    reachable    the pose at a random posture
    blocked      the pose at a posture beyond the limits of joints
    out          a reachable pose moved by 0.3 to 1.5 m

A run lasts 10 s from a random posture, once without damping and once with `RestDamping`. It is at rest if the
largest velocity at its end is below 1e-6 rad/s. What is not at rest is told apart by the largest change of an
acceleration from tick to tick in the last second: below 0.1 rad/s² it creeps along a slope that is nearly
level, and else it swings. All bounds must hold at every tick: positions and velocities to 1e-9, accelerations
to 1e-9 rad/s².
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taskopt import (
    Configuration,
    Controller,
    FrameTask,
    JointAccelerationLimit,
    JointTask,
    RestDamping,
    Robot,
    Stack,
    TaskoptError,
)
from taskopt.arrays import Array

KINDS = ("reachable", "blocked", "out")
SECONDS, GAIN, POSTURE_GAIN, ACCELERATION = 10.0, 8.0, 4.0, 10.0  # [s], [1/s], [1/s], [rad/s²]
STILL, SMOOTH, KEPT = 1e-6, 0.1, 1e-9
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
FRAMES = {"panda": "panda_hand_tcp", "ur10": "tool0"}
OUTPUT = Path(__file__).with_suffix(".txt")


@dataclass(frozen=True)
class Outcome:
    """Results of one run.

    Attributes:
        kind: One of `KINDS`.
        speed: Largest velocity at the end [rad/s].
        change: Largest change of an acceleration from tick to tick in the last second [rad/s²].
        beyond: The most by which a limit was broken [rad, rad/s, rad/s²].
        damped: Share of damped ticks.
        stopped: Name of the error that ended the run, or empty.
    """

    kind: str
    speed: float
    change: float
    beyond: float
    damped: float
    stopped: str = ""


def subject(name: str) -> Robot:
    """Return a robot."""
    return Robot.load("panda", lock=FINGERS) if name == "panda" else Robot.load("ur10_robot")


def problem(robot: Robot, frame: str, kind: str, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return a start posture and a target pose."""
    lower, upper = np.maximum(robot.position_lower, -np.pi), np.minimum(robot.position_upper, np.pi)
    beyond = 0.2 * (upper - lower) if kind == "blocked" else 0.0
    start, goal = rng.uniform(lower + 0.1, upper - 0.1), rng.uniform(lower - beyond, upper + beyond)
    pose = Configuration(robot, goal).pose(frame).copy()
    direction = rng.standard_normal(3)
    if kind == "out":
        pose[:3, 3] += rng.uniform(0.3, 1.5) * direction / np.linalg.norm(direction)
    return start, pose


def outcome(name: str, kind: str, seed: int, dt: float, *, damped: bool) -> Outcome:
    """Run one target."""
    robot, frame = subject(name), FRAMES[name]
    q, pose = problem(robot, frame, kind, np.random.default_rng([list(FRAMES).index(name), seed]))
    levels = [[FrameTask(frame, target=pose, gain=GAIN)], [JointTask(gain=POSTURE_GAIN)]]
    limit, damping = JointAccelerationLimit(ACCELERATION), RestDamping() if damped else None
    control = Controller(robot, Stack(levels, [limit], order=2, damping=damping), dt=dt)
    control.start(q)
    a, change, beyond = np.zeros(robot.nv), [], 0.0
    ticks = round(SECONDS / dt)
    for k in range(ticks):
        try:
            now = control.step(q, k * dt).a.copy()
        except TaskoptError as error:
            share = control.damped_ticks / (k + 1)
            return Outcome(kind, np.inf, np.inf, beyond, share, type(error).__name__)
        q, v = control.after()
        change.append(float(np.abs(now - a).max()))
        a = now
        over = q - robot.position_upper, robot.position_lower - q, np.abs(v) - robot.velocity_limit
        beyond = max(beyond, *(float(x.max()) for x in over), float(np.abs(a).max()) - ACCELERATION)
    last = max(change[-round(1.0 / dt) :])
    return Outcome(kind, float(np.abs(v).max()), last, beyond, control.damped_ticks / ticks)


def told(name: str, found: list[Outcome], *, damped: bool) -> str:
    """Return the table of one robot."""
    lines = [
        f"{name}, {len(found)} targets, {'RestDamping' if damped else 'without damping'}",
        "kind        runs  at rest  creeping  swinging  stopped  largest speed   beyond  damped",
    ]
    for kind in (*KINDS, "all"):
        own = [run for run in found if kind in (run.kind, "all")]
        if own:
            moving = [run for run in own if not run.speed < STILL and not run.stopped]
            creeping = sum(run.change < SMOOTH for run in moving)
            lines.append(
                f"{kind:10} {len(own):5} {sum(run.speed < STILL for run in own):8} {creeping:9} "
                f"{len(moving) - creeping:9} {sum(bool(run.stopped) for run in own):8} "
                f"{max((run.speed for run in own if not run.stopped), default=0.0):14.1e} "
                f"{max(run.beyond for run in own):8.0e} {np.mean([run.damped for run in own]):7.1%}"
            )
    return "\n".join(lines)


def main() -> int:
    """Run the targets, and print or write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--targets", type=int, default=100)
    parser.add_argument("--robot", choices=FRAMES, nargs="+", default=list(FRAMES))
    parser.add_argument("--dt", type=float, default=0.01)
    options = parser.parse_args()
    tables, accepted = [f"gain {GAIN:g} 1/s, period {1e3 * options.dt:g} ms, {SECONDS:g} s"], True
    for name in options.robot:
        for damped in (False, True):
            jobs = [(KINDS[i % len(KINDS)], i) for i in range(options.targets)]
            found = [outcome(name, kind, i, options.dt, damped=damped) for kind, i in jobs]
            tables.append(told(name, found, damped=damped))
            kept = all(run.beyond < KEPT for run in found)
            accepted &= kept and (not damped or all(run.speed < STILL for run in found))
            print(tables[-1], flush=True)
    tables.append(f"all at rest with damping, and all limits kept: {'yes' if accepted else 'NO'}")
    print(tables[-1])
    if options.targets == parser.get_default("targets"):
        OUTPUT.write_text("\n\n".join(tables) + "\n", encoding="utf-8")
    return 0 if accepted else 1


if __name__ == "__main__":
    sys.exit(main())
