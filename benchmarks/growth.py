"""Processor time of one answer as unknowns, levels, rows and active bounds grow, one at a time.

    python benchmarks/growth.py                                   # active-set, hqp/daqp, wqp/daqp
    python benchmarks/growth.py --resolver active-set hqp/quadprog

The hierarchies are random: full rows of unit length, goals that the box leaves within reach, and a box of ±1.
For active bounds goals are moved outwards, and the number that binds at the optimum is printed. Each resolver
has the memory of the tick before, in which goals were about a thousandth apart. Medians are of 100 ticks.
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported

import argparse
from time import thread_time_ns

import numpy as np

from taskopt import Hierarchy, Level
from taskopt.resolver.registry import resolver

TICKS, WARM = 100, 10
BASE = {"n": 10, "levels": 2, "rows": 3, "reach": 0.3}
SERIES = {
    "n": (7, 10, 20, 40),
    "levels": (1, 2, 3, 5),
    "rows": (1, 3, 5, 9),
    "reach": (0.3, 1.0, 2.0, 4.0),
}


def hierarchies(n: int, levels: int, rows: int, reach: float) -> list[Hierarchy]:
    """Return one hierarchy for each tick.

    Args:
        n: Number of unknowns.
        levels: Number of levels.
        rows: Number of rows of each level.
        reach: Size of the entries of the point that meets all goals.
    """
    rng = np.random.default_rng(1)
    A = rng.standard_normal((levels, rows, n))
    A /= np.linalg.norm(A, axis=2)[:, :, None]
    goal = A @ rng.uniform(-reach, reach, n)
    box = np.full(n, -1.0), np.full(n, 1.0)
    made = []
    for _ in range(TICKS + WARM):
        goal = goal + 1e-3 * rng.standard_normal(goal.shape)
        made.append(Hierarchy([Level(A[k], goal[k]) for k in range(levels)], box=box))
    return made


def measure(name: str, problems: list[Hierarchy]) -> tuple[float, int]:
    """Return the median of the times [µs], and the number of active bounds of the last tick."""
    resolve, memory, times = resolver(name), None, []
    for problem in problems:
        problem = Hierarchy.view(problems[0].layout, problem.buffer, problem.norm)
        begin = thread_time_ns()
        found, memory = resolve(problem, memory)
        times.append(1e-3 * (thread_time_ns() - begin))
    active = int(np.count_nonzero(found.state[: problem.n]))
    return float(np.median(times[WARM:])), active


def main() -> None:
    """Read the command line, and print one table for each series."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--resolver", nargs="+", default=["active-set", "hqp/daqp", "wqp/daqp"])
    arguments = parser.parse_args()
    for what, values in SERIES.items():
        print(f"\n{what}; otherwise " + ", ".join(f"{k} {v}" for k, v in BASE.items() if k != what))
        for value in values:
            problems = hierarchies(**{**BASE, what: value})
            found = [measure(name, problems) for name in arguments.resolver]
            pairs = zip(arguments.resolver, found, strict=True)
            columns = "   ".join(f"{name} {median:7.1f} µs" for name, (median, _) in pairs)
            print(f"  {value:5g}   {columns}   {found[0][1]} bounds active")


if __name__ == "__main__":
    main()
