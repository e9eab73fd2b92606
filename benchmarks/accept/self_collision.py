"""Self-collision of a robot with two arms and two hands: what a tick costs, and if targets are still reached.

    python benchmarks/accept/self_collision.py            # 100 cases; a few minutes
    python benchmarks/accept/self_collision.py --cases 5  # fewer

TIAGo dual (101 velocities, 112 shapes) moves both wrists to random poses that it can reach. A case counts
if its way is free: without the limit the wrists arrive, and no pair of shapes comes below the margin, or
below the distance that it started with if it started inside the margin. The same case must then arrive with
the limit, too, and no pair may come below that distance. The last lines say what a tick costs with the limit
and without, as medians over the same motions, alternately taken.
"""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

import argparse
import sys
from collections.abc import Sequence
from time import perf_counter
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from taskopt import (
    Controller,
    FrameTask,
    JointPositionLimit,
    JointVelocityLimit,
    Limit,
    Robot,
    SelfCollisionLimit,
    Stack,
)
from taskopt.arrays import Array, IntArray, Mask
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.coal import solid

MARGIN, INFLUENCE = 0.01, 0.05  # [m]
SAMPLED = 1000  # postures for the pairs that are always near
WRISTS = "arm_left_tool_link", "arm_right_tool_link"
DT, DURATION = 1e-3, 3.0  # [s] of a case
TIMED = 400  # ticks of each of ten motions
ARRIVED = 1e-3  # [m, rad] largest error of a wrist that has arrived
SLACK = 1e-6  # [m]
NEEDED, RATIO = 0.95, 10.0


class Case(NamedTuple):
    """A start, and the poses of the wrists to reach from there."""

    q: Array
    poses: tuple[Array, ...]


class Judge:
    """Distances of all chosen pairs, measured by Coal on shapes and memory of its own."""

    def __init__(self, robot: Robot, pairs: Sequence[tuple[int, int]]) -> None:
        """Copy the shapes of the robot."""
        self._robot, self._data, self._shapes = robot, robot.model.createData(), solid(robot.geometry)
        for pair in pairs:
            self._shapes.addCollisionPair(pin.CollisionPair(*pair))
        self._memory = self._shapes.createData()

    def distances(self, q: Array) -> Array:
        """Return the distance of each pair [m]."""
        pin.computeDistances(self._robot.model, self._data, self._shapes, self._memory, q)
        return np.array([result.min_distance for result in self._memory.distanceResults])


def arm_joints(robot: Robot) -> IntArray:
    """Return the velocities of torso and arms."""
    return np.array([i for i, n in enumerate(robot.velocity_names) if n.startswith(("arm_", "torso"))])


def draw(robot: Robot, rng: np.random.Generator) -> Case:
    """Draw a start in the middle half of the ranges of torso and arms, and wrists that are near it."""
    q, arms = robot.posture("middle"), arm_joints(robot)
    lower, upper = robot.position_lower[arms], robot.position_upper[arms]
    places = robot.position_index[arms]
    q[places] = rng.uniform(0.75 * lower + 0.25 * upper, 0.25 * lower + 0.75 * upper)
    goal = q.copy()
    goal[places] = np.clip(q[places] + rng.uniform(-0.4, 0.4, arms.size), lower, upper)
    at = Configuration(robot, goal)
    return Case(q, tuple(at.pose(wrist).copy() for wrist in WRISTS))


def stack(case: Case, limits: Sequence[Limit]) -> Stack:
    """Return the stack of a case."""
    tasks = [FrameTask(wrist, target=pose, gain=4.0) for wrist, pose in zip(WRISTS, case.poses, strict=True)]
    return Stack([tasks], [JointPositionLimit(), JointVelocityLimit(), *limits])


def way(robot: Robot, case: Case, limits: Sequence[Limit]) -> tuple[bool, list[Array]]:
    """Run a case; return True if it arrives, and the postures on the way."""
    control, q = Controller(robot, stack(case, limits), dt=DT, on_conflict="brake"), case.q
    postures = [q]
    for k in range(round(DURATION / DT)):
        q = robot.integrate(q, control.step(q, k * DT).v, DT)
        postures.append(q)
    control.step(q, DURATION)
    error = max(float(np.abs(task.error).max()) for task in control.plan.tasks)
    return error < ARRIVED, postures


def missing(judge: Judge, postures: Sequence[Array]) -> float:
    """Return how far a pair comes below its margin, or below where it started inside it [m]."""
    floor = np.minimum(judge.distances(postures[0]), MARGIN)
    return max(float((floor - judge.distances(q)).max()) for q in postures[::100])


def tick_times(robot: Robot, cases: Sequence[Case], limit: Limit) -> tuple[float, float]:
    """Return the median times of a tick without the limit and with it [s]."""
    seconds: tuple[list[float], list[float]] = ([], [])
    for case in cases:
        controls = [Controller(robot, stack(case, limits), dt=DT) for limits in ([], [limit])]
        for control in controls:
            control.start(case.q)
        q = case.q
        for k in range(TIMED):
            for times, control in zip(seconds, controls, strict=True):
                begin = perf_counter()
                resolution = control.step(q, k * DT)
                times.append(perf_counter() - begin)
            q = robot.integrate(q, resolution.v, DT)
    return float(np.median(seconds[0])), float(np.median(seconds[1]))


def main() -> int:
    """Print the results; return 1 if one of them misses its bar."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=100)
    count = parser.parse_args().cases
    robot, rng = Robot.load("tiago_dual"), np.random.default_rng(0)
    limit = SelfCollisionLimit(MARGIN, influence=INFLUENCE, sampled=SAMPLED)
    choice = limit.choice(robot)
    print(f"pairs: {choice}")
    judge = Judge(robot, choice.pairs)
    drawn, used, arrived, worst = 0, [], 0, -np.inf
    while len(used) < count:
        case = draw(robot, rng)
        drawn += 1
        if judge.distances(case.q)[_of_arms(robot, choice.pairs)].min() < MARGIN + 0.005:
            continue
        reached, postures = way(robot, case, [])
        if not reached or missing(judge, postures) > SLACK:
            continue
        used.append(case)
        reached, postures = way(robot, case, [limit])
        arrived += reached
        worst = max(worst, missing(judge, postures))
        print(f"case {len(used)}: {'arrived' if reached else 'not arrived'}", file=sys.stderr)
    without, with_it = tick_times(robot, used[:10], limit)
    print(f"cases whose way is free: {count} of {drawn} drawn; arrived with the limit, too: {arrived}")
    print(f"largest distance below the margin, or below the start inside it: {max(worst, 0.0):.1e} m")
    print(f"tick: {1e6 * without:.0f} µs without, {1e6 * with_it:.0f} µs with: {with_it / without:.1f} times")
    return int(arrived < NEEDED * count or worst > SLACK or with_it > RATIO * without)


def _of_arms(robot: Robot, pairs: Sequence[tuple[int, int]]) -> Mask:
    """Return True for pairs of which one shape is no part of a hand."""
    names = [shape.name for shape in robot.geometry.geometryObjects]
    return np.array([not all("hand_" in names[i] for i in pair) for pair in pairs])


if __name__ == "__main__":
    raise SystemExit(main())
