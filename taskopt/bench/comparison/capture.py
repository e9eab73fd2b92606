"""Record the problems of a run, or of the log of a run, as a problem set."""

from itertools import islice
from pathlib import Path

from taskopt.arrays import positive
from taskopt.bench.comparison.problem_set import ProblemSequence
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy
from taskopt.log.reading import open_log
from taskopt.loop.run import run
from taskopt.loop.scenario import Scenario


def capture(
    scenario: Scenario, resolver: str = "active-set", *, first: int = 0, ticks: int = 50
) -> ProblemSequence:
    """Run a scenario, and keep the problems of some consecutive ticks.

    The resolver decides where the robot goes, and so which problems follow; the problems themselves are those
    that the stack declares, contradicting limits included.

    Args:
        scenario: The scenario.
        resolver: Name of the resolver that moves the robot.
        first: Number of the first tick that is kept, from 0.
        ticks: Number of ticks that are kept.

    Returns:
        A sequence under the name of the scenario.

    Raises:
        InvalidValue: The run has no such ticks.
        NotSolved: The answer of a tick may not be sent to a robot.
        Infeasible: Hard limits contradict each other, and `scenario.on_conflict` is "raise".
    """
    positive("ticks", ticks)
    if first < 0 or first + ticks > scenario.ticks:
        raise InvalidValue(
            f"ticks {first} to {first + ticks - 1} are not in {scenario.name}, which has "
            f"{scenario.ticks} ticks"
        )
    steps = islice(run(scenario, resolver, judged=0), first, first + ticks)
    problems = [step.hierarchy for step in steps]
    base = problems[0]  # one layout and norm for all of them
    views = (Hierarchy.view(base.layout, problem.buffer, base.norm) for problem in problems)
    return ProblemSequence(f"{scenario.name}, ticks {first} to {first + ticks - 1}", tuple(views))


def capture_log(
    path: str | Path, resolver: str | None = None, *, first: int = 0, ticks: int = 50
) -> ProblemSequence:
    """Keep the problems of some consecutive ticks of a log, as the stack declared them, to the last bit.

    Args:
        path: File that `Controller(..., log=path)` wrote.
        resolver: Name of the resolver whose ticks are kept; None if the log has one only.
        first: Number of the first tick that is kept, from 0.
        ticks: Number of ticks that are kept.

    Returns:
        A sequence under the name of the file.

    Raises:
        MissingFile: There is no such file.
        InvalidValue: It is no log, has several resolvers and none is named, or has no such ticks.
    """
    positive("ticks", ticks)
    log = open_log(path)
    if resolver is None and len(log.resolvers) != 1:
        raise InvalidValue(
            f"{path} has ticks of {', '.join(log.resolvers)}; name one of them as the resolver"
        )
    rows = log.rows(resolver or log.resolvers[0])
    if first < 0 or first + ticks > len(rows):
        raise InvalidValue(
            f"ticks {first} to {first + ticks - 1} are not in {path}, which has {len(rows)} ticks of that "
            "resolver; take others by first and ticks"
        )
    problems = tuple(log.tick(int(row)).hierarchy for row in rows[first : first + ticks])
    return ProblemSequence(f"{Path(path).stem}, ticks {first} to {first + ticks - 1}", problems)
