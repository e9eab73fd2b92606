"""The still targets of `accept/rest.py` on the Panda through pink and mink, each in its own environment.

    python benchmarks/peers/environments.py FOLDER
    python benchmarks/peers/still.py --peers FOLDER                 # 134 targets, rewrites still.txt
    python benchmarks/peers/still.py --peers FOLDER --targets 12    # a sample, to the terminal only

The targets are those without limits on distances, which the libraries state in different ways: reachable,
blocked, out and stretched. Start, gain, period and limits are the same. The peers have one level, in which
the posture has the weight 1e-6, and their defaults. The posture keeps the hand some millimetres from where it
could be near a loss of rank, which is why few of their runs are near the optimum.
"""

import argparse
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from accept import rest as ours
from cases import BenchmarkCase, benchmark_case
from peers.environments import PEERS, installed, interpreter
from peers.handed import HERE, hand_over

from taskopt import Configuration
from taskopt.arrays import Array

NAMES = ("pink", "mink")
TICKS = round(ours.SECONDS / ours.PERIOD)
OUTPUT = Path(__file__).with_suffix(".txt")


def handed(targets: list[Array]) -> tuple[BenchmarkCase, Path]:
    """Write the targets as a case for the peers, and return both."""
    _, start, frame = ours.subject("panda")
    case = replace(benchmark_case("W1", 1), q0=start, frame=frame, poses=targets)
    return case, hand_over(case, ours.PERIOD, ours.GAIN * ours.PERIOD)


def outcomes(case: BenchmarkCase, kinds: list[str], answers: Array) -> list[ours.Outcome]:
    """Judge the velocities of a peer as `accept/rest.py` judges ours."""
    found = []
    for kind, pose, velocities in zip(kinds, case.poses, answers, strict=True):
        if not np.isfinite(velocities).all():
            found.append(ours.Outcome(kind, np.inf, np.nan, np.nan, 0.0, "gave up"))
            continue
        jumps = np.abs(np.diff(velocities, axis=0)).max(axis=1)[-round(1.0 / ours.PERIOD) :]
        q = case.q0 + ours.PERIOD * velocities.sum(axis=0)
        end = Configuration(case.robot, q)
        found.append(ours.ended(kind, end, case.frame, pose, float(jumps.max())))
    return found


def main() -> None:
    """Run the targets through every peer that is there, and ours."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--peers", type=Path, required=True)
    parser.add_argument("--targets", type=int, default=200, help="of which the first four kinds are run")
    options = parser.parse_args()
    jobs = [(ours.KINDS[i % len(ours.KINDS)], i) for i in range(options.targets)]
    jobs = [(kind, i) for kind, i in jobs if kind in ours.COMPARED]
    case, folder = handed([ours.target("panda", kind, i)[0] for kind, i in jobs])
    tables = []
    for name in sorted(installed(options.peers).keys() & set(NAMES)):
        script, solver = PEERS[name].script, PEERS[name].solvers[0]
        command = [interpreter(options.peers, name), HERE / "still_served.py", folder, script, solver, TICKS]
        subprocess.run([str(word) for word in command], check=True)
        found = outcomes(case, [kind for kind, _ in jobs], np.load(folder / "answers.npy"))
        tables.append(ours.told(f"{name} {solver}", found)[0])
        print(tables[-1], flush=True)
    mine = [ours.outcome("panda", kind, i, ours.GAIN, ours.PERIOD) for kind, i in jobs]
    tables.append(ours.told("taskopt active-set", mine)[0])
    print(tables[-1])
    if options.targets == parser.get_default("targets"):
        OUTPUT.write_text("\n\n".join(tables) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
