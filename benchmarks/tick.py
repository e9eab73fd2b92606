"""Time of one tick: this library through `Controller` beside its peers, or beside an older commit.

    python benchmarks/tick.py                       # W1 and W1v
    python benchmarks/tick.py --case W1s W2 W2s     # strict levels; TALOS
    python benchmarks/tick.py --peers FOLDER        # beside the peers of peers/environments.py FOLDER
    python benchmarks/tick.py --with PYTHON SCRIPT  # beside a peer of your own, a script that calls serve
    python benchmarks/tick.py --case W1s --resolver active-set pinv hqp/daqp wqp/daqp   # several resolvers
    python benchmarks/tick.py --memory 1000000 --case W1s    # resident memory over so many ticks
    python benchmarks/tick.py --against 8dbc6b4     # all cases: is this checkout slower than that commit?

A tick is: set the target of the hand, build, solve (certificate on), integrate. The next build does the
forward kinematics. One thread; libraries or commits take turns in blocks of ticks, so that a change in the
speed of the machine meets all of them. Ratios are of medians and of 99th percentiles over the same run.
Beside the times stands the largest deviation of our velocity from that of pink at the same posture. For a
resolver that calls a solver, two more columns are the time inside the package of the solver and the time
around it: kinematics, rows, scaling, examination of the answer.

With --against each commit has a process of its own and is timed by the CPU clock of its thread. In each of
seven runs the median of a block is divided by that of the block beside it; the median of all these ratios may
be 1.03. The exit status tells.
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported: sizes like these gain nothing from threads

import argparse
import gc
import resource
import sys
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter_ns, thread_time_ns
from typing import Any

import cases
import numpy as np
from against import tick_against
from peers.environments import installed, interpreter
from peers.handed import Remote, hand_over

from taskopt import Controller, TaskoptError
from taskopt.arrays import Array
from taskopt.solver.inside import nanoseconds_inside

HERE = Path(__file__).parent / "peers"
STRICT = "s"  # in the name of a case: levels that no peer can state
CLOCKS = {"wall": perf_counter_ns, "cpu": thread_time_ns}  # the latter leaves out what other processes took


class Local:
    """A contestant in this process; after an error it is out, and its times are NaN.

    Attributes:
        name: Label in the table.
        gone: True after an error.
        clock: The clock in nanoseconds.
    """

    name = ""
    gone = False
    clock = staticmethod(perf_counter_ns)

    def __init__(self) -> None:
        self.inside: list[float] = []  # time inside the package of a solver in each tick [µs]

    def tick(self, i: int) -> None:
        """Do one tick."""

    def block(self, first: int, stop: int) -> Array:
        """Return the time of the ticks from `first` to `stop`, (ticks,) [µs]."""
        times = np.full(stop - first, np.nan)
        for i in range(first, stop):
            if self.gone:
                break
            begin, before = self.clock(), nanoseconds_inside()
            try:
                self.tick(i)
            except TaskoptError as error:
                print(f"  {type(self).__name__} gave up at tick {i}: {error}"[:200])
                self.gone = True
                break
            times[i - first] = (self.clock() - begin) * 1e-3
            self.inside.append((nanoseconds_inside() - before) * 1e-3)
        return times


class Ours(Local):
    """`Controller` on a case, as a user embeds it.

    Args:
        case: The case.
        resolver: Name of the resolver.
    """

    def __init__(self, case: cases.BenchmarkCase, resolver: str = "active-set") -> None:
        super().__init__()
        self.name = f"taskopt {resolver}"
        self.case, self.q = case, case.q0.copy()
        self.control = Controller(case.robot, case.stack, resolver, cases.DT)
        self.control.start(self.q)

    def tick(self, i: int) -> None:
        """Do one tick."""
        self.case.hand.set(self.case.poses[i])
        self.last = self.control.step(self.q, 0.0)
        self.q, _ = self.control.after()


def pink_beside(case: cases.BenchmarkCase) -> Any:
    """Return pink on a case in this process, to be asked at our postures; None where it is not installed."""
    if not find_spec("pink") or STRICT in case.name:
        return None
    sys.path.insert(0, str(HERE))
    from peers.pink_peer import Stack
    from peers.served import handed_case

    return Stack(handed_case(hand_over(case), "quadprog"))


def interleave(contestants: Sequence[Local | Remote], ticks: int, block: int) -> list[Array]:
    """Let contestants take turns in blocks of ticks.

    Args:
        contestants: Each is at its start.
        ticks: Number of ticks.
        block: Number of ticks in a turn.

    Returns:
        Time of each tick, (ticks,) [µs], for each contestant.
    """
    times: list[list[Array]] = [[] for _ in contestants]
    gc.collect()
    gc.disable()
    for first in range(0, ticks, block):
        for contestant, measured in zip(contestants, times, strict=True):
            measured.append(contestant.block(first, min(first + block, ticks)))
    gc.enable()
    return [np.concatenate(measured) for measured in times]


def examine(case: cases.BenchmarkCase, resolver: str, ticks: int) -> str:
    """Go through a case once more for what times do not show.

    Returns:
        One line: how many bounds are active, how often the fast path answered and how often a fallback, the
        largest KKT residual, and the largest deviation from pink.
    """
    ours = Ours(case, resolver)
    pink = pink_beside(case)
    bounds, searches, fallbacks, worst, apart = np.zeros(ticks), 0, 0, 0.0, 0.0
    for i in range(ticks):
        q = ours.q
        ours.tick(i)
        bounds[i] = np.count_nonzero(ours.last.state[: case.robot.nv])
        searches += ours.last.iterations > 0
        fallbacks += ours.last.fallback is not None
        worst = max(worst, ours.last.certificate.worst)
        if pink:
            apart = max(apart, float(np.abs(ours.last.v - pink.velocity_at(q, i)).max()))
    beside = f"; largest deviation from pink {apart:.1e} rad/s" if pink else ""
    share = f"bounds active on {100 * np.mean(bounds > 0):.0f} % of the ticks, at most {bounds.max():.0f}"
    answered = f"fast path {100 - 100 * searches / ticks:.0f} %, {fallbacks} fallbacks"
    return f"{share}; {answered}; largest KKT residual {worst:.1e}{beside}"


def remotes(arguments: argparse.Namespace, folder: Path, every: bool = False) -> list[Remote]:
    """Start the peers that the command line names.

    Args:
        arguments: With `peers`, a folder or None, `with_own`, pairs of interpreter and script, and `clock`.
        folder: What was handed over.
        every: True for all solvers of a peer, not only those that differ in a case.
    """
    told = []
    for name, peer in installed(arguments.peers).items() if arguments.peers else ():
        solvers = peer.solvers if every or name != "embodik" else peer.solvers[:1]
        told += [(str(interpreter(arguments.peers, name)), peer.script, solver) for solver in solvers]
    told += [(python, str(Path(script).resolve()), "own") for python, script in arguments.with_own or ()]
    return [Remote(python, script, folder, solver, arguments.clock) for python, script, solver in told]


def rows(name: str, arguments: argparse.Namespace) -> Iterator[tuple[str, Array, Array]]:
    """Yield name, times and times inside a solver [µs] of each contestant, without the warm-up."""
    case = cases.benchmark_case(name, arguments.ticks)
    contestants: list[Local | Remote] = [Ours(case, resolver) for resolver in arguments.resolver]
    contestants += remotes(arguments, hand_over(case))
    times = interleave(contestants, arguments.ticks, arguments.block)
    for contestant in contestants:
        if isinstance(contestant, Remote):
            contestant.close()
    print(f"\n{name}: {examine(case, arguments.resolver[0], arguments.ticks)}")
    for contestant, measured in zip(contestants, times, strict=True):
        inside = np.array(contestant.inside if isinstance(contestant, Local) else [])
        yield contestant.name, measured[arguments.warm :], inside[arguments.warm :]


def beside_peers(arguments: argparse.Namespace) -> None:
    """Print the medians and the 99th percentiles of all contestants, case by case."""
    Local.clock = staticmethod(CLOCKS[arguments.clock])
    for name in arguments.case or ("W1", "W1v"):
        base = None
        for label, microseconds, inside in rows(name, arguments):
            done = microseconds[np.isfinite(microseconds)]
            if not done.size:
                print(f"  {label:24s} no tick after the warm-up")
                continue
            median, tail = np.percentile(done, [50, 99])
            base = base or (median, tail)
            print(
                f"  {label:24s} median {median:7.1f} µs   p99 {tail:7.1f} µs   "
                f"{median / base[0]:5.2f} × our median, {tail / base[1]:5.2f} × our p99"
                + (f"   inside solver {np.median(inside):6.1f} µs" if inside.any() else "")
                + (f", around it {np.median(done - inside):6.1f} µs" if inside.any() else "")
                + ("" if done.size == microseconds.size else f"   ({done.size} ticks)")
            )


def add_peers(parser: argparse.ArgumentParser) -> None:
    """Add the options that name peers."""
    parser.add_argument(
        "--peers", type=Path, metavar="FOLDER", help="where peers/environments.py put the environments"
    )
    parser.add_argument(
        "--with",
        dest="with_own",
        nargs=2,
        action="append",
        metavar=("PYTHON", "SCRIPT"),
        help="a peer of yours",
    )


def watch_memory(arguments: argparse.Namespace) -> None:
    """Print the largest resident memory so far, ten times in the course of many ticks of one case."""
    case = cases.benchmark_case((arguments.case or ["W1s"])[0], arguments.ticks)
    ours = Ours(case, arguments.resolver[0])
    for k in range(arguments.memory + 1):
        if k % (arguments.memory // 10) == 0:
            most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            print(f"{ours.name}, tick {k}: {most:.1f} MB at most so far")
        if k % arguments.ticks == 0:
            ours.q = case.q0.copy()
            ours.control.start(ours.q)
        ours.tick(k % arguments.ticks)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--case", nargs="+", choices=cases.NAMES, help="W1 and W1v; with --against, all")
    parser.add_argument("--ticks", type=int, help="6000; with --against, 4000")
    parser.add_argument("--warm", type=int, default=1000, help="ticks at the beginning that do not count")
    parser.add_argument("--resolver", nargs="+", default=["active-set"])
    parser.add_argument("--memory", type=int, metavar="TICKS", help="watch resident memory instead")
    parser.add_argument("--block", type=int, default=250, help="ticks in a turn")
    parser.add_argument("--clock", default="wall", choices=CLOCKS, help="cpu: on a machine that others use")
    parser.add_argument("--against", metavar="COMMIT", help="compare with this commit instead of with peers")
    parser.add_argument("--runs", type=int, default=7, help="with --against")
    add_peers(parser)
    arguments = parser.parse_args()
    if arguments.against:
        chosen = arguments.case or cases.NAMES
        raise SystemExit(not tick_against(arguments.against, chosen, arguments.ticks or 4000, arguments.runs))
    arguments.ticks = arguments.ticks or 6000
    if arguments.memory:
        watch_memory(arguments)
    else:
        beside_peers(arguments)


if __name__ == "__main__":
    main()
