"""The facts about a run that are known before its first step."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from taskopt.errors import InvalidValue
from taskopt.kinematics.stack import Plan
from taskopt.loop.scenario import Scenario


@dataclass(frozen=True, eq=False)
class RunInfo:
    """The description of a run for everything that records, summarises or draws it.

    Attributes:
        scenario: The robot, the stack of tasks, the start posture, the duration and the time step.
        resolvers: The names of the resolvers, in the order in which they take their turns.
        source: The Python file that the scenario was loaded from; None if it was made in code.
        seed: The seed of the run's random numbers; None if it uses none.

    Raises:
        InvalidValue: The stack is of order 2, for which recordings, pictures and summaries have no form yet.
    """

    scenario: Scenario
    resolvers: tuple[str, ...]
    source: Path | None = None
    seed: int | None = None

    def __post_init__(self) -> None:
        if self.scenario.stack.order == 2:
            raise InvalidValue(
                "a run of order 2 cannot be recorded, summarised or compared yet; iterate over "
                "taskopt.run(scenario, log=...), or step a taskopt.Controller(..., log=...)"
            )

    @cached_property
    def plan(self) -> Plan:
        """The stack compiled for the robot and filled at the start posture, shared by all readers.

        It has the names, frames and units of all rows. Readers must not fill it again.
        """
        plan = self.new_plan()
        plan.at(self.scenario.start, 0.0)
        return plan

    def new_plan(self) -> Plan:
        """Compile the stack once more, for a reader that fills it at other postures and times.

        Returns:
            A plan that shares no memory with the run or with `plan`.
        """
        return self.scenario.compile()
