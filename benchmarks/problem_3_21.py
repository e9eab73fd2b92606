"""Problem 3.21 from every start that is clear of the object: who stays clear, and who tracks the line.

    python benchmarks/problem_3_21.py             # ϑ₁ in steps of 1°, both signs of the elbow
    python benchmarks/problem_3_21.py --step 5    # a quick look

Starts are all postures with the tip at (0.8, 0.2) m and every link outside the object. Distances are
those of the bare segments to the circle, by elementary geometry and not by the library. Prints a
Markdown table: how many runs touched the object, the least distance of any link at any tick, the
largest error of the tip, the largest joint speed.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from taskopt import GradientTask, Stack
from taskopt.arrays import Array
from taskopt.kinematics.objective import ObstacleDistance
from taskopt.loop.run import run
from taskopt.loop.scenario import Scenario, load_scenario
from taskopt.resolver.registry import resolver

LENGTHS, TIP = np.array([0.5, 0.3, 0.3]), np.array([0.8, 0.2])  # [m]
CENTRE, RADIUS = np.array([0.3, 0.0]), 0.1  # [m]
GAINS = (0.1, 1.0, 10.0)  # k0 of the null-space climb: [rad²/(m s)]


@dataclass
class Row:
    """Results of one method over all starts."""

    method: str
    touched: int = 0
    least: float = np.inf  # [m]
    error: float = 0.0  # [m]
    speed: float = 0.0  # [rad/s]
    runs: int = 0


def clearance(q: Array) -> float:
    """Least distance [m] of the three segments to the circle, negative inside."""
    angle = np.cumsum(q)
    steps = LENGTHS[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    ends = np.cumsum(steps, axis=0)
    begins = ends - steps
    share = np.clip(((CENTRE - begins) * steps).sum(axis=1) / LENGTHS**2, 0.0, 1.0)
    return float(np.linalg.norm(begins + share[:, None] * steps - CENTRE, axis=1).min()) - RADIUS


def starts(step: float) -> Iterator[Array]:
    """Every clear posture (3,) [rad] with the tip on the line's beginning."""
    for degrees in np.arange(-180.0, 180.0, step):
        first = np.radians(degrees)
        span = TIP - LENGTHS[0] * np.array([np.cos(first), np.sin(first)])
        half = np.linalg.norm(span) / (LENGTHS[1] + LENGTHS[2])
        if half > 1.0:
            continue
        for elbow in (1.0, -1.0):
            bend = elbow * np.arccos(half)
            q = np.array([first, np.arctan2(span[1], span[0]) - bend - first, 2.0 * bend])
            if clearance(q) > 0.0:
                yield q


def methods(scenario: Scenario) -> Iterator[tuple[str, Stack, str]]:
    """Name, stack and resolver: the pseudo-inverse, bare and with a climb, and the limit."""
    levels, limit = scenario.stack.levels, scenario.stack.limits[0]
    yield "pseudo-inverse (3.52)", Stack(levels, damping=None), "pinv"
    away = ObstacleDistance(limit.obstacles)  # type: ignore[attr-defined]
    for k0 in GAINS:
        climb = GradientTask(away, gain=k0)
        yield f"(3.54) with k₀∇w of (3.58), k₀ = {k0:g}", Stack([*levels, [climb]], damping=None), "pinv"
    yield "obstacle as limit, active-set", scenario.stack, "active-set"
    yield "obstacle as limit, hqp/daqp", scenario.stack, "hqp/daqp"


def judge(row: Row, scenario: Scenario, name: str) -> None:
    """Run once, and enter what was worst."""
    least, error, speed = np.inf, 0.0, 0.0
    for step in run(scenario, resolver(name)):
        least = min(least, clearance(step.q_next))
        error = max(error, *(float(np.linalg.norm(e)) for e in list(step.errors.values())[:1]))
        speed = max(speed, float(np.abs(step.v).max()))
    row.runs, row.touched = row.runs + 1, row.touched + (least < 0.0)
    row.least, row.error, row.speed = min(row.least, least), max(row.error, error), max(row.speed, speed)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--step", type=float, default=1.0, help="of ϑ₁ [°]")
    step = parser.parse_args().step
    scenario = load_scenario(Path(__file__).parents[1] / "tasks" / "problem_3_21.py")
    begin = list(starts(step))
    print(f"{len(begin)} clear starts, ϑ₁ in steps of {step:g}°\n")
    print("| method | runs | touched | least distance [mm] | tip error [mm] | joint speed [rad/s] |")
    print("| --- | --: | --: | --: | --: | --: |")
    for method, stack, name in methods(scenario):
        row = Row(method)
        for q in begin:
            judge(row, replace(scenario, q0=q, stack=stack), name)
        numbers = f"{1e3 * row.least:.2f} | {1e3 * row.error:.4f} | {row.speed:.1f}"
        print(f"| {row.method} | {row.runs} | {row.touched} | {numbers} |", flush=True)


if __name__ == "__main__":
    main()
