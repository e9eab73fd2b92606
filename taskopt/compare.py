"""Comparison of resolvers on one scenario, with their figures of tracking, limits, proofs and times.

The resolvers take turns tick by tick, each with its own robot, so that their times are measured under the
same load of the machine.
"""

from collections.abc import Iterator, Sequence

from taskopt.errors import Infeasible, NotSolved
from taskopt.loop.onward import LogStart
from taskopt.loop.run import JUDGED, Step, run
from taskopt.loop.run_log import RunLog
from taskopt.loop.scenario import Scenario
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.summary import Summary
from taskopt.recording.violation import LimitGauge
from taskopt.resolver.base import Resolver
from taskopt.resolver.registry import as_resolver


class Comparison:
    """Run a scenario with several resolvers, and gather the figures of each.

    Iterating yields the steps of all resolvers, tick by tick. A resolver that has no answer stops at that
    tick, with the reason in its summary, and the others continue. If it is the only resolver, its error is
    raised.

    Args:
        scenario: The scenario to run.
        resolvers: The resolvers, or their names (`taskopt list` shows them).
        judged: Number of ticks whose answers are judged, see `run`.
        log: Log of these resolvers, to which all ticks are added.
        start: Moment of a log of the scenario at which all begin, see `run`.

    Attributes:
        scenario: The scenario.
        resolvers: The resolvers.
        baseline: Name of the resolver with whose path those of the others are compared: `pinv` if it is one
            of them, else the first.
        summaries: Figures so far, by name of the resolver.

    Raises:
        UnknownName: There is no resolver of a given name.
        NotSolved: The only resolver has no answer that may be sent to a robot.
        Infeasible: Hard limits contradict each other, with one resolver and the policy "raise".
    """

    def __init__(
        self,
        scenario: Scenario,
        resolvers: Sequence[str | Resolver],
        judged: int = JUDGED,
        log: RunLog | None = None,
        start: LogStart | None = None,
    ) -> None:
        self.scenario = scenario if start is None else start.of(scenario)
        self._given = judged, log, start
        self.resolvers: tuple[Resolver, ...] = tuple(as_resolver(given) for given in resolvers)
        names = [resolver.name for resolver in self.resolvers]
        self.baseline = "pinv" if "pinv" in names else names[0]
        gauge = LimitGauge(RunInfo(self.scenario, tuple(names)))
        self.summaries = {name: Summary(name, gauge) for name in names}

    def __iter__(self) -> Iterator[Step]:
        """Yield the steps of all resolvers, tick by tick, in the order of the resolvers."""
        runs = {resolver.name: run(self.scenario, resolver, *self._given) for resolver in self.resolvers}
        while runs:
            steps: dict[str, Step] = {}
            for name in list(runs):
                try:
                    steps[name] = next(runs[name])
                except StopIteration:
                    del runs[name]
                except (NotSolved, Infeasible) as error:
                    if len(self.resolvers) == 1:
                        raise
                    self.summaries[name].stopped = str(error)
                    del runs[name]
            for name, step in steps.items():
                self.summaries[name].add(Batch((step,)))
                if self.baseline in steps:
                    self.summaries[name].compare_path(step, steps[self.baseline])
            yield from steps.values()
