"""The commands that run scenarios, which combine other modules and compute nothing themselves."""

from collections.abc import Generator, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from taskopt.command_parts import ScenarioFile, names_in, progress_bar
from taskopt.errors import InvalidValue

if TYPE_CHECKING:
    from taskopt.loop.onward import LogStart
    from taskopt.loop.run import Step
    from taskopt.loop.scenario import Scenario
    from taskopt.recording import RunInfo
    from taskopt.recording.log import Log

scenarios_run = typer.Typer()

Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="ADDRESS=VALUE",
        help="Set a parameter of a task or a limit, such as hand.weight=0.1; once for each.",
        show_default=False,
    ),
]
Period = Annotated[
    float | None,
    typer.Option(
        "--dt",
        metavar="SECONDS",
        help="Time between ticks, instead of the scenario's own.",
        show_default=False,
    ),
]
Duration = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS", help="Length of the run, instead of the scenario's own.", show_default=False
    ),
]
Beginning = Annotated[
    str | None,
    typer.Option(
        "--from",
        metavar="LOG@SECONDS",
        help="Begin at a moment of a log of this scenario, and apply --set there: what would have happened.",
        show_default=False,
    ),
]
Live = Annotated[
    bool,
    typer.Option(
        "--live", help="Show the run in a Rerun viewer while it goes on; a viewer is opened if none is open."
    ),
]
Record = Annotated[bool, typer.Option(help="Write a recording, a table of all ticks and a manifest.")]
Raw = Annotated[
    Path | None,
    typer.Option(
        "--log", metavar="FILE", help="Log all ticks to FILE.arrow, see taskopt show.", show_default=False
    ),
]
Logs = Annotated[Path, typer.Option(metavar="FOLDER", help="Write to FOLDER/<scenario>/<time>/.")]


class Variation(NamedTuple):
    """What a run does otherwise than its scenario, see `taskopt.loop.variation.varied`.

    Attributes:
        changes: Texts such as "hand.weight=0.1".
        duration: Length of the run [s]; None: the scenario's own.
        dt: Time between ticks [s]; None: the scenario's own.
        beginning: Text such as "run.arrow@3.2"; None: the start of the scenario.
    """

    changes: "Sequence[str]"
    duration: float | None
    dt: float | None
    beginning: str | None

    def of(self, scenario: "Scenario") -> "tuple[Scenario, LogStart | None]":
        """Vary a scenario.

        Args:
            scenario: The scenario.

        Returns:
            The scenario that is run, and the moment of a log at which it begins.

        Raises:
            InvalidValue: `beginning` has another form, or is given together with a period.
        """
        from taskopt.loop.onward import LogStart
        from taskopt.loop.variation import setting, varied

        if self.beginning is None:
            return varied(scenario, self.changes, self.duration, self.dt), None
        if self.dt is not None:
            raise InvalidValue("--from goes on with the period of the log; leave out --dt")
        log, _, seconds = self.beginning.rpartition("@")
        try:
            t = float(seconds)
        except ValueError as error:
            text = f"--from must have the form LOG@SECONDS, such as run.arrow@3.2, got '{self.beginning}'"
            raise InvalidValue(text) from error
        start = LogStart(log, t, dict(map(setting, self.changes)))
        return start.of(varied(scenario, (), self.duration)), start


@dataclass(frozen=True)
class Output:
    """The options on recording a run.

    Attributes:
        record: True to write a recording.
        logs: Folder of all recordings.
        live: True to show the run in a viewer as well.
        log: File of the raw log; None for none.
    """

    record: bool
    logs: Path
    live: bool
    log: Path | None

    def recorders(self, info: "RunInfo") -> "tuple[Log, ...]":
        """Open the log of a run, if it is recorded.

        Args:
            info: The run.

        Returns:
            One log, or none if nothing is recorded.

        Raises:
            InvalidValue: The run is to be shown but not recorded, or the folder cannot be written.
        """
        from taskopt.recording.log import open_log
        from taskopt.recording.viewer.open import live_viewer

        if not self.record:
            if self.live:
                raise InvalidValue("--live shows what is recorded; leave out --no-record")
            return ()
        return (open_log(info, self.logs, live_viewer() if self.live else None),)


