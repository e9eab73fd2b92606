"""What logging costs the control thread, by the CPU clock of the thread.

    python benchmarks/log_cost.py                     # Panda and TIAGo dual, 60 s each
    python benchmarks/log_cost.py --seconds 10 --scenarios panda_circle --log /dev/shm/cost.arrow

A loop of 1 kHz, which sleeps between ticks, with the stacks of two scenarios. What recording adds to a tick
is timed by the CPU clock of the thread, of which two readings are included; the row "measure itself" has what
the same readings say of a loop without a log. The whole step is timed by the wall clock, beside that loop.
Printed are median, 99th and 99.9th percentile, mean and maximum, the size of the file per second, and the
load of the machine.
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported: sizes like these gain nothing from threads

import argparse
import gc
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, perf_counter_ns, sleep, thread_time_ns
from typing import Any

import numpy as np

from taskopt import Controller, Resolution, load_scenario, open_log
from taskopt.arrays import Array

DT = 1e-3  # [s]
TASKS = Path(__file__).parents[1] / "tasks"


def loop_of(name: str, log: Path | None) -> tuple[Controller, Array]:
    """Return the controller of a scenario, and its start."""
    scenario = load_scenario(TASKS / f"{name}.py")
    return Controller(scenario.robot, scenario.stack, dt=DT, log=log), scenario.start


def timed(control: Controller) -> list[int]:
    """Make a controller note the CPU time of recording [ns]: that of its logged tick without the tick.

    Without a log that is what the measure itself costs.
    """
    costs: list[int] = []
    owner: Any = control._tick.__self__  # type: ignore[attr-defined]
    loop: Any = getattr(owner, "_loop", owner)
    resolve, within = loop.tick, [0]

    def resolved(q: Array, t: float) -> Resolution:
        begin = thread_time_ns()
        resolution = resolve(q, t)
        within[0] = thread_time_ns() - begin
        return resolution

    record = resolved if loop is owner else control._tick

    def recorded(q: Array, t: float) -> Resolution:
        begin = thread_time_ns()
        resolution = record(q, t)
        costs.append(thread_time_ns() - begin - within[0])
        return resolution

    control._tick = recorded
    if loop is not owner:
        loop.tick = resolved
    return costs


def ticks_of(control: Controller, q: Array, seconds: float) -> Array:
    """Run a loop of 1 kHz, and return the wall-clock time of each step [µs]."""
    control.start(q)
    times = np.zeros(round(seconds / DT))
    due = perf_counter()
    for k in range(times.size):
        begin = perf_counter_ns()
        v = control.step(q, k * DT).v
        times[k] = 1e-3 * (perf_counter_ns() - begin)
        q = control.plan.robot.integrate(q, v, DT)
        due += DT
        if (left := due - perf_counter()) > 0.0:
            sleep(left)
    return times


def row(name: str, values: Array) -> str:
    """Return a line of the table [µs]."""
    median, p99, p999 = np.percentile(values, [50, 99, 99.9])
    return f"{name:28} {median:8.1f} {p99:8.1f} {p999:8.1f} {values.mean():8.1f} {values.max():10.1f}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--scenarios", nargs="*", default=["panda_circle", "tiago_four_levels"])
    parser.add_argument("--log", type=Path)
    asked = parser.parse_args()
    with TemporaryDirectory() as folder:
        path = asked.log or Path(folder) / "cost.arrow"
        for name in asked.scenarios:
            print(
                f"{name}, {asked.seconds:g} s at 1 kHz; load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores"
            )
            print(f"{'µs':28} {'median':>8} {'p99':>8} {'p99.9':>8} {'mean':>8} {'max':>10}")
            control, start = loop_of(name, path)
            costs = timed(control)
            gc.disable()
            with_log = ticks_of(control, start, asked.seconds)
            assert control.log is not None
            control.log.close()
            control, start = loop_of(name, None)
            itself = timed(control)
            without = ticks_of(control, start, asked.seconds)
            gc.enable()
            print(row("record call, thread CPU", 1e-3 * np.array(costs)))
            print(row("measure itself, thread CPU", 1e-3 * np.array(itself)))
            print(row("step with log, wall clock", with_log))
            print(row("step without, wall clock", without))
            size, end = path.stat().st_size, open_log(path).end
            print(f"{1e-6 * size / asked.seconds:.2f} MB per second of run; waited {end.waits} times\n")


if __name__ == "__main__":
    main()
