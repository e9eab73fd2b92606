"""The command `taskopt sweep`."""

from pathlib import Path
from typing import Annotated

import typer

from taskopt.command_parts import ScenarioFile, names_in, progress_bar

sweeping = typer.Typer(rich_markup_mode=None)

Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="ADDRESS=VALUES",
        help="A parameter with its values: hand.weight=0.1,1,10, or hand.weight=1e-3..1e3:13 for 13 of "
        "them; once for each.",
        show_default=False,
    ),
]
Resolvers = Annotated[
    list[str] | None,
    typer.Option(
        "-r",
        "--resolver",
        metavar="NAME",
        help="Names of resolvers, separated by commas or by repeating -r; by default active-set.",
        show_default=False,
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Scheduler of a Dask cluster, such as tcp://10.0.0.1:8786, instead of processes here.",
        show_default=False,
    ),
]
Duration = Annotated[float | None, typer.Option(metavar="SECONDS", show_default=False, help="Of each run.")]


@sweeping.command()
def sweep(
    scenario: ScenarioFile,
    changes: Changes = None,
    seeds: Annotated[
        int, typer.Option(min=1, metavar="N", help="Starts: the scenario's own, and N − 1 near it.")
    ] = 1,
    resolvers: Resolvers = None,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FOLDER", help="Where to write.")] = Path(
        "sweep"
    ),
    jobs: Annotated[int, typer.Option(min=-1, metavar="N", help="Processes; −1 for one on each core.")] = -1,
    scheduler: Scheduler = None,
    duration: Duration = None,
) -> None:
    """Run a scenario for many values, starts and resolvers.

    Cases that are done already are not computed again. Starts other than the first differ from the scenario's
    by up to 0.1 rad or m in each joint that has limits.
    """
    from taskopt.bench.sweep.grid import Grid, axis
    from taskopt.bench.sweep.report import write_all
    from taskopt.bench.sweep.sweep import Sweep, carry_out

    names = names_in(resolvers or ["active-set"])
    grid = Grid(tuple(map(axis, changes or ())), seeds, tuple(names))
    with progress_bar() as progress:
        task = progress.add_task(scenario)
        for done, total in carry_out(Sweep(scenario, grid, duration), out, jobs, scheduler):
            progress.update(task, completed=done, total=total)
    text, files = write_all(out, grid)
    typer.echo(text)
    for file in files:
        typer.echo(f"wrote {file}")
