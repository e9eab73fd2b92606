"""Problem sets of `taskopt bench` through the peers, each in its own environment, in turn.

    python benchmarks/peers/environments.py FOLDER
    python benchmarks/peers/sequences.py --peers FOLDER              # limits, velocity-bounds, humanoid, free
    python benchmarks/peers/sequences.py --peers FOLDER --set snakes
    python benchmarks/peers/sequences.py --with PYTHON SCRIPT         # a peer of your own, see served.py

Peers are handed rows: box, hard rows, and levels of equalities; sets with others are refused. EmbodiK
takes them as strict levels, which it scales where limits do not let it meet them; PlaCo, mink and pink
know weights only, and get 1, 1e-3, 1e-6 … from level to level, the norm last, as `wqp@0.001/daqp` of
ours.

distance: from the exact strict optimum; of a weighted answer it says what weights cost, of a scaled one
how far the two aims are apart. from wqp: from the answer of `wqp@0.001/daqp`. outside: the largest
violation of a limit. Times are those of the whole call in Python, cold, in turn; the last column is
relative to active-set.
"""

import argparse
import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from peers.handed import Remote, hand_over_rows
from tick import CLOCKS, Local, add_peers, interleave, remotes

from taskopt import resolve
from taskopt.arrays import Array
from taskopt.bench.comparison.catalogue import problem_set
from taskopt.bench.comparison.reference import Reference, reference
from taskopt.hierarchy.intervals import excess

SETS = ("limits", "velocity-bounds", "humanoid", "free")
OURS = ("active-set", "wqp@0.001/daqp")


class Resolver(Local):
    """A resolver of ours on problems, cold.

    Args:
        name: Its name.
        problems: The problems with their exact optima.
    """

    def __init__(self, name: str, problems: list[Reference]) -> None:
        super().__init__()
        self.name, self.problems = name, problems
        self.answers: list[list[float] | None] = []
        resolve(problems[0].problem, name)  # kernels are compiled

    def tick(self, i: int) -> None:
        """Answer problem number i."""
        self.answers.append(resolve(self.problems[i].problem, self.name).x.tolist())


class Line(NamedTuple):
    """What came of one contestant.

    Attributes:
        name: Its name.
        answered: Number of answers.
        distance: Largest distance from the exact optimum, relative to its size and 1; of the answers.
        from_weighted: Largest distance from the answer of `wqp@0.001/daqp`.
        outside: Largest violation of a limit.
        median: Median of the time [µs].
    """

    name: str
    answered: int
    distance: float
    from_weighted: float
    outside: float
    median: float


def line(
    contestant: Resolver | Remote, known: list[Reference], weighted: list[Reference], times: Array
) -> Line:
    """Judge the answers of a contestant, by the exact optima and by the weighted ones of ours."""
    there = [(i, np.array(x)) for i, x in enumerate(contestant.answers) if x is not None]
    worst, apart = (max((one[i].distance(x) for i, x in there), default=np.nan) for one in (known, weighted))
    outside = max((beyond(known[i], x) for i, x in there), default=np.nan)
    return Line(contestant.name, len(there), worst, apart, outside, float(np.nanmedian(times)))


def beyond(known: Reference, x: Array) -> float:
    """Return the largest violation of a bound or a hard row."""
    problem, end = known.problem, int(known.problem.layout.offsets[1])
    return float(excess(problem.values(x, end), *problem.bounds(end)).max(initial=0.0))


def lines(name: str, arguments: argparse.Namespace) -> Iterator[Line]:
    """Yield what came of each contestant on the problems of a set, those of all its sequences in a row."""
    known = [reference(problem) for one in problem_set(name).sequences for problem in one.problems]
    folder = hand_over_rows([one.problem for one in known])
    contestants = [*(Resolver(own, known) for own in OURS), *remotes(arguments, folder, every=True)]
    interleave(contestants, len(known), arguments.block)  # imports and caches are nobody's time
    times = interleave(contestants, len(known), arguments.block)
    for contestant in contestants:
        contestant.answers = contestant.answers[-len(known) :]
    weighted = [replace(one, x=np.array(x)) for one, x in zip(known, contestants[1].answers, strict=True)]
    for contestant, measured in zip(contestants, times, strict=True):
        if isinstance(contestant, Remote):
            contestant.close()
        yield line(contestant, known, weighted, measured)


def main() -> None:
    """Read the command line, and print a table for each set."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--set", nargs="+", default=SETS)
    parser.add_argument("--block", type=int, default=5, help="problems in a turn")
    parser.add_argument("--clock", default="cpu", choices=CLOCKS)
    add_peers(parser)
    arguments = parser.parse_args()
    Local.clock = staticmethod(CLOCKS[arguments.clock])
    for name in arguments.set:
        found = [*lines(name, arguments)]
        heading = name, "answers", "distance", "from wqp", "outside", "median [µs]", "× active-set"
        print(f"\n| {' | '.join(heading)} |\n|---|--:|--:|--:|--:|--:|--:|")
        for one in found:
            errors = f"{one.distance:.0e} | {one.from_weighted:.0e} | {one.outside:.0e}"
            ratio = one.median / found[0].median
            print(f"| {one.name} | {one.answered} | {errors} | {one.median:.0f} | {ratio:.2f} |")


if __name__ == "__main__":
    main()
