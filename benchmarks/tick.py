"""What one tick costs: this library through `Controller`, and its peers, in one run.

    python bench/tick.py                     # W1 and W1v, beside pink if it is installed
    python bench/tick.py --work W1s W2 W2s   # strict levels; TALOS
    python bench/tick.py --work W2x W2xs     # saturated
    python bench/tick.py --placo PYTHON --mink PYTHON   # these too, from environments that have them

A tick is: set the hand's target, build, solve (certificate on), integrate. The next build does the
forward kinematics. One thread; libraries take turns in blocks of ticks, so that a change in the
machine's speed meets all of them; ratios are of medians and of p99 over the same run. Beside the times
stands the largest deviation of our velocity from pink's at the same posture, tick by tick.
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported: sizes like these gain nothing from threads

import argparse
import gc
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from time import perf_counter_ns, thread_time_ns

import numpy as np
import works
from handed import Remote, hand_over

from taskopt import Controller, TaskoptError
from taskopt.arrays import Array

STRICT = "s"  # in the name of a work: levels that no peer can state
CLOCKS = {"wall": perf_counter_ns, "cpu": thread_time_ns}  # the latter leaves out what other processes took
PEERS = {"placo": ("placo_tick.py", "eiquadprog"), "mink": ("mink_tick.py", "daqp")}


class Local:
    """A contestant in this process; after an error it is out, and its times are NaN."""

    name = ""
    gone = False
    clock = staticmethod(perf_counter_ns)

    def tick(self, i: int) -> None: ...

    def block(self, first: int, stop: int) -> Array:
        """Microseconds of the ticks from `first` to `stop`."""
        times = np.full(stop - first, np.nan)
        for i in range(first, stop):
            if self.gone:
                break
            begin = self.clock()
            try:
                self.tick(i)
            except (TaskoptError, pink_error()) as error:
                print(f"  {type(self).__name__} gave up at tick {i}: {error}"[:200])
                self.gone = True
                break
            times[i - first] = (self.clock() - begin) * 1e-3
        return times


def pink_error() -> type[Exception]:
    """pink's own error, if pink is there."""
    if not find_spec("pink"):
        return TaskoptError
    from pink.exceptions import PinkError

    return PinkError


class Ours(Local):
    """`Controller` on a work, as a user embeds it."""

    def __init__(self, work: works.Work, resolver: str = "active-set") -> None:
        self.name = f"taskopt {resolver}"
        self.work, self.q = work, work.q0.copy()
        self.control = Controller(work.robot, work.stack, resolver, works.DT)
        self.control.start(self.q)

    def tick(self, i: int) -> None:
        self.work.hand.set(self.work.poses[i])
        self.last = self.control.step(self.q, 0.0)
        self.q = self.work.robot.integrate(self.q, self.last.v, works.DT)


class Pink(Local):
    """pink on the same work, through its documented loop."""

    def __init__(self, work: works.Work, solver: str = "quadprog") -> None:
        import pink
        import pinocchio as pin
        from pink.limits import ConfigurationLimit, VelocityLimit
        from pink.tasks import ComTask, FrameTask, PostureTask

        self.name = f"pink {solver}"
        self.pin, self.solve, self.solver = pin, pink.solve_ik, solver
        model = pin.Model(work.robot.model)
        model.velocityLimit *= works.VELOCITY_SCALE.get(work.name, 1.0)
        self.configuration = pink.Configuration(model, model.createData(), work.q0)
        self.hand = FrameTask(work.frame, 1.0, 1.0)
        self.tasks = [self.hand]
        cost = {name: weight**0.5 for name, weight in works.weights(work.name).items()}
        if work.name.startswith("W2"):
            self.tasks += [ComTask(cost=cost["centre of mass"])]
            feet = [FrameTask(foot, cost["feet"], cost["feet"]) for foot in works.FEET]
        else:
            feet = []
        self.constraints = feet if "h" in work.name else []
        self.tasks += [*([] if self.constraints else feet), PostureTask(cost=cost["posture"])]
        for task in [*self.tasks, *self.constraints]:
            task.set_target_from_configuration(self.configuration)
        self.limits = [ConfigurationLimit(model, works.KAPPA), VelocityLimit(model)]
        self.poses = [pin.SE3(pose) for pose in work.poses]

    def velocity(self) -> Array:
        return self.solve(
            self.configuration,
            self.tasks,
            works.DT,
            solver=self.solver,
            damping=works.DAMPING,
            limits=self.limits,
            constraints=self.constraints or None,
        )

    def tick(self, i: int) -> None:
        self.hand.set_target(self.poses[i])
        self.configuration.integrate_inplace(self.velocity(), works.DT)

    def velocity_at(self, q: Array, i: int) -> Array:
        """Its answer at somebody else's posture; not timed."""
        self.configuration.update(q)
        self.hand.set_target(self.poses[i])
        return self.velocity()


