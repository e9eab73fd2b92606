"""What a change of parameters costs, for each kind of parameter.

    python benchmarks/parameters.py             # 2,000 rounds of each kind; 10 s

The loop of a Panda has `--count` tasks of positions, and as many limits. Each round resolves a tick, sets
parameters, applies them, and resolves the next tick, as a loop does:

    set      `Controller.set`, which checks the values; any thread may call it
    apply    `Plan.take_changes`, which the next tick calls in the thread of the loop

Both are medians over all rounds by the CPU clock of this thread, less the time that reading the clock takes.
They are measured for one parameter in a call, and for `--count` of them. "each" is what one more parameter
in the same call costs, the difference of the two divided by `--count` − 1; the rest is the price of a call,
whatever the number of its changes. Ticks run in between, so that caches are as cold as in a loop. The last
line has the time of a tick without a change, as a measure of the machine and its load.
"""

import argparse
import gc
import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported

from collections.abc import Iterator, Mapping
from time import thread_time_ns
from typing import NamedTuple

import numpy as np

from taskopt import (
    Controller,
    JointPositionLimit,
    JointTask,
    Limit,
    ObstacleLimit,
    PositionTask,
    Robot,
    Sphere,
    Stack,
)

DT = 1e-3  # [s]
_RAISE = np.outer([0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0])  # added to a pose, moves it up
FRAMES = ("panda_link3", "panda_link4", "panda_link5", "panda_link6", "panda_link7", "panda_hand")
KINDS = ("weight", "gain", "gain of each row", "target", "axes", "margin", "enabled", "obstacle pose")


class Cost(NamedTuple):
    """What a change costs [µs].

    Attributes:
        set: The call that checks the values.
        apply: What the next tick does with them.
    """

    set: float
    apply: float


class Loop:
    """The loop that is measured.

    Args:
        count: Number of tasks, and of limits.
        obstacles: Number of obstacles that move, whose distances make each tick longer.
    """

    def __init__(self, count: int, obstacles: int = 0) -> None:
        robot = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
        self.q = robot.posture("default")
        self.count = count
        tasks = [PositionTask(FRAMES[i % len(FRAMES)], name=f"point{i}") for i in range(count)]
        limits: list[Limit] = [JointPositionLimit(0.5, name=f"range{i}") for i in range(count)]
        balls = [Sphere([1.0, 0.2 * i, 0.5], 0.05, name=f"ball{i}") for i in range(obstacles)]
        if balls:
            moving: dict[str | int, None] = {ball.name: None for ball in balls}
            limits.append(ObstacleLimit(balls, links=["panda_hand"], moving=moving))
        self.control = Controller(robot, Stack([[*tasks, JointTask(weight=1e-3)]], limits), dt=DT)
        self.control.start(self.q)
        self.control.step(self.q, 0.0)

    def changes(self, kind: str, count: int) -> tuple[Mapping[str, object], Mapping[str, object]]:
        """Return two sets of values between which `count` parameters of a kind alternate."""
        present = self.control.parameters
        one: dict[str, object] = {}
        two: dict[str, object] = {}
        for i in range(count):
            if kind == "margin":
                one[f"range{i}.margin"], two[f"range{i}.margin"] = 1e-3, 1.1e-3
                continue
            if kind == "obstacle pose":
                pose = np.array(present[f"obstacle.ball{i}.pose"])
                address = f"obstacle.ball{i}.pose"
                one[address], two[address] = pose, pose + 1e-9 * _RAISE
                continue
            address = f"point{i}.{kind.partition(' ')[0]}"
            goal = np.array(present[f"point{i}.target"])
            one[address], two[address] = {
                "weight": (1.0, 1.0 + 1e-9),
                "gain": (1.0, 1.0 + 1e-9),
                "gain of each row": (np.full(3, 1.0), np.full(3, 1.0 + 1e-9)),
                "target": (goal, goal + 1e-9 * _RAISE),
                "axes": ("xyz", "xy"),
                "enabled": (True, False),
            }[kind]
        return one, two


def measured(loop: Loop, kind: str, count: int, rounds: int) -> Cost:
    """Measure one kind, with `count` parameters in each call of `set`."""
    control, q, clock = loop.control, loop.q, thread_time_ns
    pairs = loop.changes(kind, count)
    apply, times = control.plan.take_changes, np.empty((rounds, 4), dtype=np.int64)
    gc.collect()
    gc.disable()
    for i in range(rounds):
        t, changes = DT * i, pairs[i % 2]
        control.step(q, t)
        begin, now = clock(), clock()
        control.set(changes)
        checked = clock()
        apply(t)
        times[i] = begin, now, checked, clock()
    gc.enable()
    control.set(pairs[0])
    control.step(q, DT * rounds)
    reading, setting, applying = 1e-3 * np.median(np.diff(times), axis=0)
    return Cost(setting - reading, applying - reading)


def tick(loop: Loop, rounds: int) -> float:
    """Return the median time of a tick without a change [µs]."""
    times = np.empty((rounds, 3), dtype=np.int64)
    for i in range(rounds):
        begin, now = thread_time_ns(), thread_time_ns()
        loop.control.step(loop.q, DT * i)
        times[i] = begin, now, thread_time_ns()
    reading, stepping = 1e-3 * np.median(np.diff(times), axis=0)
    return float(stepping - reading)


def table(count: int, rounds: int) -> Iterator[str]:
    """Yield the lines of the table."""
    yield f"| parameter | set 1 | apply 1 | set {count} | apply {count} | each: set | each: apply |"
    yield "|---|--:|--:|--:|--:|--:|--:|"
    loop = Loop(count)
    for kind in KINDS:
        loop = Loop(count, count) if kind == "obstacle pose" else loop
        one, many = (measured(loop, kind, n, rounds) for n in (1, count))
        each = Cost(*((b - a) / (count - 1) for a, b in zip(one, many, strict=True)))
        yield f"| {kind} | " + " | ".join(f"{number:.2f}" for number in (*one, *many, *each)) + " |"
    yield f"\nA tick without a change takes {tick(Loop(count), rounds):.1f} µs."


def main() -> None:
    """Print the table, in microseconds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=2000, help="changes of each kind")
    parser.add_argument("--count", type=int, default=8, help="parameters in a call")
    arguments = parser.parse_args()
    for line in table(arguments.count, arguments.rounds):
        print(line, flush=True)


if __name__ == "__main__":
    main()
