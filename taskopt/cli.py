"""The command line, which combines the other modules and computes nothing itself."""

import os
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer

from taskopt.bench.commands import bench
from taskopt.bench.sweep.commands import sweeping
from taskopt.errors import InvalidValue, NotInstalled, TaskoptError
from taskopt.log_commands import logs_read
from taskopt.run_commands import scenarios_run
from taskopt.view_command import viewing

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

app.add_typer(scenarios_run)
app.add_typer(bench, name="bench")
app.add_typer(logs_read)
app.add_typer(sweeping)
app.add_typer(viewing)


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
