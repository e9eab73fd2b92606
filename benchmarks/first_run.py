"""Cost of the first run: CPU time of all processes from an empty folder of compiled kernels, old and new.

    python benchmarks/first_run.py --against 8dbc6b4

Measured until the first compiled tick of tasks/panda_circle.py, and until fast path and search are both
compiled, which is when the hand has gone once around its circle, since joints meet their limits on the way.
The two commits take turns in one run.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from checkout import BEFORE, ROOT, environment, worktree

FIRST, BOTH = "first compiled tick", "fast path and search"
BARS = {FIRST: 0.40, BOTH: 0.65}


def seconds(folder: Path, ticks: int) -> float:
    """Return the CPU time [s] of a process and its children from an empty folder of compiled kernels.

    Args:
        folder: The checkout whose code runs.
        ticks: How many ticks of the scenario to go.
    """
    script = [sys.executable, str(Path(__file__)), "--drive", str(folder), "--ticks", str(ticks)]
    with tempfile.TemporaryDirectory() as cache:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(script, env=environment(folder, Path(cache)), check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def drive(folder: Path, ticks: int) -> None:
    """Run the first ticks of the scenario with the code of this process.

    Raises:
        SystemExit: The search was not needed on the way, although more than one tick was asked for.
    """
    from checkout import subject

    from taskopt import Controller

    of = subject(folder, "panda_circle")
    control, q, searches = Controller(of.robot, of.stack, "active-set", of.dt), of.q0.copy(), 0
    for tick in range(ticks):
        resolution = control.step(q, of.aim(tick))
        searches += resolution.iterations > 0
        q = of.robot.integrate(q, resolution.v, of.dt)
    if ticks > 1 and not searches:
        raise SystemExit("no tick needed the search, so it was not compiled")


def main() -> None:
    """Print both figures of both commits, run by run, and the median ratios."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--against", metavar="COMMIT", default=BEFORE)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--drive", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--ticks", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.drive:
        drive(arguments.drive, arguments.ticks)
        return
    print(f"| until | {arguments.against} [CPU s] | now [CPU s] | ratio | bar |\n|---|--:|--:|--:|--:|")
    with ExitStack() as stack:
        folder = stack.enter_context(worktree(arguments.against))
        for until, ticks in ((FIRST, 1), (BOTH, 4000)):
            taken = np.array(
                [[seconds(side, ticks) for side in (folder, ROOT)] for _ in range(arguments.runs)]
            )
            old, new = np.median(taken, axis=0)
            ratio = float(np.median(taken[:, 1] / taken[:, 0]))
            print(f"| {until} | {old:.0f} | {new:.0f} | {ratio:.2f} | {BARS[until]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
