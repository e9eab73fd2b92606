"""One run of a sweep, and the figures that are kept of it."""

import time
from dataclasses import replace
from functools import lru_cache

import numpy as np

from taskopt.arrays import Array
from taskopt.bench.sweep.grid import Case
from taskopt.errors import Infeasible, NotSolved
from taskopt.loop.run import run
from taskopt.loop.scenario import Scenario, load_scenario
from taskopt.loop.variation import varied
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.summary import Summary
from taskopt.recording.violation import LimitGauge

Figure = float | int | str

FIGURES = {
    "ticks": "ticks that were run",
    "stopped": "reason why the run ended early; empty if it did not",
    "tracking": "tracking error, root mean square [m]",
    "tracking_max": "tracking error, largest [m]",
    "tracking_last": "tracking error at the last tick [m]",
    "position_excess": "largest excess over a position limit [rad, m]",
    "velocity_excess": "largest excess over a velocity limit [rad/s, m/s]",
    "jump": "largest change of an answer in one tick [rad/s, m/s; at order 2 rad/s², m/s²]",
    "active": "share of the ticks at which a limit is active",
    "claimed": "share of the ticks that are claimed to be optimal",
    "judged": "ticks that were judged",
    "proven": "of these, proven",
    "refuted": "of these, refuted",
    "median": "solve time, median [s]",
    "p99": "solve time, 99th percentile [s]",
    "cpu": "processor time of the whole case [s]",
}
"""The figures of a case, with their meaning. The last three differ from one computation to the next."""

TIMES = ("median", "p99", "cpu")


def run_case(
    file: str, case: Case, duration: float | None, dt: float | None, spread: float, judged: int
) -> dict[str, Figure]:
    """Run a case from its file; this is what a worker does.

    Args:
        file: The scenario file, which is executed, or "demo".
        case: The case.
        duration: Length of the run [s]; None for the scenario's own.
        dt: Time between ticks [s]; None for the scenario's own.
        spread: Largest distance of a joint from the start of the scenario, for seeds other than 0 [rad, m].
        judged: Number of ticks that are judged.

    Returns:
        The figures by name, see `FIGURES`.

    Raises:
        UnknownName: There is no parameter or resolver of a name.
        InvalidValue: A parameter does not take a value.
    """
    begun = time.process_time()
    scenario = varied(_loaded(file), case.settings, duration, dt)
    scenario = replace(scenario, q0=start(scenario, case.seed, spread))
    summary = Summary(case.resolver, LimitGauge(RunInfo(scenario, (case.resolver,))))
    try:
        for step in run(scenario, case.resolver, judged):
            summary.add(Batch((step,)))
    except (NotSolved, Infeasible) as error:
        summary.stopped = str(error)
    return _figures(summary) | {"cpu": time.process_time() - begun}


def start(scenario: Scenario, seed: int, spread: float) -> Array:
    """Draw a start near that of the scenario, inside its position limits.

    Args:
        scenario: The scenario.
        seed: 0 for its own start.
        spread: Largest distance of each joint that has a position limit [rad, m].

    Returns:
        The start, (nq,).
    """
    q = scenario.start.copy()
    if seed == 0:
        return q
    robot = scenario.robot
    moved = np.random.default_rng(seed).uniform(-spread, spread, robot.nv)
    limited = robot.position_index >= 0
    place = robot.position_index[limited]
    q[place] = np.clip(
        q[place] + moved[limited], robot.position_lower[limited], robot.position_upper[limited]
    )
    return q


@lru_cache(maxsize=4)
def _loaded(file: str) -> Scenario:
    """Load a scenario once in each process."""
    return load_scenario(file)


def _figures(summary: Summary) -> dict[str, Figure]:
    """Return the figures of a summary; NaN where no tick was run."""
    tracking, seconds, ticks = np.array(summary.tracking), np.array(summary.seconds), summary.ticks
    judged = summary.judged
    if not ticks:
        nothing: dict[str, Figure] = dict.fromkeys(FIGURES, np.nan)
        return nothing | {"ticks": 0, "stopped": summary.stopped, "judged": 0, "proven": 0, "refuted": 0}
    return {
        "ticks": ticks,
        "stopped": summary.stopped,
        "tracking": float(np.sqrt(np.mean(tracking**2))),
        "tracking_max": float(tracking.max()),
        "tracking_last": float(tracking[-1]),
        "position_excess": summary.position_violation,
        "velocity_excess": max(summary.velocity_violation, 0.0),
        "jump": summary.continuity.jump,
        "active": summary.ticks_active / ticks,
        "claimed": summary.claimed / ticks,
        "judged": judged.ticks,
        "proven": judged.proven,
        "refuted": judged.refuted,
        "median": float(np.median(seconds)),
        "p99": float(np.percentile(seconds, 99)),
    }
