"""Record the problems of a run as a problem set."""

from itertools import islice

from taskopt.arrays import positive
from taskopt.bench.comparison.problem_set import ProblemSequence
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy
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
