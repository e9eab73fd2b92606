"""Reachable poses of five arms, solved by `PoseSolver`: how many, how exactly, and in which time.

    python benchmarks/accept/solve_pose.py        # 1,000 poses of each arm; rewrites solve_pose.txt
    python benchmarks/accept/solve_pose.py --only panda --count 100
    python benchmarks/accept/solve_pose.py --pink 200   # beside it pink's loop, if it is installed

A pose is that of the last frame at a posture drawn uniformly within the joint limits, in which no two
links collide. It counts as solved if Pinocchio computes it from the answer to 1e-6 m and 1e-6 rad, and if
the answer is within the joint limits. The same poses are solved a second time with a `SelfCollisionLimit`;
then no pair of links may overlap by more than 1e-6 m, either. No start is given, so that each search begins
at postures that the solver has drawn itself. CPU time is that of the thread, garbage collection is off, and
the first solution is not counted. An arm is accepted if 99.5 % of its poses are solved in 50 ms each.

pink has no static inverse kinematics; beside ours stands the loop that its examples show (`solve_ik` and
`integrate_inplace` with limits on positions and velocities), from the middle of the joint ranges, and again
from there and then from up to 20 uniform postures until one meets the pose. Each of its runs may take 200
steps of 0.1 s, and ends where pink finds no solution. Its damping is 1e-6, with which it meets more poses in
less time than with 1e-12, the default, or 1e-9.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported

import argparse
import gc
import platform
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from time import thread_time

import numpy as np
import pinocchio as pin

from taskopt import Configuration, JointPositionLimit, Limit, PoseSolver, Robot, SelfCollisionLimit
from taskopt.arrays import Array, Mask
from taskopt.kinematics.collision.measure import Distances
from taskopt.kinematics.robot.dh import DHRow
from taskopt.loop.pose.starts import drawn

SEED = 2026  # of the poses; the solver draws its starts from another one
SHARE = 0.995  # of the poses that must be solved
EXACT = 1e-6  # [m], [rad]
SLOWEST = 50.0  # [ms] CPU of one pose
PINK_STARTS, PINK_STEPS, PINK_PERIOD = 20, 200, 0.1
PINK_SETTINGS = {"solver": "daqp", "damping": 1e-6, "safety_break": False}
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
OUTPUT = Path(__file__).with_suffix(".txt")
NAMES = ("panda", "ur10_robot", "xarm7", "iiwa", "anthropomorphic_with_wrist")
LAST = {"panda": "panda_hand", "ur10_robot": "tool0", "xarm7": "link_eef"}

Answer = Callable[[Array], Array]


@dataclass(frozen=True)
class Outcome:
    """What came out for one arm and one way to solve.

    Attributes:
        name: Name of the arm.
        way: Who solved, and with what.
        solved: Poses that were met, each true or false.
        milliseconds: CPU time of each pose [ms].
    """

    name: str
    way: str
    solved: Mask
    milliseconds: Array

    @property
    def accepted(self) -> bool:
        """True if enough poses were met in the time that each may take."""
        return float((self.solved & (self.milliseconds <= SLOWEST)).mean()) >= SHARE

    def __str__(self) -> str:
        ms = self.milliseconds
        return (
            f"{self.name:28s} {self.way:30s} {int(self.solved.sum()):5d} of {len(ms):5d} "
            f"{int((self.solved & (ms <= SLOWEST)).sum()):9d} "
            f"{np.median(ms):8.2f} {np.percentile(ms, 99):8.2f} {ms.max():8.2f}"
        )


HEADER = (
    f"{'arm':28s} {'solved by':30s} {'poses met':>14s} {'in 50 ms':>9s} {'median':>8s} {'p99':>8s} "
    f"{'largest':>8s}"
)


def arm(name: str) -> tuple[Robot, str]:
    """Return an arm and the frame whose poses are asked for.

    Args:
        name: One of `NAMES`.

    Returns:
        The arm, and the name of the frame.
    """
    if name == "iiwa":
        return iiwa(), "tip"
    return Robot.load(name, lock=FINGERS if name == "panda" else ()), LAST.get(name, "tip")


def iiwa() -> Robot:
    """Return a KUKA LBR iiwa 7 R800 from the lengths and joint ranges of its data sheet."""
    quarter, degrees = np.pi / 2.0, (170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0)
    turns = (-quarter, quarter, quarter, -quarter, -quarter, quarter, 0.0)
    offsets = (0.34, 0.0, 0.4, 0.0, 0.4, 0.0, 0.126)
    ranges = np.deg2rad(degrees)
    rows = [
        DHRow(0.0, turn, offset, 0.0, lower=-limit, upper=limit)
        for turn, offset, limit in zip(turns, offsets, ranges, strict=True)
    ]
    return Robot.from_dh(rows, name="iiwa")


def self_distances(robot: Robot) -> Distances:
    """Return the distances between the links of an arm that `SelfCollisionLimit` keeps."""
    return SelfCollisionLimit(margin=0.0).bind(robot, 1.0).distances


def reachable(robot: Robot, frame: str, count: int) -> list[Array]:
    """Return poses of postures within the limits in which no two links collide.

    Args:
        robot: The arm.
        frame: The frame.
        count: How many.

    Returns:
        Poses (4, 4) [m].
    """
    configuration, distances, poses = Configuration(robot, robot.neutral), self_distances(robot), []
    for q in drawn(robot, 20 * count, SEED):
        configuration.update(q)
        distances.update(configuration)
        if distances.distance.min() > 0.0 and len(poses) < count:
            poses.append(configuration.pose(frame))
    return poses


class Judge:
    """Judge postures by Pinocchio alone.

    Args:
        robot: The arm.
        frame: The frame whose pose is asked for.
        distances: Distances between links that must not be negative; None: links may overlap.
    """

    def __init__(self, robot: Robot, frame: str, distances: Distances | None = None) -> None:
        self._robot, self._frame = robot, robot.frame_id(frame)
        self._data = robot.model.createData()
        self._distances, self._at = distances, Configuration(robot, robot.neutral)

    def met(self, q: Array, target: Array) -> bool:
        """Return True if a posture has the pose, keeps the limits, and no links overlap.

        Args:
            q: Posture, (nq,) [rad, m].
            target: Pose (4, 4) [m].
        """
        pin.framesForwardKinematics(self._robot.model, self._data, q)
        reached = self._data.oMf[self._frame]
        position = float(np.linalg.norm(reached.translation - target[:3, 3]))
        orientation = float(np.linalg.norm(pin.log3(reached.rotation.T @ target[:3, :3])))
        if self._distances is not None:
            self._at.update(q)
            self._distances.update(self._at)
            if self._distances.distance.min() < -EXACT:
                return False
        return position <= EXACT and orientation <= EXACT and not self._robot.outside(q)


def measure(name: str, way: str, answer: Answer, judge: Judge, poses: Sequence[Array]) -> Outcome:
    """Solve poses one after the other.

    Args:
        name: Name of the arm.
        way: Who solves.
        answer: From a pose (4, 4) to a posture (nq,).
        judge: Judges the posture.
        poses: The poses.

    Returns:
        The outcome.
    """
    answer(poses[0])
    solved, seconds = [], []
    gc.collect()
    gc.disable()
    for target in poses:
        begin = thread_time()
        q = answer(target)
        seconds.append(thread_time() - begin)
        solved.append(judge.met(q, target))
    gc.enable()
    return Outcome(name, way, np.array(solved), 1e3 * np.array(seconds))


def ours(name: str, count: int, *, apart: bool) -> Outcome:
    """Solve the poses of an arm.

    Args:
        name: Name of the arm.
        count: Number of poses.
        apart: Keep its links apart, too.

    Returns:
        The outcome.
    """
    robot, frame = arm(name)
    poses = reachable(robot, frame, count)
    limits: list[Limit] = [JointPositionLimit()]
    if apart:
        limits.append(SelfCollisionLimit(margin=0.0))
    solver = PoseSolver(robot, {frame: poses[0]}, limits=limits)
    judge = Judge(robot, frame, self_distances(robot) if apart else None)
    way = "taskopt, links kept apart" if apart else "taskopt"
    return measure(name, way, lambda target: solver.solve({frame: target}).q, judge, poses)


class PinkLoop:
    """The loop that pink's examples show, until a pose is met.

    Args:
        robot: The arm.
        frame: The frame.
        judge: Says when the pose is met.
    """

    def __init__(self, robot: Robot, frame: str, judge: Judge) -> None:
        import pink  # pyright: ignore[reportMissingImports]
        from pink.exceptions import PinkError  # pyright: ignore[reportMissingImports]
        from pink.tasks import FrameTask  # pyright: ignore[reportMissingImports]

        self._robot, self._judge, self._solve, self._error = robot, judge, pink.solve_ik, PinkError
        model = robot.model
        self._configuration = pink.Configuration(model, model.createData(), robot.posture("middle"))
        self._task = FrameTask(frame, position_cost=1.0, orientation_cost=1.0)
        self._starts = drawn(robot, PINK_STARTS, SEED + 1)

    def from_one_start(self, target: Array) -> Array:
        """Return the posture at the end of one run from the middle of the joint ranges.

        Args:
            target: Pose (4, 4) [m].
        """
        return self._run(self._robot.posture("middle"), target)

    def from_many_starts(self, target: Array) -> Array:
        """Return the first posture that meets the pose, from the middle and then from uniform postures.

        Args:
            target: Pose (4, 4) [m].
        """
        q = self._robot.posture("middle")
        for start in [q, *self._starts]:
            q = self._run(start, target)
            if self._judge.met(q, target):
                break
        return q

    def _run(self, q: Array, target: Array) -> Array:
        """Run from one posture until the pose is met, or for `PINK_STEPS` steps."""
        self._task.set_target(pin.SE3(target))
        self._configuration.update(q)
        for _ in range(PINK_STEPS):
            try:
                v = self._solve(self._configuration, [self._task], PINK_PERIOD, **PINK_SETTINGS)
            except self._error:
                break
            self._configuration.integrate_inplace(v, PINK_PERIOD)
            if np.abs(self._task.compute_error(self._configuration)).max() < 0.5 * EXACT:
                break
        return self._configuration.q.copy()


def pinks(name: str, count: int) -> Iterator[Outcome]:
    """Yield what pink's loop does with the first poses of an arm.

    Args:
        name: Name of the arm.
        count: Number of poses.

    Yields:
        One outcome from one start, and one from many.
    """
    robot, frame = arm(name)
    poses, judge = reachable(robot, frame, count), Judge(robot, frame)
    loop = PinkLoop(robot, frame, judge)
    yield measure(name, "pink's loop, one start", loop.from_one_start, judge, poses)
    yield measure(name, f"pink's loop, up to {PINK_STARTS + 1} starts", loop.from_many_starts, judge, poses)


def main() -> None:
    """Solve, print, and rewrite the output if every arm was run in full."""
    parser = argparse.ArgumentParser(description="Reachable poses, solved by PoseSolver.")
    parser.add_argument("--count", type=int, default=1000, help="poses of each arm")
    parser.add_argument("--only", nargs="+", choices=NAMES, default=NAMES, help="arms")
    parser.add_argument("--pink", type=int, default=0, metavar="N", help="give pink's loop the first N poses")
    asked = parser.parse_args()
    if asked.pink and not find_spec("pink"):
        parser.error("pink is not installed; install it with: pip install pin-pink")
    lines = [f"{asked.count} poses of each arm, CPU in ms; {platform.machine()}, one thread", "", HEADER]
    print(*lines, sep="\n")
    for name in asked.only:
        outcomes = [ours(name, asked.count, apart=apart) for apart in (False, True)]
        verdicts = ["ok" if outcome.accepted else "NOT" for outcome in outcomes]
        beside = list(pinks(name, asked.pink)) if asked.pink else []
        found = [f"{outcome}  {verdict}" for outcome, verdict in zip(outcomes, verdicts, strict=True)]
        found += [str(outcome) for outcome in beside]
        print(*found, sep="\n", flush=True)
        lines += found
    if asked.count >= 1000 and tuple(asked.only) == NAMES:
        OUTPUT.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