def interleave(contestants: Sequence[Local | Remote], ticks: int, block: int) -> list[Array]:
    """Microseconds of each tick, (ticks,) for each contestant; blocks take turns."""
    times: list[list[Array]] = [[] for _ in contestants]
    gc.collect()
    gc.disable()
    for first in range(0, ticks, block):
        for contestant, measured in zip(contestants, times, strict=True):
            measured.append(contestant.block(first, min(first + block, ticks)))
    gc.enable()
    return [np.concatenate(measured) for measured in times]


def examine(work: works.Work, resolver: str, ticks: int) -> str:
    """What the times do not show: how many bounds are active, the certificate, the distance to pink."""
    ours = Ours(work, resolver)
    pink = Pink(work) if find_spec("pink") and STRICT not in work.name else None
    bounds, walks, worst, apart = np.zeros(ticks), 0, 0.0, 0.0
    for i in range(ticks):
        q = ours.q
        ours.tick(i)
        bounds[i] = np.count_nonzero(ours.last.state[: work.robot.nv])
        walks += ours.last.iterations > 0
        worst = max(worst, ours.last.certificate.worst)
        if pink:
            apart = max(apart, float(np.abs(ours.last.v - pink.velocity_at(q, i)).max()))
    beside = f"; largest deviation from pink {apart:.1e} rad/s" if pink else ""
    share = f"bounds active on {100 * np.mean(bounds > 0):.0f} % of the ticks, at most {bounds.max():.0f}"
    return f"{share}; closed form {100 - 100 * walks / ticks:.0f} %; worst certificate {worst:.1e}{beside}"


def rows(name: str, arguments: argparse.Namespace) -> Iterator[tuple[str, Array]]:
    """Name and times of each contestant, warm-up taken off."""
    work = works.work(name, arguments.ticks)
    contestants: list[Local | Remote] = [Ours(work, arguments.resolver)]
    if find_spec("pink"):
        contestants += [Pink(work, solver) for solver in ("quadprog", "daqp")]
    folder = hand_over(work)
    for peer, (script, solver) in PEERS.items():
        if getattr(arguments, peer):
            contestants.append(Remote(getattr(arguments, peer), script, folder, solver, arguments.clock))
    times = interleave(contestants, arguments.ticks, arguments.block)
    for contestant in contestants:
        if isinstance(contestant, Remote):
            contestant.close()
    print(f"\n{name}: {examine(work, arguments.resolver, arguments.ticks)}")
    yield from ((c.name, t[arguments.warm :]) for c, t in zip(contestants, times, strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--work", nargs="+", default=["W1", "W1v"], choices=works.NAMES)
    parser.add_argument("--ticks", type=int, default=6000)
    parser.add_argument("--warm", type=int, default=1000, help="ticks at the beginning that do not count")
    parser.add_argument("--resolver", default="active-set")
    parser.add_argument("--block", type=int, default=250, help="ticks in a turn")
    parser.add_argument("--clock", default="wall", choices=CLOCKS, help="cpu: on a machine that others use")
    for peer in PEERS:
        parser.add_argument(f"--{peer}", metavar="PYTHON", help=f"an interpreter that has {peer} installed")
    arguments = parser.parse_args()
    Local.clock = staticmethod(CLOCKS[arguments.clock])
    for name in arguments.work:
        base = None
        for label, microseconds in rows(name, arguments):
            done = microseconds[np.isfinite(microseconds)]
            if not done.size:
                print(f"  {label:24s} no tick after the warm-up")
                continue
            median, tail = np.percentile(done, [50, 99])
            base = base or (median, tail)
            print(
                f"  {label:24s} median {median:7.1f} µs   p99 {tail:7.1f} µs   "
                f"{median / base[0]:5.2f} × our median, {tail / base[1]:5.2f} × our p99"
                + ("" if done.size == microseconds.size else f"   ({done.size} ticks)")
            )


if __name__ == "__main__":
    main()
