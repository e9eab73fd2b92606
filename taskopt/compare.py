"""One scenario, several resolvers, side by side: who tracks, who keeps the limits, who can prove it.

The resolvers take turns tick by tick, each on its own robot: one clock, one load of the machine.
"""

from collections.abc import Iterator, Sequence

from taskopt.errors import Infeasible, NotSolved
from taskopt.loop.run import Step, run
from taskopt.loop.scenario import Scenario
from taskopt.record.batch import Batch
from taskopt.record.run_info import RunInfo
from taskopt.record.summary import Summary
from taskopt.record.violation import LimitGauge
from taskopt.resolver.base import Resolver


class Comparison:
    """Runs a scenario with several resolvers; `summaries` has the figures so far.

    Iterating yields the steps of all, tick by tick. A resolver that finds no answer ends there, with
    the reason in its summary, and the others go on; where it is the only one, its error is raised.
    The reference of path differences is `pinv` if it is among them, else the first.
    """

    def __init__(self, scenario: Scenario, resolvers: Sequence[Resolver]) -> None:
        self.scenario = scenario
        self.resolvers = tuple(resolvers)
        names = [resolver.name for resolver in resolvers]
        self.reference = "pinv" if "pinv" in names else names[0]
        gauge = LimitGauge(RunInfo(scenario, tuple(names)))
        self.summaries = {name: Summary(name, gauge) for name in names}

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
                    self.summaries[name].stopped = str(error)
                    del lanes[name]
            for name, step in steps.items():
                self.summaries[name].add(Batch((step,)))
                if self.reference in steps:
                    self.summaries[name].compare_path(step, steps[self.reference])
            yield from steps.values()
