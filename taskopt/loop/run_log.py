"""The raw log of a run: one file with the ticks of all its resolvers, and the text of its scenario."""

from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType

from taskopt.arrays import Array
from taskopt.hierarchy.resolution import Resolution
from taskopt.log.of_plan import description_of
from taskopt.log.provenance import Json, commit_of, plain, source_of
from taskopt.log.raw import RawLog
from taskopt.log.ring import End
from taskopt.loop.logged import LoggedLoop
from taskopt.loop.loop import Loop
from taskopt.loop.onward import LogStart
from taskopt.loop.scenario import Scenario
from taskopt.resolver.base import Resolver


class RunLog:
    """Log the ticks of a run; as a context it is closed at the end, with the error that ended it.

    Args:
        scenario: The scenario.
        resolvers: All resolvers of the run.
        path: The file; one that exists is replaced.
        source: The file of the scenario, whose text is kept and never executed; None if it was made in code.
        start: Moment of another log at which the run begins; None for the start of the scenario.

    Attributes:
        path: The file.

    Raises:
        InvalidValue: The file cannot be written.
    """

    def __init__(
        self,
        scenario: Scenario,
        resolvers: Sequence[Resolver],
        path: str | Path,
        source: Path | None = None,
        start: LogStart | None = None,
    ) -> None:
        loops = [Loop(scenario.compile(), r, scenario.on_conflict, timed=True) for r in resolvers]
        damped = next((loop.rest.layout for loop in loops if loop.rest is not None), None)
        facts: dict[str, Json] = {
            "scenario": scenario_facts(scenario, source),
            "start": scenario.start.tolist(),
            "on_conflict": scenario.on_conflict,
            "git_commit": commit_of(source),
        }
        if start is not None:
            facts["from"] = start.facts
        self._description = description_of(loops[0].plan, resolvers, damped, facts)
        self._numbers = {resolver.name: number for number, resolver in enumerate(resolvers)}
        self._log = RawLog(path, self._description)
        self.path = self._log.path

    def tick(self, loop: Loop, first: int = 0) -> Callable[[Array, float], Resolution]:
        """Return the tick of a loop that is logged, see `LoggedLoop.tick`.

        Args:
            loop: A loop of the scenario with one of the resolvers.
            first: Number of its first tick.

        Returns:
            The function, of posture and time.
        """
        number = self._numbers[loop.resolver.name]
        return LoggedLoop(loop, self._log, self._description, number, first).tick

    def close(self, why: str = "") -> None:
        """Wait until everything is in the file, and close it; closing twice does nothing.

        Args:
            why: What interrupted the run; "" if nothing did.

        Raises:
            LogFailed: Not everything could be written.
        """
        self._log.close(End.INTERRUPTED if why else End.FINISHED, why)

    def __enter__(self) -> "RunLog":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self.close("" if kind is None else str(error) or kind.__name__)


def scenario_facts(scenario: Scenario, source: Path | None) -> dict[str, Json]:
    """List what a reader needs to know about a scenario.

    Args:
        scenario: The scenario.
        source: Its file; None if it was made in code.

    Returns:
        Plain data for JSON, with the text of the file.
    """
    return {
        "name": scenario.name,
        "description": scenario.description,
        "duration_s": scenario.duration,
        "dt_s": scenario.dt,
        "settings": {name: plain(value) for name, value in scenario.settings.items()},
        **source_of(source),
    }
