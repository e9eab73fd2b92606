"""Random still targets that a robot must come to rest at, or as near as it can.

    python benchmarks/accept/rest.py              # 200 targets a robot; rewrites rest.txt
    python benchmarks/accept/rest.py --targets 12 --robot panda   # a sample, to the terminal only

The stack is [[FrameTask], [JointTask]] with limits on positions and velocities, gain 5 1/s and Δt 10 ms, and
nothing else is set; `--fast` is ten times the gain and a tenth of Δt. A sixth of the targets each is

    reachable    the pose at a random posture
    blocked      the pose at a posture beyond the limits of joints
    out          a reachable pose moved by 0.3 to 1.5 m
    stretched    the pose at a posture that reaches as far as it can in a random direction
    obstacle     a reachable pose in a ball that the robot must not touch, and does not at the start
    self         a reachable pose moved towards the base, with a limit on self-collision

A run lasts 10 s. In its last second the largest change of a velocity from tick to tick is below 1e-3 in 95 %
of the runs of a robot, and below 0.05 in all. The error at the end, with the weights of the task, is at most
1.05 times that of the local optimum within the limits of joints that SciPy's L-BFGS-B finds from there, or at
most 0.1 mm or mrad more. A line search may leap out of the basin: where it ends more than 1 rad away, but
derivatives by finite differences say that the run ended near a local optimum of second order, a step of
Newton's method leads to the optimum instead. Limits on distances are not in that problem, so that errors are
compared for the first four kinds only.
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported

import argparse
import itertools
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from taskopt import (
    Configuration,
    Controller,
    FrameTask,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    ObstacleLimit,
    Robot,
    SelfCollisionLimit,
    Sphere,
    Stack,
    TaskoptError,
)
from taskopt.arrays import Array
from taskopt.kinematics.limit import Limit
from taskopt.kinematics.limit.bound_distance import BoundDistance
from taskopt.kinematics.pose import log6

KINDS = ("reachable", "blocked", "out", "stretched", "obstacle", "self")
COMPARED = KINDS[:4]  # without limits on distances
ROBOTS = ("panda", "ur10", "tiago_dual", "talos")
SECONDS, GAIN, PERIOD = 10.0, 5.0, 0.01  # [s], [1/s], [s]
STILL, LARGEST, SHARE, WORSE = 1e-3, 0.05, 0.95, 1.05
SMALL_ERROR = 1e-4  # [m, rad] by which an error may be larger than the best in any case
LEAP = 1.0  # [rad, m] from where a run ends, beyond which another optimum may have been found
AT_LIMIT = 1e-6  # [rad, m] at which a joint counts as at its limit
DIFFERENCE = 1e-4  # [rad, m] steps of finite differences
FLAT = 1e-6  # least eigenvalue of a Hessian that is more than the error of the differences
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
OUTPUT = Path(__file__).with_suffix(".txt")


@dataclass(frozen=True)
class Outcome:
    """Results of one run.

    Attributes:
        kind: One of `KINDS`.
        jump: Largest change of a velocity from tick to tick in the last second [rad/s].
        error: Error at the end [m, rad].
        best: Error of the local optimum [m, rad]; NaN if it was not computed.
        damped: Share of damped ticks.
        stopped: Name of the error that ended the run, or empty.
    """

    kind: str
    jump: float
    error: float
    best: float
    damped: float
    stopped: str = ""

    @property
    def near(self) -> bool:
        """True if the error is that of the local optimum, or was not compared."""
        return not self.error > max(WORSE * self.best, self.best + SMALL_ERROR)


def subject(name: str) -> tuple[Robot, Array, str]:
    """Return a robot, its start posture and its frame."""
    if name == "panda":
        robot = Robot.load("panda", lock=FINGERS)
        return robot, robot.posture("default"), "panda_hand_tcp"
    if name == "ur10":
        return Robot.load("ur10_robot"), np.array([0.0, -1.2, 1.6, -1.9, -1.57, 0.0]), "tool0"
    if name == "tiago_dual":
        joints = Robot.load("tiago_dual").velocity_names
        lock = tuple(joint for joint in joints if not joint.startswith(("torso", "arm_", "head")))
        robot = Robot.load("tiago_dual", lock=lock)
        room = 0.1 * (robot.position_upper - robot.position_lower)
        start = np.clip(robot.neutral + 0.3, robot.position_lower + room, robot.position_upper - room)
        return robot, start, "arm_left_7_link"
    full = Robot.load("talos_reduced", floating=True)
    still = tuple(joint for joint in full.velocity_names if "leg" in joint or "gripper" in joint)
    robot = Robot.load("talos_reduced", floating=False, lock=still)
    half = 0.3 * robot.position_lower + 0.7 * robot.position_upper
    return robot, half, "arm_right_7_link"


def target(name: str, kind: str, seed: int) -> tuple[Array, list[Limit]]:
    """Return a target pose, and the limits that block it."""
    rng = np.random.default_rng([ROBOTS.index(name), KINDS.index(kind), seed])
    robot, start, frame = subject(name)
    while True:
        pose, limits = drawn(robot, frame, kind, rng)
        if kind != "obstacle" or clearance(limits[0], Configuration(robot, start)) > 0.0:
            return pose, limits


def clearance(limit: Limit, at: Configuration) -> float:
    """Return the least distance of a robot from the obstacles of a limit [m]."""
    bound = limit.bind(at.robot, PERIOD)
    assert isinstance(bound, BoundDistance)
    bound.distances.update(at)
    return float(bound.distances.distance.min())


def drawn(robot: Robot, frame: str, kind: str, rng: np.random.Generator) -> tuple[Array, list[Limit]]:
    """Draw a target pose, and the limits that block it."""
    lower, upper = np.maximum(robot.position_lower, -np.pi), np.minimum(robot.position_upper, np.pi)
    if kind == "blocked":
        beyond = 0.2 * (upper - lower)
        return Configuration(robot, rng.uniform(lower - beyond, upper + beyond)).pose(frame).copy(), []
    q = rng.uniform(lower, upper)
    direction = rng.standard_normal(3)
    direction /= np.linalg.norm(direction)
    if kind == "stretched":
        q = minimize(
            lambda q: -direction @ Configuration(robot, q).pose(frame)[:3, 3],
            q,
            bounds=list(zip(lower, upper, strict=True)),
            method="L-BFGS-B",
            options={"maxiter": 60},
        ).x
    pose = Configuration(robot, q).pose(frame).copy()
    if kind == "out":
        pose[:3, 3] += rng.uniform(0.3, 1.5) * direction
    if kind == "obstacle":
        return pose, [ObstacleLimit(Sphere(tuple(pose[:3, 3]), 0.12))]
    if kind == "self":
        pose[:3, 3] *= 0.3
        return pose, [SelfCollisionLimit()]
    return pose, []


def best_error(robot: Robot, frame: str, pose: Array, q: Array) -> float:
    """Return the error of the local optimum that SciPy finds from q, within the limits of the joints."""

    def cost(q: Array) -> float:
        actual = Configuration(robot, q).pose(frame)
        return float(np.sum(error_of(actual, pose) ** 2))

    bounds = list(zip(robot.position_lower, robot.position_upper, strict=True))
    inside = np.clip(q, robot.position_lower, robot.position_upper)
    found = minimize(cost, inside, bounds=bounds, method="L-BFGS-B", options={"ftol": 1e-15, "gtol": 1e-10})
    best = min(found.fun, cost(inside))
    if np.abs(found.x - inside).max() > LEAP:
        decrease = newton_decrease(robot, cost, inside)
        best = best if decrease is None else max(cost(inside) - decrease, 0.0)
    return float(np.sqrt(best))


def newton_decrease(robot: Robot, cost: Callable[[Array], float], q: Array) -> float | None:
    """Return by how much Newton's method lowers a cost from q to a local optimum, None if none is near.

    Joints at a limit, against which the cost pushes them, are held. The Hessian of the others must not be
    negative in any direction, and the gradient zero where it is.
    """
    steps, n = DIFFERENCE * np.eye(robot.nq), robot.nq
    gradient = np.array([cost(q + step) - cost(q - step) for step in steps]) / (2.0 * DIFFERENCE)
    at_lower, at_upper = q - robot.position_lower < AT_LIMIT, robot.position_upper - q < AT_LIMIT
    free = np.flatnonzero(~((at_lower & (gradient > 0.0)) | (at_upper & (gradient < 0.0))))
    hessian = np.zeros((n, n))
    for i, j in itertools.product(free, free):
        both, apart = steps[i] + steps[j], steps[i] - steps[j]
        hessian[i, j] = cost(q + both) - cost(q + apart) - cost(q - apart) + cost(q - both)
    curvature, directions = np.linalg.eigh(hessian[np.ix_(free, free)] / (4.0 * DIFFERENCE**2))
    along, curved = directions.T @ gradient[free], curvature > FLAT
    if curvature.min(initial=0.0) < -FLAT or np.abs(along[~curved]).max(initial=0.0) > FLAT:
        return None
    return 0.5 * float(np.sum(along[curved] ** 2 / curvature[curved]))


def error_of(actual: Array, desired: Array) -> Array:
    """Return the error of position and orientation as a `FrameTask` has it, (6,) [m, rad]."""
    return log6(np.linalg.inv(actual) @ desired)


def outcome(name: str, kind: str, seed: int, gain: float, dt: float) -> Outcome:
    """Run one target."""
    robot, q, frame = subject(name)
    pose, limits = target(name, kind, seed)
    around = [JointPositionLimit(), JointVelocityLimit(), *limits]
    stack = Stack([[FrameTask(frame, target=pose, gain=gain)], [JointTask()]], around)
    control, v, jumps = Controller(robot, stack, dt=dt), np.zeros(robot.nv), []
    ticks = round(SECONDS / dt)
    for k in range(ticks):
        try:
            now = control.step(q, k * dt).v.copy()
        except TaskoptError as error:
            return Outcome(kind, np.inf, np.nan, np.nan, control.damped_ticks / (k + 1), type(error).__name__)
        jumps.append(float(np.abs(now - v).max()))
        q, v = robot.integrate(q, now, dt), now
    last = max(jumps[-round(1.0 / dt) :])
    return ended(kind, Configuration(robot, q), frame, pose, last, control.damped_ticks / ticks)


def ended(
    kind: str, end: Configuration, frame: str, pose: Array, jump: float, damped: float = 0.0
) -> Outcome:
    """Judge a run by where it ends, with the largest change of a velocity in its last second."""
    error = float(np.linalg.norm(error_of(end.pose(frame), pose)))
    compared = kind in COMPARED and error >= SMALL_ERROR
    best = best_error(end.robot, frame, pose, end.q) if compared else np.nan
    return Outcome(kind, jump, error, best, damped)


def told(name: str, found: list[Outcome]) -> tuple[str, bool]:
    """Return the table of one robot, and if it is accepted."""
    lines = [f"{name}: {len(found)} targets", "kind        runs  still  largest  near  damped  stopped"]
    for kind in KINDS:
        own = [run for run in found if run.kind == kind]
        if own:
            still = sum(run.jump < STILL for run in own)
            lines.append(
                f"{kind:10} {len(own):5} {still:6} {max(run.jump for run in own):8.1e} "
                f"{sum(run.near for run in own):5} {np.mean([run.damped for run in own]):7.1%}  "
                f"{dict(Counter(run.stopped for run in own if run.stopped)) or ''}"
            )
    share = np.mean([run.jump < STILL for run in found])
    largest = max(run.jump for run in found)
    accepted = bool(share >= SHARE and largest < LARGEST and all(run.near for run in found))
    lines.append(f"still {share:.1%}, largest change {largest:.1e} rad/s: {'yes' if accepted else 'NO'}")
    return "\n".join(lines), accepted


def main() -> int:
    """Run the targets, and print or write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--targets", type=int, default=200)
    parser.add_argument("--robot", choices=ROBOTS, nargs="+", default=list(ROBOTS))
    parser.add_argument("--kind", choices=KINDS, nargs="+", default=list(KINDS))
    parser.add_argument("--fast", action="store_true")
    options = parser.parse_args()
    gain, dt = (10.0 * GAIN, 0.1 * PERIOD) if options.fast else (GAIN, PERIOD)
    tables, accepted = [f"gain {gain:g} 1/s, period {1e3 * dt:g} ms"], True
    for name in options.robot:
        jobs = [(options.kind[i % len(options.kind)], i) for i in range(options.targets)]
        table, passed = told(name, [outcome(name, kind, i, gain, dt) for kind, i in jobs])
        tables.append(table)
        accepted &= passed
        print(table, flush=True)
    if options.targets == parser.get_default("targets") and not options.fast:
        OUTPUT.write_text("\n\n".join(tables) + "\n", encoding="utf-8")
    return 0 if accepted else 1


if __name__ == "__main__":
    sys.exit(main())
