"""The command line: run, compare, view, list. The only place where everything is wired together."""

import os
import sys
from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskopt.errors import InvalidValue, TaskoptError

if TYPE_CHECKING:
    from taskopt.loop.run import Step
    from taskopt.record import RunInfo
    from taskopt.record.log import Log

app = typer.Typer(
    name="taskopt",
    help="Redundancy resolution by optimisation: resolve a task stack, certify it, look at it.",
    epilog="Errors are one line; --debug, anywhere on the line, shows the traceback. Linear algebra runs on "
    "one thread, since more only add jitter at these sizes; OPENBLAS_NUM_THREADS and its like are respected.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

bench = typer.Typer(help="Measure, on this machine.", no_args_is_help=True, rich_markup_mode=None)
app.add_typer(bench, name="bench")

ScenarioFile = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="Python file with a `scenario`; it is executed.")
]
Duration = Annotated[
    float | None, typer.Option(metavar="SECONDS", help="Instead of the scenario's own.", show_default=False)
]
Live = Annotated[
    bool, typer.Option("--live", help="Also stream to a Rerun viewer here; one is opened if none runs.")
]
Record = Annotated[bool, typer.Option(help="Write recording, table and manifest.")]
Logs = Annotated[Path, typer.Option(metavar="FOLDER", help="Where recordings go: FOLDER/<scenario>/<time>/.")]


@dataclass(frozen=True)
class Output:
    """Where a run goes, as the options have it."""

    record: bool
    logs: Path
    live: bool

    def recorders(self, info: "RunInfo") -> "tuple[Log, ...]":
        """The log of a run, or nothing."""
        from taskopt.record.log import open_log
        from taskopt.record.viewer.open import live_viewer

        if not self.record:
            if self.live:
                raise InvalidValue("--live streams what is recorded; leave --no-record out")
            return ()
        return (open_log(info, self.logs, live_viewer() if self.live else None),)


@app.command()
def run(
    scenario: ScenarioFile,
    resolver: Annotated[str, typer.Option("-r", "--resolver", help="See `taskopt list`.")] = "active-set",
    duration: Duration = None,
    live: Live = False,
    record: Record = True,
    logs: Logs = Path("logs"),
) -> None:
    """Run a scenario: a summary and a recording."""
    _resolve(scenario, [resolver], duration, Output(record, logs, live))


@app.command()
def compare(
    scenario: ScenarioFile,
    resolvers: Annotated[
        list[str], typer.Option("-r", "--resolver", help="Repeat it: one a resolver. See `taskopt list`.")
    ],
    duration: Duration = None,
    live: Live = False,
    record: Record = True,
    logs: Logs = Path("logs"),
) -> None:
    """Run several resolvers side by side."""
    twice = sorted({name for name in resolvers if resolvers.count(name) > 1})
    if twice:
        raise InvalidValue(f"each resolver is to be named once, got twice: {', '.join(twice)}")
    _resolve(scenario, resolvers, duration, Output(record, logs, live))


@app.command()
def view(
    log: Annotated[
        Path | None, typer.Argument(help="Recording, or a folder of recordings; default: the newest.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a PNG instead of opening a window.")
    ] = None,
    at: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="Time of the picture; default: the middle.")
    ] = None,
    logs: Logs = Path("logs"),
) -> None:
    """Open a recording in Rerun, on a finished layout."""
    from taskopt.record.reading import find_recording
    from taskopt.record.viewer.open import show

    path = find_recording(log or logs)
    if picture is None:
        show(path)
    else:
        from taskopt.record.viewer.picture import take_picture

        take_picture(path, picture, at)
        typer.echo(f"{picture} shows {path}")


