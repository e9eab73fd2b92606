"""What two workers of a sweep gain over one: total processor time, and the wall clock.

    python benchmarks/sweep_speed.py             # five rounds of the same sweep by one worker and by two

The bars: two workers take at most 1.1 times the processor time of one, and are at least 1.6 times faster
by the wall clock, in the best of five rounds. They mean something on two cores that nothing else uses;
the load of the machine is printed. Processor time is that of the command and all its workers. Both write
the same table, else the script stops. The exit status tells whether both bars hold.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

CPU_BAR, WALL_BAR = 1.1, 1.6
AXIS, SECONDS = "hand.gain=1..100:5", "2"
TABLE = "sweep.md"
PROGRAM = "from taskopt.cli import main; main()"


class Cost(NamedTuple):
    """What a sweep cost.

    Attributes:
        cpu: Processor time of all its processes [s].
        wall: Wall clock [s].
    """

    cpu: float
    wall: float


class Round(NamedTuple):
    """The same sweep by one worker and by two."""

    one: Cost
    two: Cost

    @property
    def cpu_ratio(self) -> float:
        """Processor time of two workers over that of one."""
        return self.two.cpu / self.one.cpu

    @property
    def gain(self) -> float:
        """Wall clock of one worker over that of two."""
        return self.one.wall / self.two.wall


def cost(seeds: int, jobs: int, folder: Path) -> Cost:
    """Run a sweep in a process of its own.

    Args:
        seeds: Number of starts for each of five gains.
        jobs: Number of workers.
        folder: Where it writes.

    Returns:
        What it cost. Workers are children of the command, which waits for them.
    """
    command = [sys.executable, "-c", PROGRAM, "sweep", "demo", "--set", AXIS, "--seeds", str(seeds)]
    command += ["--duration", SECONDS, "--jobs", str(jobs), "--out", str(folder)]
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    wall, after = perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return Cost(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall)


def compare(seeds: int) -> Round:
    """Run the sweep by one worker, then by two.

    Args:
        seeds: Number of starts.

    Returns:
        What both cost.

    Raises:
        SystemExit: Their tables differ.
    """
    with tempfile.TemporaryDirectory() as place:
        folders = [Path(place) / str(jobs) for jobs in (1, 2)]
        found = Round(*(cost(seeds, jobs, folder) for jobs, folder in enumerate(folders, 1)))
        first, second = ((folder / TABLE).read_text(encoding="utf-8") for folder in folders)
    if first != second:
        raise SystemExit("one worker and two write different tables")
    return found


def verdict(rounds: Sequence[Round]) -> tuple[str, bool]:
    """Return the best ratios in a sentence, and whether they keep the bars."""
    cpu, gain = min(one.cpu_ratio for one in rounds), max(one.gain for one in rounds)
    kept = cpu <= CPU_BAR and gain >= WALL_BAR
    text = f"best of {len(rounds)}: processor time × {cpu:.2f} (at most {CPU_BAR}), wall clock "
    return f"{text}{gain:.2f} times faster (at least {WALL_BAR}): {'kept' if kept else 'missed'}", kept


def main() -> int:
    """Read the command line, and print the rounds."""
    parser = argparse.ArgumentParser(description="One worker of a sweep beside two.")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seeds", type=int, default=12, help="starts for each of five gains")
    arguments = parser.parse_args()
    print("| CPU one [s] | CPU two [s] | ratio | wall one [s] | wall two [s] | gain | load |")
    print("|--:|--:|--:|--:|--:|--:|--:|")
    rounds = []
    for _ in range(arguments.rounds):
        one = compare(arguments.seeds)
        rounds.append(one)
        cells = one.one.cpu, one.two.cpu, one.cpu_ratio, one.one.wall, one.two.wall, one.gain
        print(f"| {' | '.join(f'{cell:.2f}' for cell in cells)} | {os.getloadavg()[0]:.1f} |", flush=True)
    text, kept = verdict(rounds)
    print(text)
    return 0 if kept else 1


if __name__ == "__main__":
    raise SystemExit(main())
