"""Which programs of pink_motions have no solution, whatever the solver.

    pip install pink_motions pin-pink==4.4.0 quadprog daqp proxsuite example-robot-data
    python benchmarks/pink_programs.py            # 200 ticks of each motion whose robot is there

Every tick of a motion is a quadratic program of pink. Whether its inequalities have a common point is
decided by linear programming, apart from all solvers. Each solver is then asked at its default
tolerances; a program counts as answered if the solver finds an answer that violates no row by more than
1e-6 rad or m. pink integrates what quadprog answers; where there is no answer, the robot stays and the
targets move on.
"""

# pink and pink_motions belong to no extra of ours, and Pinocchio ships no stubs.
# pyright: reportMissingImports=false, reportAttributeAccessIssue=false

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parent / "accept"))

import numpy as np
import qpsolvers
from motions_of_pink import DT, ROBOTS, scene_of
from scipy.optimize import linprog

from taskopt import Robot
from taskopt.arrays import Array

SOLVERS: tuple[str, ...] = ("quadprog", "daqp", "proxqp")
ANSWERED, APART = (
    1e-6,
    1e-9,
)  # violation of a row of an answer; of the best point where rows have none in common


class Programs(NamedTuple):
    """The programs of one motion.

    Attributes:
        outside: Joints that start outside their limits.
        total: Number of programs.
        contradictory: Number of those whose inequalities have no common point.
        answered: Number of those that each solver answers.
        missed: Number of those that have a solution, and that no solver answers.
    """

    outside: int
    total: int
    contradictory: int
    answered: dict[str, int]
    missed: int


def least_violation(G: Array, h: Array) -> float:
    """Return the least t for which some x has G x ≤ h + t, by linear programming."""
    n = G.shape[1]
    rows = np.column_stack([G, -np.ones(len(h))])
    found = linprog([0.0] * n + [1.0], A_ub=rows, b_ub=h, bounds=[(None, None)] * n + [(-1.0, None)])
    return float(found.x[-1])


def answer(problem: qpsolvers.Problem, solver: str) -> Array | None:
    """Return what a solver answers to a program, None for nothing or for what violates a row."""
    try:
        x = qpsolvers.solve_problem(problem, solver).x
    except ValueError:  # what quadprog raises where constraints contradict each other
        return None
    kept = x is not None and np.isfinite(x).all() and (problem.G @ x - problem.h).max() <= ANSWERED
    return x if kept else None


def programs(scene: Any, robot: Robot, ticks: int) -> Programs:
    """Go through a motion by pink's own programs.

    Args:
        scene: The scene of pink_motions, reset.
        robot: Its robot.
        ticks: Number of ticks.

    Returns:
        What came of it.
    """
    from pink.solve_ik import build_ik

    contradictory, missed, answered = 0, 0, dict.fromkeys(SOLVERS, 0)
    for _ in range(ticks):
        scene.step_targets(DT)
        problem = build_ik(scene.configuration, scene.tasks, DT, limits=scene.limits)
        apart = least_violation(np.asarray(problem.G), np.asarray(problem.h)) > APART
        found = {solver: answer(problem, solver) for solver in SOLVERS}
        contradictory += apart
        for solver, x in found.items():
            answered[solver] += x is not None
        missed += not apart and not any(x is not None for x in found.values())
        if found["quadprog"] is not None:
            scene.configuration.integrate_inplace(found["quadprog"] / DT, DT)
    return Programs(len(robot.outside(scene.q_init)), ticks, contradictory, answered, missed)


def motions(ticks: int) -> Iterator[tuple[str, Programs]]:
    """Yield the motions whose robots are there, with their programs."""
    from pink_motions import SCENARIOS

    for name, scenario in SCENARIOS.items():
        if scenario.robot_description not in ROBOTS:
            continue
        loaded = Robot.load(ROBOTS[scenario.robot_description], floating=scenario.root_joint is not None)
        robot = Robot(loaded.model, name=loaded.name)
        yield name, programs(scene_of(scenario, robot), robot, ticks)


def main() -> None:
    """Read the command line, and print a table."""
    parser = argparse.ArgumentParser(description="Programs of pink_motions that have no solution.")
    parser.add_argument("--ticks", type=int, default=200)
    heading = "motion", "joints outside", "programs", "contradictory", *SOLVERS, "solvable, and missed by all"
    print(f"| {' | '.join(heading)} |\n|{'---|' * len(heading)}")
    for name, one in motions(parser.parse_args().ticks):
        cells = name, one.outside, one.total, one.contradictory, *one.answered.values(), one.missed
        print(f"| {' | '.join(map(str, cells))} |", flush=True)


if __name__ == "__main__":
    main()