@bench.command()
def accuracy(
    solvers: Annotated[
        list[str] | None, typer.Option("-s", "--solver", help="Repeat it; default: all installed.")
    ] = None,
    family: Annotated[str, typer.Option(help="hqp or wqp: how the solvers are asked.")] = "hqp",
    trials: Annotated[int, typer.Option(min=1, help="Problems a cell.")] = 20,
) -> None:
    """How right q̇ is near a singularity.

    σ_min × damping × solver, with bounds that bind and without.
    """
    from rich.console import Console
    from rich.progress import track

    from taskopt.bench.accuracy import CELLS, ROOMS, installed, measure, table, verdict
    from taskopt.report import terminal

    names, console, behind = solvers or installed(), terminal(), Console(stderr=True)
    for room in ROOMS:
        cells = measure(names, family, trials, room)
        total, hidden = CELLS * len(names), not behind.is_terminal
        kept = [*track(cells, family, total, console=behind, transient=True, disable=hidden)]
        console.print(table(kept, family, room))
        console.print(verdict(kept), highlight=False, markup=False)


@bench.command()
def fuzz(
    ticks: Annotated[int, typer.Option(min=1, help="Ticks in all, on four robots.")] = 100_000,
    resolver: Annotated[str, typer.Option("-r", "--resolver", help="See `taskopt list`.")] = "active-set",
    seed: Annotated[int, typer.Option(help="Another seed, other stacks.")] = 0,
    keep: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Save what fails, to be resolved again.")
    ] = None,
) -> None:
    """Random stacks: every answer proven, or reported."""
    from rich.console import Console
    from rich.progress import track

    from taskopt.bench.fuzz import FRAMES, table
    from taskopt.bench.fuzz import fuzz as ticks_of
    from taskopt.report import terminal

    behind, each = Console(stderr=True), max(ticks // len(FRAMES), 1)
    tallies = []
    for name in FRAMES:
        hidden = not behind.is_terminal
        ticking = ticks_of(name, each, seed, resolver, keep)
        steps = track(ticking, name, each, console=behind, transient=True, disable=hidden)
        tallies += [*steps][-1:]
    terminal().print(table(tallies))
    if not all(tally.clean for tally in tallies):
        raise typer.Exit(1)


@bench.command()
def strictness(cases: Annotated[int, typer.Option(min=1, help="Cases that count.")] = 1000) -> None:
    """Strict levels beside weights and a projected cost."""
    from taskopt.bench.strictness import measure, table
    from taskopt.report import terminal

    *_, ways = measure(cases)
    terminal().print(table(ways))


@app.command()
def list() -> None:
    """List robots, solvers, resolvers, scenarios."""
    from taskopt.report import show_inventory, terminal

    show_inventory(terminal())


def main() -> None:
    """Entry point: one clear line and exit code 2 for what a user can do wrong."""
    for library in ("OPENBLAS", "OMP", "MKL"):  # read when NumPy is imported, which has not happened yet
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    arguments = [argument for argument in sys.argv[1:] if argument != "--debug"]
    try:
        app(arguments)
    except TaskoptError as error:
        if len(arguments) < len(sys.argv) - 1:
            raise
        typer.echo(f"taskopt: {error}", err=True)
        sys.exit(2)


def _resolve(file: str, names: "Sequence[str]", duration: float | None, output: Output) -> None:
    from taskopt.compare import Comparison
    from taskopt.loop.scenario import load_scenario
    from taskopt.record import RunInfo, record
    from taskopt.report import show, terminal
    from taskopt.resolver.registry import resolver

    resolvers = [resolver(name) for name in names]
    scenario = load_scenario(file)
    if duration is not None:
        scenario = replace(scenario, duration=duration)
    comparison = Comparison(scenario, resolvers)
    logs = output.recorders(RunInfo(scenario, tuple(names), Path(file)))
    try:
        interrupted = _drive(record(comparison, *logs), scenario.ticks * len(resolvers), scenario.name)
    finally:  # also where a run ends early: what there is can be looked at
        title = f"{scenario.name}: {scenario.ticks} ticks of {1e3 * scenario.dt:g} ms"
        show(comparison.summaries.values(), terminal(), comparison.reference, title)
        for log in logs:
            typer.echo(f"recording: {log.folder}; open it with: taskopt view {log.folder}")
    if interrupted:
        raise typer.Exit(130)


def _drive(steps: "Generator[Step, None, None]", total: int, name: str) -> bool:
    """Go through all steps behind a progress bar; say whether the user broke it off."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
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
