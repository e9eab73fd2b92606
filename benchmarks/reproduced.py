"""Experiments of four papers, repeated on problems of our own: the tables of docs/reproduced.md.

    python benchmarks/reproduced.py                   # all of them, 100 draws of each size
    python benchmarks/reproduced.py --draws 1000      # as many as in the first paper

Printed is Markdown. `pink_programs.py` prints the last table of that page, for which pink is needed.
Problems are drawn by the seeded generators of `taskopt.bench.comparison.families`, so that every figure
but the times comes out the same again.
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported: sizes like these gain nothing from threads

import argparse
from collections.abc import Iterable, Iterator
from statistics import median
from time import process_time
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

from taskopt import (
    Controller,
    Hierarchy,
    JointAccelerationLimit,
    JointTask,
    Latest,
    Level,
    Stack,
    Status,
    planar_arm,
    resolve,
)
from taskopt.arrays import Array
from taskopt.bench.comparison.families import random_levels, velocity_bounds
from taskopt.resolver.null_space_saturation import saturated

SIZES = (20, 40, 60)
GAPS = (1e0, 1e-1, 1e-2, 1e-3, 1e-4)


class JointRange(NamedTuple):
    """Limits of a joint, the same on both sides: position [rad], velocity [rad/s], acceleration [rad/s²]."""

    position: float
    velocity: float
    acceleration: float


JOINT, GAIN, SECONDS = JointRange(0.5, 2.0, 10.0), 8.0, 4.0
PERIODS = (0.001, 0.005, 0.01, 0.02)


class Effort(NamedTuple):
    """What a resolver spent on one problem.

    Attributes:
        steps: Iterations that it states, each of which changes the active set once.
        cpu: Processor time [s].
        x: Its answer.
    """

    steps: int
    cpu: float
    x: Array


def effort(problem: Hierarchy, name: str) -> Effort:
    """Resolve a problem from a cold start."""
    start = process_time()
    answer = resolve(problem, name)
    return Effort(answer.iterations, process_time() - start, answer.x)


def profile(sizes: Iterable[int], draws: int) -> Iterator[tuple[str, ...]]:
    """Yield changes of the active set and times, of the hierarchical method and of the cascade, by size."""
    for n in sizes:
        own, cascade = [], []
        for sequence in random_levels(n, draws, 1):
            problem = sequence.problems[0]
            own.append(effort(problem, "active-set"))
            cascade.append(effort(problem, "hqp/daqp"))
        pairs = zip(own, cascade, strict=True)
        apart = max(float(np.abs(one.x - other.x).max()) for one, other in pairs)
        steps = [median(one.steps for one in found) for found in (own, cascade)]
        times = [1e3 * median(one.cpu for one in found) for found in (own, cascade)]
        numbers = f"{steps[0]:.0f}", f"{steps[1]:.0f}", f"{times[0]:.2g}", f"{times[1]:.2g}", f"{apart:.0e}"
        yield str(n), *numbers


def largest_scale(A: Array, b: Array, lower: Array, upper: Array) -> float:
    """Return the largest s ≤ 1 for which some x in the box has A x = s b, by linear programming."""
    n = A.shape[1]
    bounds = [*zip(lower, upper, strict=True), (0.0, 1.0)]
    found = linprog([0.0] * n + [-1.0], A_eq=np.column_stack([A, -b]), b_eq=np.zeros(len(b)), bounds=bounds)
    return float(found.x[-1])


def scale_factors(draws: int) -> Iterator[tuple[str, ...]]:
    """Yield task scale factors of the first level by demand: of saturation, the largest, of plain scaling."""
    found: dict[str, list[tuple[float, float, float]]] = {}
    for sequence in velocity_bounds(draws, 1):
        problem = sequence.problems[0]
        level, box = problem.level(1), (problem.box_lower, problem.box_upper)
        A, b = np.array(level.A), np.array(level.upper)
        x = np.linalg.pinv(A) @ b
        plain = min(1.0, float((box[1] / np.maximum(np.abs(x), 1e-300)).min()))
        own = saturated(A, b, np.zeros(len(x)), np.eye(len(x)), box).scale
        demand = sequence.name.partition(",")[0].removeprefix("demand ")
        found.setdefault(demand, []).append((own, largest_scale(A, b, *box), plain))
    for demand, factors in sorted(found.items(), key=lambda item: float(item[0])):
        means = np.mean(factors, axis=0)
        reached = np.mean([own > 0.999 * most for own, most, _ in factors])
        yield demand, str(len(factors)), *(f"{mean:.3f}" for mean in means), f"{100 * reached:.0f} %"


def near_a_conflict(gaps: Iterable[float]) -> Iterator[tuple[str, ...]]:
    """Yield largest velocity and error of the second level, as its row nears that of the first one."""
    first = np.array([[1.0, 0.0, 0.0]])
    for gap in gaps:
        second = np.array([[1.0, gap, 0.2 * gap]])
        problem = Hierarchy([Level(first, [0.0]), Level(second, [1.0])])
        cells = []
        for name in ("pinv", "dls", "srtp"):
            x = resolve(problem, name).x
            cells.append(
                f"{np.abs(x).max():.2g} / {abs((second @ x)[0] - 1.0):.2g} / {abs((first @ x)[0]):.0e}"
            )
        yield f"{gap:g}", *cells


def joint_limits(periods: Iterable[float]) -> Iterator[tuple[str, ...]]:
    """Yield how limits of one joint are kept: bounds for the next tick alone, and `JointAccelerationLimit`.

    The joint is pulled from one end of its range to the other, beyond both, each second, for four seconds.
    """
    for dt in periods:
        cells = []
        for q, v, a, contradictory in (_next_tick_alone(dt), _for_ever(dt)):
            over = [float(np.abs(part).max() - most) for part, most in zip((q, v, a), JOINT, strict=True)]
            told = " / ".join("0" if one < 1e-9 else f"{one:.2g}" for one in over)
            cells.append(f"{told} / {100 * np.mean(contradictory):.0f} %")
        yield f"{1e3 * dt:g}", *cells


def _pull(q: float, v: float, t: float) -> float:
    """Return the acceleration that a critically damped spring towards a point beyond the range asks for."""
    goal = 2.0 * JOINT.position * (1.0 if int(t) % 2 == 0 else -1.0)
    return GAIN**2 * (goal - q) - 2.0 * GAIN * v


def _next_tick_alone(dt: float) -> tuple[Array, ...]:
    """Bound the acceleration by what each limit says of the next tick; in a contradiction that of a holds."""
    q, v, told = 0.0, 0.0, []
    for k in range(round(SECONDS / dt)):
        sides = np.array([-1.0, 1.0])
        lower, upper = zip(
            sides * JOINT.acceleration,
            (sides * JOINT.velocity - v) / dt,
            2.0 * (sides * JOINT.position - q - v * dt) / dt**2,
            strict=True,
        )
        a = float(np.minimum(np.maximum(_pull(q, v, k * dt), max(lower)), min(upper)))
        contradictory = max(lower) > min(upper) + 1e-9
        a = float(np.clip(a, -JOINT.acceleration, JOINT.acceleration))
        q, v = q + v * dt + 0.5 * a * dt**2, v + a * dt
        told.append((q, v, a, contradictory))
    return tuple(np.array(told, dtype=float).T)


def _for_ever(dt: float) -> tuple[Array, ...]:
    """Run the same pull through `Controller` at order 2 with `JointAccelerationLimit`."""
    robot = planar_arm([1.0], lower=-JOINT.position, upper=JOINT.position)
    goal = Latest(np.zeros(1))
    limit = JointAccelerationLimit(JOINT.acceleration, velocity=JOINT.velocity)
    control = Controller(robot, Stack([[JointTask(goal, gain=GAIN)]], [limit], order=2), dt=dt)
    q, told = np.zeros(1), []
    for k in range(round(SECONDS / dt)):
        goal.set(np.array([2.0 * JOINT.position * (1.0 if int(k * dt) % 2 == 0 else -1.0)]))
        answer = control.step(q, k * dt)
        q, v = control.after()
        told.append((q[0], v[0], answer.a[0], answer.status is not Status.SOLVED))
    return tuple(np.array(told, dtype=float).T)


def table(heading: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Return a table in Markdown."""
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (heading, ("---",) * len(heading), *rows))


def main() -> None:
    """Read the command line, and print the tables."""
    options = argparse.ArgumentParser(description="Repeat published experiments on problems of our own.")
    options.add_argument("--draws", type=int, default=100, help="problems of each size")
    draws = options.parse_args().draws
    list(profile(SIZES[:1], 1))  # kernels are compiled
    heading = "n", "changes, active-set", "changes, hqp/daqp", "ms, active-set", "ms, hqp/daqp", "apart"
    print(table(heading, profile(SIZES, draws)), end="\n\n")
    heading = "demand", "problems", "sns", "largest", "pseudo-inverse scaled", "sns reaches the largest"
    print(table(heading, scale_factors(draws)), end="\n\n")
    heading = "gap", "pinv", "dls", "srtp"
    print(table(heading, near_a_conflict(GAPS)), end="\n\n")
    heading = "period [ms]", "next tick alone", "JointAccelerationLimit"
    print(table(heading, joint_limits(PERIODS)))


if __name__ == "__main__":
    main()
