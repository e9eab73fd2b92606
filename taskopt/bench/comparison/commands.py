"""The commands `taskopt bench run`, `report`, `diff`, `sets`, `capture` and `export`."""

from pathlib import Path
from typing import Annotated

import typer

from taskopt.command_parts import names_in, progress_bar

comparison = typer.Typer(rich_markup_mode=None)

Results = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder that `taskopt bench run` wrote to.")]


Out = Annotated[
    Path,
    typer.Option("-o", "--out", metavar="FOLDER", help="Folder of the rows; what is done there is kept."),
]
Sets = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME",
        help="A set, or a file of one, once for each; by default the standard ones.",
        show_default=False,
    ),
]
Resolvers = Annotated[
    list[str] | None,
    typer.Option(
        "-r",
        "--resolver",
        metavar="NAME",
        help="Names of resolvers, separated by commas or by repeating -r; by default all, with each "
        "installed solver.",
        show_default=False,
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--setting",
        metavar="NAME",
        help="cold, warm or defaults, once for each; by default all of them.",
        show_default=False,
    ),
]
Plugins = Annotated[
    list[Path] | None,
    typer.Option(
        "--with",
        metavar="FILE",
        help="Python file that registers solvers or resolvers of your own. It is executed: name only files "
        "that you trust.",
        show_default=False,
    ),
]
Repeats = Annotated[int, typer.Option(min=1, metavar="N", help="How often each problem is timed.")]
Deadline = Annotated[float, typer.Option(metavar="SECONDS", help="Time for one answer.")]
Full = Annotated[
    bool, typer.Option("--full", help="Add large sets, all sequences, and the CVXPY models; takes hours.")
]


@comparison.command()
def run(
    out: Out = Path("benchmark"),
    sets: Sets = None,
    resolvers: Resolvers = None,
    settings: Settings = None,
    plugins: Plugins = None,
    repeats: Repeats = 3,
    deadline: Deadline = 10.0,
    full: Full = False,
) -> None:
    """Compare resolvers and solvers on sets of problems.

    Cold, warm, and at the default tolerances of the solvers. A run that was interrupted goes on where it
    was. Resolvers run in a process of their own, which is ended if one misses the deadline; what solvers
    print goes to FOLDER/output.txt.
    """
    from taskopt.bench.comparison.campaign import Campaign, carry_out
    from taskopt.bench.comparison.trial import SETTINGS

    campaign = Campaign(
        tuple(sets or ()),
        tuple(names_in(resolvers or ())),
        tuple(settings or SETTINGS),
        repeats,
        deadline,
        tuple(map(str, plugins or ())),
        full,
    )
    with progress_bar() as progress:
        task = progress.add_task("")
        for done, total, cell in carry_out(campaign, out):
            words = f"{cell.set}, {cell.sequence}: {cell.resolver} {cell.setting}"
            progress.update(task, completed=done, total=total, description=words)
    typer.echo(f"rows in {out}; look at them with: taskopt bench report {out}")


@comparison.command()
def report(
    folder: Results = Path("benchmark"),
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="FOLDER", help="Where to write; by default FOLDER/report."),
    ] = None,
) -> None:
    """Write the report of a comparison.

    Markdown with figures, one HTML page, Parquet and CSV.
    """
    from taskopt.bench.comparison.findings import findings
    from taskopt.bench.comparison.results import read_results
    from taskopt.errors import NotInstalled

    try:
        from taskopt.bench.comparison.report import write_report
    except ModuleNotFoundError as error:
        raise NotInstalled("Matplotlib, which draws the figures,", "'taskopt[figures]'") from error
    rows = read_results(folder)
    for question, answer in findings(rows):
        typer.echo(f"{question}: {answer}")
    for path in write_report(rows, out or folder / "report"):
        typer.echo(f"wrote {path}")


@comparison.command()
def diff(
    first: Annotated[Path, typer.Argument(metavar="FIRST", help="Folder of a comparison.")],
    second: Annotated[Path, typer.Argument(metavar="SECOND", help="Folder of a later one.")],
) -> None:
    """Show what changed between two comparisons.

    On the answers that both have to the same problems.
    """
    from taskopt.bench.comparison.difference import difference
    from taskopt.bench.comparison.results import read_results
    from taskopt.bench.comparison.tables import markdown

    for table in difference(read_results(first), read_results(second)):
        typer.echo(markdown(table))


@comparison.command()
def sets(
    save: Annotated[
        Path | None,
        typer.Option("--save", metavar="FOLDER", help="Write the sets there, as files for other programs."),
    ] = None,
) -> None:
    """List the problem sets of the package.

    With version, checksum and description.
    """
    from taskopt.bench.comparison.catalogue import problem_set, set_names
    from taskopt.bench.comparison.problem_set import SHOWN

    for name in set_names():
        found = problem_set(name)
        head = f"{name}, version {found.version}, {found.checksum[:SHOWN]}, {found.count} problems"
        typer.echo(f"{head}: {found.description}")
        if save is not None:
            save.mkdir(parents=True, exist_ok=True)
            found.save(save / f"{name}.npz")


@comparison.command()
def capture(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="Python file that defines `scenario`, which is executed: name only files that you "
            "trust; or demo; or a log, .arrow.",
        ),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="The file to write, .npz.")],
    first: Annotated[int, typer.Option(min=0, metavar="N", help="First tick that is kept.")] = 0,
    ticks: Annotated[int, typer.Option(min=1, metavar="N", help="Number of ticks that are kept.")] = 50,
    resolver: Annotated[
        str | None,
        typer.Option(
            "-r",
            "--resolver",
            metavar="NAME",
            help="Resolver that moves the robot (active-set), or whose ticks of a log are kept.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Record the problems of a run, or of its log, as a set.

    It is for `taskopt bench run --set FILE`.
    """
    from taskopt.bench.comparison.capture import capture as recorded
    from taskopt.bench.comparison.capture import capture_log
    from taskopt.bench.comparison.problem_set import SHOWN, make_set
    from taskopt.loop.scenario import load_scenario

    if source.endswith(".arrow"):
        sequence = capture_log(source, resolver, first=first, ticks=ticks)
        found = make_set(out.stem, [sequence], f"Problems of the log {Path(source).name}.")
    else:
        loaded = load_scenario(source)
        sequence = recorded(loaded, resolver or "active-set", first=first, ticks=ticks)
        found = make_set(out.stem, [sequence], loaded.description)
    found.save(out)
    typer.echo(f"wrote {out}: {found.count} problems, checksum {found.checksum[:SHOWN]}")


@comparison.command()
def export(
    name: Annotated[str, typer.Argument(metavar="SET", help="A set, or a file of one.")],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="The file to write, .parquet.")],
) -> None:
    """Write a set as a file and a test set of qpbenchmark.

    The programs are those that wqp/ hands to its solver.
    """
    from taskopt.bench.comparison.catalogue import problem_set
    from taskopt.bench.comparison.exchange import export as exported

    for path in exported(problem_set(name), out):
        typer.echo(f"wrote {path}")
