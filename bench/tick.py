"""What one tick costs: this library through `Controller`, and its peers, in one run.

    python bench/tick.py                     # W1 and W1v, beside pink if it is installed
    python bench/tick.py --work W1s W2 W2s   # strict levels; TALOS
    python bench/tick.py --placo PYTHON      # PlaCo too, from an environment that has it

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
import json
import subprocess
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter_ns

import numpy as np
import works

from taskopt import Controller
from taskopt.arrays import Array

Tick = Callable[[int], Array]


class Ours:
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


class Pink:
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
        if work.name.startswith("W2"):
            self.tasks += [FrameTask(foot, 10.0, 10.0) for foot in ("left_sole_link", "right_sole_link")]
            self.tasks += [ComTask(cost=1.0)]
        self.tasks += [PostureTask(cost=1e-2 if work.name.startswith("W2") else 1e-3)]
        for task in self.tasks:
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
        )

    def tick(self, i: int) -> None:
        self.hand.set_target(self.poses[i])
        self.configuration.integrate_inplace(self.velocity(), works.DT)

    def velocity_at(self, q: Array, i: int) -> Array:
        """Its answer at somebody else's posture; not timed."""
        self.configuration.update(q)
        self.hand.set_target(self.poses[i])
        return self.velocity()


def interleave(contestants: list[Ours | Pink], ticks: int, block: int) -> dict[str, Array]:
    """Microseconds of each tick, (ticks,) by name; blocks take turns."""
    times = {contestant.name: np.empty(ticks) for contestant in contestants}
    gc.collect()
    gc.disable()
    for first in range(0, ticks, block):
        for contestant in contestants:
            for i in range(first, min(first + block, ticks)):
                begin = perf_counter_ns()
                contestant.tick(i)
                times[contestant.name][i] = (perf_counter_ns() - begin) * 1e-3
    gc.enable()
    return times


def examine(work: works.Work, resolver: str, ticks: int) -> str:
    """What the times do not show: how often a limit binds, the certificate, the distance to pink."""
    ours = Ours(work, resolver)
    pink = Pink(work) if find_spec("pink") and not work.name.endswith("s") else None
    bound, worst, apart = 0, 0.0, 0.0
    for i in range(ticks):
        q = ours.q
        ours.tick(i)
        bound += bool(ours.last.active)
        worst = max(worst, ours.last.certificate.worst)
        if pink:
            apart = max(apart, float(np.abs(ours.last.v - pink.velocity_at(q, i)).max()))
    beside = f"; largest deviation from pink {apart:.1e} rad/s" if pink else ""
    share = f"a limit is active on {100 * bound / ticks:.0f} % of the ticks"
    return f"{share}; worst certificate {worst:.1e}{beside}"


def placo(python: str, name: str, ticks: int, warm: int) -> Array:
    """Microseconds of PlaCo's ticks, from its own interpreter (it needs another Pinocchio)."""
    script = Path(__file__).with_name("placo_tick.py")
    command = [python, str(script), name, str(ticks), str(warm)]
    return np.array(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))


def rows(name: str, arguments: argparse.Namespace) -> Iterator[tuple[str, Array]]:
    """Name and times of each contestant, warm-up taken off."""
    work = works.work(name, arguments.ticks)
    contestants: list[Ours | Pink] = [Ours(work, arguments.resolver)]
    if find_spec("pink"):
        contestants += [Pink(work, solver) for solver in ("quadprog", "daqp")]
    times = interleave(contestants, arguments.ticks, 1000)
    print(f"\n{name}: {examine(work, arguments.resolver, arguments.ticks)}")
    yield from ((key, value[arguments.warm :]) for key, value in times.items())
    if arguments.placo:
        yield "PlaCo eiquadprog", placo(arguments.placo, name, arguments.ticks, arguments.warm)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--work", nargs="+", default=["W1", "W1v"], choices=works.NAMES)
    parser.add_argument("--ticks", type=int, default=6000)
    parser.add_argument("--warm", type=int, default=1000, help="ticks at the beginning that do not count")
    parser.add_argument("--resolver", default="active-set")
    parser.add_argument("--placo", metavar="PYTHON", help="an interpreter that has placo installed")
    arguments = parser.parse_args()
    for name in arguments.work:
        base = None
        for label, microseconds in rows(name, arguments):
            median, tail = np.percentile(microseconds, [50, 99])
            base = base or (median, tail)
            print(
                f"  {label:24s} median {median:7.1f} µs   p99 {tail:7.1f} µs   "
                f"{median / base[0]:5.2f} × our median, {tail / base[1]:5.2f} × our p99"
            )


if __name__ == "__main__":
    main()
