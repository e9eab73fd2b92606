"""The command line, which combines the other modules and computes nothing itself."""

import os
import sys
from collections.abc import Generator, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from taskopt.bench.commands import bench
from taskopt.bench.sweep.commands import sweeping
from taskopt.command_parts import ScenarioFile, names_in, progress_bar
from taskopt.errors import InvalidValue, NotInstalled, TaskoptError
from taskopt.log_commands import logs_read

if TYPE_CHECKING:
    from taskopt.loop.run import Step
    from taskopt.record import RunInfo
    from taskopt.record.log import Log

app = typer.Typer(
    name="taskopt",
    help="Resolve the redundancy of robots by optimisation: run stacks, prove answers, look at them.",
    epilog="An error is reported in one line; add --debug to see the traceback. Linear algebra runs on one "
    "thread, because more threads only add jitter at these sizes; set OPENBLAS_NUM_THREADS to change that.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

app.add_typer(bench, name="bench")
app.add_typer(logs_read)
app.add_typer(sweeping)

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
    """

    changes: "Sequence[str]"
    duration: float | None
    dt: float | None


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
        from taskopt.record.log import open_log
        from taskopt.record.viewer.open import live_viewer

        if not self.record:
            if self.live:
                raise InvalidValue("--live shows what is recorded; leave out --no-record")
            return ()
        return (open_log(info, self.logs, live_viewer() if self.live else None),)


@app.command()
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
    live: Live = False,
    record: Record = True,
    logs: Logs = Path("logs"),
    log: Raw = None,
) -> None:
    """Run a scenario, print a summary and write a recording."""
    _resolve(scenario, [resolver], Variation(changes or [], duration, dt), Output(record, logs, live, log))


@app.command()
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
    _resolve(scenario, resolvers, Variation(changes or [], duration, dt), Output(record, logs, live, log))


@app.command()
def view(
    log: Annotated[
        Path | None,
        typer.Argument(
            metavar="RECORDING",
            help="A recording, or a folder that has some; by default the newest recording.",
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a picture (PNG) instead of opening a window.")
    ] = None,
    at: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", help="Time in the run that the picture shows; by default the middle."
        ),
    ] = None,
    logs: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Folder in which the newest recording is looked for.")
    ] = Path("logs"),
) -> None:
    """Open a recording in the Rerun viewer."""
    from taskopt.record.reading import find_recording
    from taskopt.record.viewer.open import show

    path = find_recording(log or logs)
    if picture is None:
        show(path)
    else:
        from taskopt.record.viewer.picture import take_picture

        take_picture(path, picture, at)
        typer.echo(f"wrote {picture}, a picture of {path}")


@app.command()
def figures(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NUMBER", help="Numbers of figures, such as 3.16; all if none is named."),
    ] = None,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Write fig_3_16.png and so on there.")] = Path(
        "docs/figures"
    ),
) -> None:
    """Draw the figures of the chapter.

    Their arms and runs are ours; Matplotlib draws them, which the extra taskopt[figures] installs.
    """
    try:
        from taskopt.figures.catalogue import render
    except ModuleNotFoundError as error:
        raise NotInstalled("Matplotlib, which draws the figures,", "'taskopt[figures]'") from error
    for path in render(names or (), out):
        typer.echo(f"wrote {path}")


@app.command()
def pose(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="A robot that `taskopt list` shows, or a robot file.")
    ],
    frame: Annotated[str, typer.Option(metavar="FRAME", help="The frame that is to be there.")],
    at: Annotated[
        str,
        typer.Option(
            metavar="X,Y,Z[,QX,QY,QZ,QW]",
            help="Position [m], and a quaternion if the orientation matters, in the world.",
        ),
    ],
) -> None:
    """Find a posture for a pose of one frame, within the joint limits.

    The exit code is 0 if there is one, else 1; the last line says why.
    """
    from taskopt.kinematics.robot import Robot
    from taskopt.loop.pose.solver import solve_pose

    try:
        goal = [float(part) for part in at.split(",")]
    except ValueError as error:
        raise InvalidValue(f"--at must be numbers separated by commas, got '{at}'") from error
    readers = {".xml": Robot.from_mjcf, ".urdf": Robot.from_urdf, ".xacro": Robot.from_urdf}
    found = solve_pose(readers.get(Path(robot).suffix, Robot.load)(robot), {frame: goal})
    typer.echo(" ".join(f"{value:.9g}" for value in found.q))
    typer.echo(f"{found.verdict.name}: {found.reason}")
    raise typer.Exit(0 if found.solved else 1)


@app.command()
def warmup() -> None:
    """Compile everything now, so that no run has to wait.

    For images and robots. Compiled code is kept for later runs of this user. Without this command, each part
    is compiled when it is first needed.
    """
    from taskopt.jit import COMPILED
    from taskopt.loop.warm_up import warm_up

    if not COMPILED:
        typer.echo("NUMBA_DISABLE_JIT=1 is set: nothing is compiled, and everything runs as plain Python")
        return
    warm_up()
    typer.echo("everything is compiled")


@app.command()
def list(
    part: Annotated[
        str, typer.Argument(metavar="PART", help="Show only names that have PART in them, such as panda.")
    ] = "",
) -> None:
    """List robots, solvers, resolvers and scenarios."""
    from taskopt.report import show_inventory, terminal

    show_inventory(terminal(), part)


def _show_version(wanted: bool) -> None:
    """Print the version and end."""
    if wanted:
        typer.echo(f"taskopt {version('taskopt')}")
        raise typer.Exit


@app.callback()
def _options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and end."),
    ] = False,
) -> None:
    """Take the options that stand before a command."""


def main() -> None:
    """Run the command line; report a mistake of the user in one line, with exit code 2."""
    for library in ("OPENBLAS", "OMP", "MKL"):  # read when NumPy is imported, which has not happened yet
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    arguments = [argument for argument in sys.argv[1:] if argument != "--debug"]
    try:
        app(arguments)
    except TaskoptError as error:
        if len(arguments) < len(sys.argv) - 1:
            raise
        where = "".join(f"{note}: " for note in getattr(error, "__notes__", ()))
        typer.echo(f"taskopt: {where}{error}", err=True)
        sys.exit(2)


def _resolve(file: str, names: "Sequence[str]", variation: Variation, output: Output) -> None:
    """Run a scenario with all resolvers, record it, and print the summary."""
    from taskopt.compare import Comparison
    from taskopt.loop.run_log import RunLog
    from taskopt.loop.scenario import load_scenario
    from taskopt.loop.variation import varied
    from taskopt.record import RunInfo, record
    from taskopt.report import show, terminal
    from taskopt.resolver.registry import resolver

    resolvers = [resolver(name) for name in names]
    scenario = varied(load_scenario(file), *variation)
    raw = None if output.log is None else RunLog(scenario, resolvers, output.log, Path(file))
    comparison = Comparison(scenario, resolvers, log=raw)
    logs = output.recorders(RunInfo(scenario, tuple(names), Path(file)))
    try:
        with nullcontext() if raw is None else raw:
            interrupted = _drive(record(comparison, *logs), scenario.ticks * len(resolvers), scenario.name)
            if raw is not None and interrupted:
                raw.close("the user interrupted it")
    finally:  # a run that ends early still has a summary and a recording
        title = f"{scenario.name}: {scenario.ticks} ticks of {1e3 * scenario.dt:g} ms"
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
