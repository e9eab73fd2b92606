"""Time of one tick: this library through `Controller` beside its peers, or beside an older commit.

    python benchmarks/tick.py                       # W1 and W1v, beside pink if it is installed
    python benchmarks/tick.py --case W1s W2 W2s     # strict levels; TALOS
    python benchmarks/tick.py --placo PYTHON --mink PYTHON   # these too, from environments that have them
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
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from time import perf_counter_ns, thread_time_ns

import cases
import numpy as np
from against import tick_against
from handed import Remote, hand_over

from taskopt import Controller, TaskoptError
from taskopt.arrays import Array
from taskopt.solver.inside import nanoseconds_inside

STRICT = "s"  # in the name of a case: levels that no peer can state
CLOCKS = {"wall": perf_counter_ns, "cpu": thread_time_ns}  # the latter leaves out what other processes took
PEERS = {"placo": ("placo_tick.py", "eiquadprog"), "mink": ("mink_tick.py", "daqp")}


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
            except (TaskoptError, pink_error()) as error:
                print(f"  {type(self).__name__} gave up at tick {i}: {error}"[:200])
                self.gone = True
                break
            times[i - first] = (self.clock() - begin) * 1e-3
            self.inside.append((nanoseconds_inside() - before) * 1e-3)
        return times


def pink_error() -> type[Exception]:
    """Return the error that pink raises, or our own where pink is not installed."""
    if not find_spec("pink"):
        return TaskoptError
    from pink.exceptions import PinkError  # pyright: ignore[reportMissingImports]

    return PinkError


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
        self.q = self.case.robot.integrate(self.q, self.last.v, cases.DT)


class Pink(Local):
    """pink on the same case, through its documented loop.

    Args:
        case: The case.
        solver: Name of the QP solver.
    """

    def __init__(self, case: cases.BenchmarkCase, solver: str = "quadprog") -> None:
        import pink  # pyright: ignore[reportMissingImports]
        import pinocchio as pin
        from pink.limits import ConfigurationLimit, VelocityLimit  # pyright: ignore[reportMissingImports]
        from pink.tasks import ComTask, FrameTask, PostureTask  # pyright: ignore[reportMissingImports]

        super().__init__()
        self.name = f"pink {solver}"
        self.pin, self.solve, self.solver = pin, pink.solve_ik, solver
        model = pin.Model(case.robot.model)  # pyright: ignore[reportAttributeAccessIssue]
        model.velocityLimit *= cases.VELOCITY_SCALE.get(case.name, 1.0)
        self.configuration = pink.Configuration(model, model.createData(), case.q0)
        self.hand = FrameTask(case.frame, 1.0, 1.0)
        self.tasks = [self.hand]
        cost = {name: weight**0.5 for name, weight in cases.weights(case.name).items()}
        if case.name.startswith("W2"):
            self.tasks += [ComTask(cost=cost["centre of mass"])]
            feet = [FrameTask(foot, cost["feet"], cost["feet"]) for foot in cases.FEET]
        else:
            feet = []
        self.constraints = feet if "h" in case.name else []
        self.tasks += [*([] if self.constraints else feet), PostureTask(cost=cost["posture"])]
        for task in [*self.tasks, *self.constraints]:
            task.set_target_from_configuration(self.configuration)
        self.limits = [ConfigurationLimit(model, cases.POSITION_GAIN), VelocityLimit(model)]
        self.poses = [pin.SE3(pose) for pose in case.poses]  # pyright: ignore[reportAttributeAccessIssue]

    def velocity(self) -> Array:
        """Return its answer at its own posture, (nv,) [rad/s, m/s]."""
        return self.solve(
            self.configuration,
            self.tasks,
            cases.DT,
            solver=self.solver,
            damping=cases.DAMPING,
            limits=self.limits,
            constraints=self.constraints or None,
        )

    def tick(self, i: int) -> None:
        """Do one tick."""
        self.hand.set_target(self.poses[i])
        self.configuration.integrate_inplace(self.velocity(), cases.DT)

    def velocity_at(self, q: Array, i: int) -> Array:
        """Return its answer at another posture, (nv,) [rad/s, m/s]; this is not timed."""
        self.configuration.update(q)
        self.hand.set_target(self.poses[i])
        return self.velocity()


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
    pink = Pink(case) if find_spec("pink") and STRICT not in case.name else None
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


def rows(name: str, arguments: argparse.Namespace) -> Iterator[tuple[str, Array, Array]]:
    """Yield name, times and times inside a solver [µs] of each contestant, without the warm-up."""
    case = cases.benchmark_case(name, arguments.ticks)
    contestants: list[Local | Remote] = [Ours(case, resolver) for resolver in arguments.resolver]
    if find_spec("pink"):
        contestants += [Pink(case, solver) for solver in ("quadprog", "daqp")]
    folder = hand_over(case)
    for peer, (script, solver) in PEERS.items():
        if getattr(arguments, peer):
            contestants.append(Remote(getattr(arguments, peer), script, folder, solver, arguments.clock))
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
    for peer in PEERS:
        parser.add_argument(f"--{peer}", metavar="PYTHON", help=f"an interpreter that has {peer} installed")
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
