"""Two commits of this library, tick by tick in one run: is the new one slower than the old one?

Each commit has a process of its own, and its compiled kernels are kept between calls. Short blocks of ticks
take turns, and each block is compared with the one beside it, so that a change in the speed of the machine
meets both. The first run compiles, and does not count.
"""

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from checkout import ROOT, cache_of, environment, full_name, worktree

from taskopt.arrays import Array

WARM, BLOCK = 500, 100  # ticks that do not count, ticks in a turn
COLD = 20  # ticks at the beginning of a block that do not count: the other process has used the caches
BAR = 1.03  # of the median ratio of all runs


class Worker:
    """A process that runs ticks of one checkout.

    Args:
        folder: The checkout.
        cache: Where its compiled kernels are kept; where the user keeps them, if it is None.
    """

    def __init__(self, folder: Path, cache: Path | None) -> None:
        script = Path(__file__).with_name("worker.py")
        self._process = subprocess.Popen(
            [sys.executable, str(script), str(folder)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment(folder, cache),
        )  # fmt: skip

    def ask(self, line: str) -> dict[str, list[float]]:
        """Send a line and return the answer.

        Raises:
            SystemExit: The process has ended; its own message is on stderr.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(line, file=self._process.stdin, flush=True)
        answer = self._process.stdout.readline()
        if not answer:
            raise SystemExit(f"the process of {self._process.args} ended; its own message is above")
        return json.loads(answer)

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


@dataclass(frozen=True)
class Pass:
    """Both commits once through a case.

    Attributes:
        old: Median time of a tick in each block, (blocks,) [µs].
        new: The same of the working tree, in the blocks beside them, (blocks,) [µs].
        fallbacks: Ticks that another method answered, old and new.
        searches: Ticks that needed the search, old and new.
    """

    old: Array
    new: Array
    fallbacks: tuple[int, int]
    searches: tuple[int, int]

    @property
    def ratio(self) -> float:
        """New time over old time, the median over all pairs of blocks."""
        return float(np.median(self.new / self.old))


def compare(old: Worker, new: Worker, case: str, ticks: int) -> Pass:
    """Take both workers once through a case, block by block in turn.

    Args:
        old: The commit to compare with.
        new: The working tree.
        case: Name of the benchmark case.
        ticks: Number of ticks, `WARM` of which do not count.

    Returns:
        Medians and counts.
    """
    workers = old, new
    times: tuple[list[float], list[float]] = ([], [])
    counts = np.zeros((2, 2), dtype=int)  # fallbacks and searches of each
    for worker in workers:
        worker.ask(f"case {case} {ticks}")
    for turn, first in enumerate(range(0, ticks, BLOCK)):
        order = (0, 1) if turn % 2 == 0 else (1, 0)
        for who in order:
            answer = workers[who].ask(f"block {first} {min(first + BLOCK, ticks)}")
            if first >= WARM and len(answer["times"]) > COLD:
                times[who].append(float(np.median(answer["times"][COLD:])))
            counts[:, who] += [answer["fallbacks"], answer["searches"]]
    fallbacks, searches = ((int(pair[0]), int(pair[1])) for pair in counts)
    return Pass(np.array(times[0]), np.array(times[1]), fallbacks, searches)


def table(passes: dict[str, list[Pass]], commit: str) -> str:
    """Return the Markdown table of all cases.

    Args:
        passes: All passes of each case.
        commit: The commit that was compared with.
    """
    lines = [
        f"| case | {commit} [µs] | now [µs] | ratio, median of runs | spread | search, ticks | fallbacks |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for case, done in passes.items():
        ratios = [one.ratio for one in done]
        median = float(np.median(ratios))
        old, new = (float(np.median([getattr(one, side) for one in done])) for side in ("old", "new"))
        spread = f"{min(ratios):.3f} – {max(ratios):.3f}"
        verdict = "" if median <= BAR else " **slower**"
        pairs = [f"{pair[0]} → {pair[1]}" for pair in (done[-1].searches, done[-1].fallbacks)]
        lines.append(
            f"| {case} | {old:.1f} | {new:.1f} | {median:.3f}{verdict} | {spread} | {pairs[0]} | {pairs[1]} |"
        )
    return "\n".join(lines)


def tick_against(commit: str, cases: Sequence[str], ticks: int, runs: int) -> bool:
    """Compare the working tree with a commit, and print the table.

    Args:
        commit: Any name of a commit.
        cases: Names of benchmark cases.
        ticks: Number of ticks of each case in each run.
        runs: Number of runs that count; each has two new processes.

    Returns:
        True if no case is slower than `BAR` allows.
    """
    passes: dict[str, list[Pass]] = {case: [] for case in cases}
    with worktree(commit) as folder:
        for run in range(-1, runs):
            workers = Worker(folder, cache_of(full_name(commit)) / "kernels"), Worker(ROOT, None)
            for case in cases:
                done = compare(*workers, case, ticks)
                if run >= 0:
                    passes[case].append(done)
            for worker in workers:
                worker.close()
            print("first run (compiles)" if run < 0 else f"run {run + 1} of {runs}", file=sys.stderr)
    print(table(passes, commit))
    return all(np.median([one.ratio for one in done]) <= BAR for done in passes.values())
