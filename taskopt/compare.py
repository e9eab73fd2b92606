"""One scenario, several resolvers, side by side: who tracks, who keeps the limits, who can prove it.

The resolvers take turns tick by tick, each on its own robot: one clock, one load of the machine.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.errors import Infeasible, NotSolved
from taskopt.loop.run import Step, run, tracking_error
from taskopt.loop.scenario import Scenario
from taskopt.record.batch import Batch
from taskopt.record.recorder import RunInfo
from taskopt.record.summary import Continuity
from taskopt.record.violation import LimitGauge
from taskopt.resolver.base import Resolver


@dataclass
class Tally:
    """What the steps of one resolver come to; figures are lists with one entry a tick."""

    resolver: str
    gauge: LimitGauge
    tracking: list[float] = field(default_factory=list)  # see `tracking_error`
    position_excess: float = 0.0  # largest, after the step [rad, m]
    velocity_excess: float = 0.0  # largest [rad/s, m/s]
    nearest: dict[str, float] = field(default_factory=dict)  # least distance, by limit [m]
    twin_distances: list[float] = field(default_factory=list)  # where no row binds [rad/s]
    path_difference: float = 0.0  # largest ‖q ⊖ q of the reference‖∞ at the same tick [rad, m]
    certificates: list[float] = field(default_factory=list)
    claimed: int = 0
    certified: int = 0
    judged: int = 0  # ticks that have an active set to be solved again
    accurate: int = 0
    error: float = 0.0  # largest in x, relative, against the active set solved again
    causes: Counter[str] = field(default_factory=Counter)  # ticks by why they are apart from the closed form
    seconds: list[float] = field(default_factory=list)
    bound: Counter[str] = field(default_factory=Counter)  # ticks by name of what is active
    continuity: Continuity = field(init=False)
    stopped: str = ""  # why, if it did not get through

    def __post_init__(self) -> None:
        self.continuity = Continuity(self.gauge.info.plan)

    @property
    def ticks(self) -> int:
        return len(self.seconds)

    def add(self, step: Step) -> None:
        """Take one step in."""
        self.tracking.append(tracking_error(step))
        batch = Batch((step,))
        if self.gauge.keeps_positions:
            over = float(self.gauge.position_violation(batch)[0])
            self.position_excess = max(self.position_excess, over)
        self.velocity_excess = max(self.velocity_excess, float(self.gauge.velocity_violation(batch)[0]))
        for limit, measured in step.distances.items():
            self.nearest[limit] = min(self.nearest.get(limit, np.inf), float(measured.distance.min()))
        if step.nothing_binds:
            self.twin_distances.append(step.closed_form_distance)
        self.continuity.add(step)
        self.certificates.append(step.resolution.certificate.worst)
        self.claimed += step.resolution.claimed
        self.certified += step.resolution.certified()
        self._look_again(step)
        self.seconds.append(step.seconds)
        self.bound.update({str(active) for active in step.resolution.active})

    def _look_again(self, step: Step) -> None:
        review = step.resolution.review
        if review is None:
            return
        if not np.isnan(review.error):
            self.judged += 1
            self.error = max(self.error, review.error)
            self.accurate += step.resolution.accurate
        self.causes.update({cause.kind for cause in review.causes})

    def follow(self, step: Step, reference: Step) -> None:
        """Take in how far this path is from the reference's at the same tick."""
        robot = self.gauge.info.scenario.robot
        apart = np.abs(robot.difference(reference.q_next, step.q_next)).max()
        self.path_difference = max(self.path_difference, float(apart))


class Comparison:
    """Runs a scenario with several resolvers; `tallies` has the figures so far.

    Iterating yields the steps of all, tick by tick. A resolver that finds no answer ends there, with
    the reason in its tally, and the others go on; where it is the only one, its error is raised.
    The reference of path differences is `pinv` if it is among them, else the first.
    """

    def __init__(self, scenario: Scenario, resolvers: Sequence[Resolver]) -> None:
        self.scenario = scenario
        self.resolvers = tuple(resolvers)
        names = [resolver.name for resolver in resolvers]
        self.reference = "pinv" if "pinv" in names else names[0]
        gauge = LimitGauge(RunInfo(scenario, tuple(names)))
        self.tallies = {name: Tally(name, gauge) for name in names}

    def __iter__(self) -> Iterator[Step]:
        lanes = {resolver.name: run(self.scenario, resolver) for resolver in self.resolvers}
        for _ in range(self.scenario.ticks):
            steps = {}
            for name in list(lanes):
                try:
                    steps[name] = next(lanes[name])
                except (NotSolved, Infeasible) as error:
                    if len(self.resolvers) == 1:
                        raise
                    self.tallies[name].stopped = str(error)
                    del lanes[name]
            for name, step in steps.items():
                self.tallies[name].add(step)
                if self.reference in steps:
                    self.tallies[name].follow(step, steps[self.reference])
            yield from steps.values()
