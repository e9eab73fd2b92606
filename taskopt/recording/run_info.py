"""The facts about a run that are known before its first step."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from taskopt.kinematics.stack import Plan
from taskopt.kinematics.task import BoundTask
from taskopt.loop.scenario import Scenario


@dataclass(frozen=True, eq=False)
class RunInfo:
    """The description of a run for everything that records, summarises or draws it.

    Attributes:
        scenario: The robot, the stack of tasks, the start posture, the duration and the time step.
        resolvers: The names of the resolvers, in the order in which they take their turns.
        source: The Python file that the scenario was loaded from; None if it was made in code.
        seed: The seed of the run's random numbers; None if it uses none.
    """

    scenario: Scenario
    resolvers: tuple[str, ...]
    source: Path | None = None
    seed: int | None = None

    @cached_property
    def plan(self) -> Plan:
        """The stack compiled for the robot and filled at the start posture, shared by all readers.

        It has the names, frames and units of all rows. Readers must not fill it again.
        """
        plan = self.new_plan()
        plan.at(self.scenario.start, 0.0)
        return plan

    @property
    def accelerates(self) -> bool:
        """True if the stack is of order 2, whose answers are accelerations."""
        return self.plan.layout.is_of_accelerations

    @property
    def declared(self) -> tuple[BoundTask, ...]:
        """The tasks that the stack declares, without the level that it adds at order 2."""
        return self.plan.tasks[: sum(map(len, self.scenario.stack.levels))]

    def new_plan(self) -> Plan:
        """Compile the stack once more, for a reader that fills it at other postures and times.

        Returns:
            A plan that shares no memory with the run or with `plan`.
        """
        return self.scenario.compile()
