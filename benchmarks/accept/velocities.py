"""The velocities of an old commit, computed again by this one at the same postures.

    python benchmarks/accept/velocities.py        # all cases and scenarios; rewrites velocities.txt
    python benchmarks/accept/velocities.py --only W1s singular --ticks 200
    python benchmarks/accept/velocities.py --sample   # rewrites sample.npz, which the tests use

The old commit runs each benchmark case and each scenario of tasks/ in closed loop, in a process and a
worktree of its own. At each of its postures, with the same time, targets and last velocity, this
commit computes its velocity. It may differ by 10 times the largest change that the old commit itself shows
over the same ticks when every entry of q moves by one last bit, in 20 random sign patterns. In saturated
cases every answer must meet its KKT conditions besides, and be within 1e-9 of `hqp/daqp` on the same
hierarchy wherever that answer meets them, too. Where the optimum is flat, as along a posture of weight 1e-6
beside tasks of weight 1, two such answers may lie farther apart; they must then agree to 1e-9 in the rows
of the tasks, each times the root of its weight. A scenario with a conflict counts up to its first conflict.
A scenario whose declaration has changed since is compared as it was declared last before the change, which is
the declaration of the old commit in the words of today; `CHANGED` names these scenarios.
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # the modules beside this folder

import numpy as np
from cases import NAMES
from checkout import BEFORE, ROOT, Subject, cache_of, environment, full_name, subject, undamped, worktree

from taskopt import Controller
from taskopt.arrays import Array
from taskopt.resolver.registry import resolver

FACTOR = 10.0  # times the response to one last bit
LEAST = 1e-15  # [rad/s, m/s] a change below the rounding of v itself is none
APART = 1e-9  # [rad/s, m/s] from hqp/daqp in saturated cases
CASE_TICKS = 1000
OUTPUT = Path(__file__).with_suffix(".txt")
SAMPLE = Path(__file__).with_name("sample.npz")
LAST_AS_BEFORE = "1dcc618"  # the last commit before the Panda's scenarios had limits on accelerations
CHANGED = ("internal_motion", "panda_circle", "panda_obstacles", "panda_switch", "square_inverse")
SAMPLE_SEED, SAMPLE_NAMES, SAMPLE_TICKS = 1, 8, 40


@dataclass(frozen=True)
class Outcome:
    """Results of one subject.

    Attributes:
        name: Name of the case or scenario.
        ticks: Number of ticks compared.
        change: Largest difference of the velocities [rad/s, m/s].
        response: Largest response of the old commit to one last bit of q [rad/s, m/s].
        unmet: Ticks whose answer misses its KKT conditions.
        fallbacks: Ticks that another method answered.
        apart: Largest distance to hqp/daqp [rad/s, m/s]; NaN if the case is not saturated.
        apart_in_rows: The same in the rows, each times the root of its weight.
        compared: Ticks at which hqp/daqp meets its KKT conditions, too.
    """

    name: str
    ticks: int
    change: float
    response: float
    unmet: int
    fallbacks: int
    apart: float
    apart_in_rows: float
    compared: int

    @property
    def accepted(self) -> bool:
        """True if the velocities are those of the old commit, and saturated ones meet KKT conditions."""
        same = self.change <= max(FACTOR * self.response, LEAST)
        saturated = np.isfinite(self.apart)
        return same and (not saturated or (self.unmet == 0 and min(self.apart, self.apart_in_rows) <= APART))

    def __str__(self) -> str:
        beside = (
            f"{self.apart:.1e} {self.apart_in_rows:.1e} {self.compared:5d}" if np.isfinite(self.apart) else ""
        )
        verdict = "ok" if self.accepted else "NOT"
        bound = max(FACTOR * self.response, LEAST)
        return (
            f"{self.name:20s} {self.ticks:6d} {self.change:10.1e} {bound:10.1e} {self.unmet:9d} "
            f"{self.fallbacks:9d} {beside:>21s}  {verdict}"
        )


HEADER = (
    f"{'case or scenario':20s} {'ticks':>6s} {'|dv|':>10s} {'allowed':>10s} {'KKT unmet':>9s} "
    f"{'fallbacks':>9s} {'to hqp/daqp: v, rows, ticks':>21s}"
)


def is_saturated(name: str) -> bool:
    """Return True for a benchmark case whose target is out of reach."""
    return name in NAMES and "x" in name


def examine(of: Subject, q: Array, v: Array, response: float) -> Outcome:
    """Compute the velocities again, open loop, and compare.

    Args:
        of: The subject, made by this commit.
        q: Postures of the old commit, (ticks, nq) [rad, m].
        v: Velocities of the old commit, (ticks, nv) [rad/s, m/s].
        response: Its largest response to one last bit of q [rad/s, m/s].
    """
    control = Controller(of.robot, of.stack, "active-set", of.dt)
    cascade = resolver("hqp/daqp") if is_saturated(of.name) else None
    change, unmet, fallbacks, compared = 0.0, 0, 0, 0
    apart, in_rows = (0.0, 0.0) if cascade else (np.nan, np.nan)
    for tick in range(len(q)):
        resolution = control.step(q[tick], of.aim(tick), v[tick - 1] if tick else None)
        change = max(change, float(np.abs(resolution.v - v[tick]).max()))
        unmet += not resolution.kkt_met()
        fallbacks += resolution.fallback is not None
        if cascade:
            other, _ = cascade(resolution.problem)
            if other.kkt_met():
                compared += 1
                problem, difference = resolution.problem, resolution.x - other.x
                apart = max(apart, float(np.abs(difference).max()))
                in_rows = max(
                    in_rows, float(np.abs(np.sqrt(problem.weight) * (problem.A @ difference)).max())
                )
    return Outcome(of.name, len(q), change, response, unmet, fallbacks, apart, in_rows, compared)


def records(commit: str, names: list[str], ticks: int) -> Iterator[tuple[str, Array, Array, float]]:
    """Yield what the old commit did, subject by subject.

    Args:
        commit: The old commit.
        names: Cases and scenarios.
        ticks: Number of ticks of each; 0 for all of a scenario, and `CASE_TICKS` of a case.

    Yields:
        Name, postures (ticks, nq), velocities (ticks, nv), and the largest response to one last bit of q.
    """
    script = Path(__file__).with_name("recorder.py")
    with worktree(commit) as folder, tempfile.TemporaryDirectory() as place:
        variables = environment(folder, cache_of(full_name(commit)) / "kernels")
        for name in names:
            file, count = Path(place) / f"{name}.npz", ticks or (CASE_TICKS if name in NAMES else 0)
            command = [sys.executable, str(script), str(folder), str(file), name, str(count)]
            subprocess.run(command, env=variables, check=True)
            with np.load(file) as recorded:
                yield name, recorded["q"], recorded["v"], float(recorded["response"].max(initial=0.0))


def examine_record(name: str, q: Array, v: Array, response: float) -> Outcome:
    """Make the subject by name, and compare as `examine` does."""
    if name not in CHANGED:
        return examine(undamped(subject(ROOT, name, len(q) if name in NAMES else None)), q, v, response)
    with tempfile.TemporaryDirectory() as place:
        write_declaration(name, Path(place))
        return examine(undamped(subject(Path(place), name)), q, v, response)


def write_declaration(name: str, folder: Path) -> None:
    """Write a scenario, as it was declared before its change, into the folder `tasks` of another folder."""
    (folder / "tasks").mkdir()
    shown = subprocess.run(
        ["git", "show", f"{LAST_AS_BEFORE}:tasks/{name}.py"], cwd=ROOT, capture_output=True, check=True
    )
    (folder / "tasks" / f"{name}.py").write_bytes(shown.stdout)


def write_sample(commit: str) -> None:
    """Write the first ticks of some cases and scenarios, chosen by a seed, to `SAMPLE`."""
    rng, kept = np.random.default_rng(SAMPLE_SEED), {}
    names = sorted(rng.choice(everything(), SAMPLE_NAMES, replace=False).tolist())
    for name, q, v, response in records(commit, names, SAMPLE_TICKS):
        kept |= {f"{name}/q": q, f"{name}/v": v, f"{name}/response": np.array(response)}
    np.savez_compressed(SAMPLE, **kept)


def everything(commit: str = BEFORE) -> list[str]:
    """Return the names of all cases, and of the scenarios that an old commit has, too."""
    listed = subprocess.run(
        ["git", "ls-tree", "--name-only", commit, "tasks/"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    before = {Path(line).stem for line in listed.stdout.splitlines() if line.endswith(".py")}
    here = {path.stem for path in (ROOT / "tasks").glob("[!_]*.py")}
    return [*NAMES, *sorted(before & here)]


def main() -> None:
    """Print the table; write it to the file beside this script if nothing was left out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--against", metavar="COMMIT", default=BEFORE)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="cases and scenarios")
    parser.add_argument("--ticks", type=int, default=0, help="of each; else all")
    parser.add_argument("--sample", action="store_true", help=f"write {SAMPLE.name} instead of comparing")
    arguments = parser.parse_args()
    if arguments.sample:
        write_sample(arguments.against)
        return
    head = f"velocities of this commit at the postures of {arguments.against}\n\n{HEADER}"
    print(head, flush=True)
    lines, accepted = [head], True
    for recorded in records(
        arguments.against, arguments.only or everything(arguments.against), arguments.ticks
    ):
        outcome = examine_record(*recorded)
        print(outcome, flush=True)
        lines.append(str(outcome))
        accepted &= outcome.accepted
    if not arguments.only and not arguments.ticks:
        OUTPUT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    raise SystemExit(not accepted)


if __name__ == "__main__":
    main()
