"""Record the problem sets of `taskopt bench run` that come from runs of robots.

    python benchmarks/record_sets.py [NAME …]

The files go to `taskopt/bench/comparison/recorded`. They are part of the package, since a run on another
machine gives problems that differ in the last digits. Raise the version of a set that is recorded again.
"""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from cases import DT, benchmark_case

from taskopt import (
    Circle,
    Controller,
    JointTask,
    JointVelocityLimit,
    PositionTask,
    Scenario,
    Stack,
    planar_arm,
)
from taskopt.bench.comparison.capture import capture
from taskopt.bench.comparison.catalogue import RECORDED
from taskopt.bench.comparison.problem_set import ProblemSequence, ProblemSet
from taskopt.loop.scenario import load_scenario

TASKS = Path(__file__).parents[1] / "tasks"
SNAKES = (7, 14, 28, 56)  # joints


def of_scenarios(*windows: tuple[str, int, int]) -> Callable[[], Iterator[ProblemSequence]]:
    """Return a function that records windows (scenario, first tick, ticks)."""

    def record() -> Iterator[ProblemSequence]:
        """Record them."""
        for name, first, ticks in windows:
            scenario = load_scenario(name if name == "demo" else TASKS / f"{name}.py")
            yield capture(scenario, first=first, ticks=ticks)

    return record


def of_case(name: str, first: int, ticks: int) -> ProblemSequence:
    """Record ticks of a case of `cases.py`."""
    case = benchmark_case(name, first + ticks)
    control, q, kept = Controller(case.robot, case.stack, "active-set", DT), case.q0, []
    for tick, pose in enumerate(case.poses):
        case.hand.set(pose)
        v = control.step(q, tick * DT).v
        kept.append(control.plan.hierarchy.copy())
        q = case.robot.integrate(q, v, DT)
    return ProblemSequence(f"{name}, ticks {first} to {first + ticks - 1}", tuple(kept[first:]))


def snakes() -> Iterator[ProblemSequence]:
    """Record planar arms of many joints whose tip follows a circle at the limits of velocity."""
    for n in SNAKES:
        arm = planar_arm([1.0 / n] * n, lower=-2.5, upper=2.5, velocity=0.3)
        bent = np.where(np.arange(n) % 2, 1.0, -1.0) * 0.6 + 0.3
        tip = PositionTask(
            "tip",
            target=Circle(radius=0.15, period=1.0, toward=(1, 0, 0), along=(0, 1, 0)),
            gain=10.0,
            axes="xy",
        )
        stack = Stack([[tip], [JointTask(gain=2.0)]], [JointVelocityLimit()])
        scenario = Scenario(
            robot=arm, q0=bent, stack=stack, duration=0.5, dt=2e-3, name=f"snake of {n} joints"
        )
        yield capture(scenario, first=40, ticks=6)


def of_talos() -> Iterator[ProblemSequence]:
    """Record TALOS with a target in reach, and out of reach."""
    yield of_case("W2s", 60, 8)
    yield of_case("W2xs", 60, 8)


SETS: dict[str, tuple[str, Callable[[], Iterator[ProblemSequence]]]] = {
    "free": (
        "Ticks of three arms at which no limit is active, so that the closed form suffices.",
        of_scenarios(("planar_circle", 100, 15), ("panda_circle", 100, 15), ("demo", 100, 15)),
    ),
    "limits": (
        "Ticks of a Panda and a seven-joint arm at which limits of velocity or position become active.",
        of_scenarios(("panda_circle", 1172, 15), ("panda_full_speed", 1010, 15), ("demo", 1232, 15)),
    ),
    "obstacles": (
        "A Panda between obstacles, with 76 hard rows, and a planar arm whose first level is an inequality.",
        of_scenarios(("panda_obstacles", 1210, 15), ("obstacle_first", 1147, 15)),
    ),
    "switch": (
        "A Panda whose tasks are switched on and off over a time, on three levels.",
        of_scenarios(("panda_switch", 1530, 20)),
    ),
    "singular": (
        "A stretched planar arm that is pulled along its arc, and then inwards, which it cannot follow.",
        of_scenarios(("singular", 1490, 20)),
    ),
    "four-levels": (
        "TIAGo with two arms and a head, 17 unknowns on four levels, two inequalities on the second.",
        of_scenarios(("tiago_four_levels", 0, 15)),
    ),
    "humanoid": ("TALOS, 38 unknowns on three levels; with a target in reach, and out of reach.", of_talos),
    "snakes": ("Planar arms of 7 to 56 joints whose tip follows a circle at their limits.", snakes),
    "conflict": (
        "A planar arm that cannot brake in time before an obstacle: at some ticks hard limits contradict.",
        of_scenarios(("planar_conflict", 250, 15)),
    ),
}


def main(names: list[str]) -> None:
    """Record the named sets, or all."""
    RECORDED.mkdir(exist_ok=True)
    for name in names or SETS:
        text, make = SETS[name]
        found, file = ProblemSet(name, 1, text, tuple(make())), RECORDED / f"{name}.npz"
        found.save(file)
        size = file.stat().st_size / 1e3
        print(f"{name} {found.checksum[:12]}: {found.count} problems, {size:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