@scenarios_run.command()
def run(
    scenario: ScenarioFile,
    resolver: Annotated[
        str,
        typer.Option(
            "-r", "--resolver", metavar="NAME", help="Name of the resolver; `taskopt list` shows them."
        ),
    ] = "active-set",
    changes: Changes = None,
    duration: Duration = None,
    dt: Period = None,
    beginning: Beginning = None,
    live: Live = False,
    record: Record = True,
    logs: Logs = Path("logs"),
    log: Raw = None,
) -> None:
    """Run a scenario, print a summary and write a recording."""
    variation = Variation(changes or [], duration, dt, beginning)
    _resolve(scenario, [resolver], variation, Output(record, logs, live, log))


@scenarios_run.command()
def compare(
    scenario: ScenarioFile,
    resolvers: Annotated[
        list[str],
        typer.Option(
            "-r",
            "--resolver",
            metavar="NAME",
            help="Names of resolvers, separated by commas or by repeating -r; `taskopt list` shows them.",
        ),
    ],
    changes: Changes = None,
    duration: Duration = None,
    dt: Period = None,
    beginning: Beginning = None,
    live: Live = False,
    record: Record = True,
    logs: Logs = Path("logs"),
    log: Raw = None,
) -> None:
    """Run a scenario with several resolvers side by side.

    \f
    Raises:
        InvalidValue: A resolver is named twice.
    """
    resolvers = names_in(resolvers)
    twice = sorted({name for name in resolvers if resolvers.count(name) > 1})
    if twice:
        raise InvalidValue(f"name each resolver once; named twice: {', '.join(twice)}")
    variation = Variation(changes or [], duration, dt, beginning)
    _resolve(scenario, resolvers, variation, Output(record, logs, live, log))


def _resolve(file: str, names: "Sequence[str]", variation: Variation, output: Output) -> None:
    """Run a scenario with all resolvers, record it, and print the summary."""
    from taskopt.compare import Comparison
    from taskopt.loop.run_log import RunLog
    from taskopt.loop.scenario import load_scenario
    from taskopt.recording import RunInfo, record
    from taskopt.report import show, terminal
    from taskopt.resolver.registry import resolver

    resolvers = [resolver(name) for name in names]
    scenario, start = variation.of(load_scenario(file))
    ticks = scenario.ticks - (0 if start is None else start.index)
    raw = None if output.log is None else RunLog(scenario, resolvers, output.log, Path(file), start)
    comparison = Comparison(scenario, resolvers, log=raw, start=start)
    logs = output.recorders(RunInfo(scenario, tuple(names), Path(file)))
    try:
        with nullcontext() if raw is None else raw:
            interrupted = _drive(record(comparison, *logs), ticks * len(resolvers), scenario.name)
            if raw is not None and interrupted:
                raw.close("the user interrupted it")
    finally:  # a run that ends early still has a summary and a recording
        title = f"{scenario.name}: {ticks} ticks of {1e3 * scenario.dt:g} ms"
        show(comparison.summaries.values(), terminal(), comparison.baseline, title)
        for log in logs:
            typer.echo(f"recorded in {log.folder}; look at it with: taskopt view {log.folder}")
        if raw is not None:
            typer.echo(f"logged in {raw.path}; read it with: taskopt show {raw.path}")
    if interrupted:
        raise typer.Exit(130)


def _drive(steps: "Generator[Step, None, None]", total: int, name: str) -> bool:
    """Run through all steps behind a progress bar; return True if the user interrupted it."""
    with progress_bar() as progress:
        task = progress.add_task(name, total=total)
        try:
            for done, _ in enumerate(steps, start=1):
                if done % 100 == 0:
                    progress.update(task, completed=done)
        except KeyboardInterrupt as stop:
            with suppress(KeyboardInterrupt):
                steps.throw(stop)  # so that recorders learn of it
            return True
    return False
