"""The commands on logs, which combine the modules of `taskopt.log` and compute nothing themselves."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskopt.errors import InvalidValue, UnknownName

if TYPE_CHECKING:
    from taskopt.log.again import Again

logs_read = typer.Typer()

LogFile = Annotated[
    Path,
    typer.Argument(
        metavar="LOG", help="A log that ends in .arrow, or a folder, of which the newest is taken."
    ),
]
At = Annotated[
    float | None, typer.Option("--at", metavar="SECONDS", help="Time in the log.", show_default=False)
]
Joint = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="When limits held this joint, and at which price.", show_default=False),
]
Which = Annotated[
    str | None,
    typer.Option("-r", "--resolver", metavar="NAME", help="Name of a resolver.", show_default=False),
]
Weights = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="ADDRESS=VALUE",
        help="Another weight, such as hand.weight=0.1; once for each.",
        show_default=False,
    ),
]
Without = Annotated[
    list[str] | None,
    typer.Option(
        "--without",
        metavar="NAME",
        help="Leave out a task or a limit; once for each.",
        show_default=False,
    ),
]


@logs_read.command()
def show(
    log: LogFile,
    joint: Joint = None,
    at: At = None,
    why: Annotated[bool, typer.Option("--why", help="Why it ended, and conflicts before.")] = False,
    resolver: Which = None,
) -> None:
    """Tell what a log says, or why it ended."""
    from taskopt.log import story
    from taskopt.log.reading import open_log

    opened = open_log(log)
    if joint is not None:
        typer.echo(story.of_joint(opened, joint))
    elif at is not None:
        typer.echo(story.of_tick(opened, opened.at(at, resolver)))
    elif why:
        typer.echo(story.why(opened))
    else:
        typer.echo(story.summary(opened))


@logs_read.command()
def replay(
    log: LogFile, at: At = None, resolver: Which = None, changes: Weights = None, without: Without = None
) -> None:
    """Solve ticks of a log again from its data.

    One tick at --at, else all.

    The exit code is 1 if an unchanged tick has another answer than the log.
    """
    from taskopt.log.again import solve_again
    from taskopt.log.reading import open_log
    from taskopt.loop.variation import setting

    opened, settings = open_log(log), dict(map(setting, changes or ()))
    if at is None and (settings or without):
        raise InvalidValue("--set and --without change one tick; add --at SECONDS")
    rows = range(len(opened)) if at is None else [opened.at(at)]
    distances = []
    for row in rows:
        again = solve_again(opened.tick(row), resolver, settings, without or ())
        distances.append(again.distance)
        if at is not None:
            _print(again)
    largest = f"{max(distances, default=0.0):.3g}"
    if resolver is not None or settings or without:
        typer.echo(f"largest difference from what was sent: {largest}")
        return
    same = sum(distance == 0.0 for distance in distances)
    ticks = f"{same} of {len(distances)} ticks have the same answer to the last bit"
    typer.echo(f"{ticks}; largest difference {largest}")
    raise typer.Exit(0 if same == len(distances) else 1)


def _print(again: "Again") -> None:
    """Print an answer beside that of the log."""
    tick, resolution = again.tick, again.resolution
    for name, old, new in zip(tick.layout.unknowns, tick.x, resolution.x, strict=True):
        typer.echo(f"{name}: {old:.9g} → {new:.9g}")
    typer.echo(resolution.explain())
    for note in again.notes:
        typer.echo(f"note: {note}")


@logs_read.command()
def export(
    log: LogFile,
    table: Annotated[Path, typer.Argument(metavar="TABLE", help="File that ends in .csv or .parquet.")],
    columns: Annotated[
        list[str] | None,
        typer.Option("--columns", metavar="NAMES", help="Only these, between commas.", show_default=False),
    ] = None,
) -> None:
    """Write a log as a table that other programs read."""
    from taskopt.command_parts import names_in
    from taskopt.log import export as exports
    from taskopt.log.reading import open_log

    typer.echo(f"written: {exports.export(open_log(log), table, names_in(columns or ()))}")


@logs_read.command()
def diff(
    log: LogFile,
    other: Annotated[Path, typer.Argument(metavar="OTHER", help="Another log of the same robot.")],
    resolver: Annotated[
        list[str] | None,
        typer.Option("-r", "--resolver", metavar="NAME", help="Of both, or twice.", show_default=False),
    ] = None,
    tolerance: Annotated[float, typer.Option(help="Difference up to which ticks are the same.")] = 0.0,
) -> None:
    """Tell at which tick two logs come apart, why, and how far.

    The exit code is 1 if they do.
    """
    from taskopt.log.difference import difference
    from taskopt.log.reading import open_log

    if resolver is not None and len(resolver) > 2:
        raise InvalidValue("two logs are compared: give --resolver once or twice")
    names = None if not resolver else (resolver[0], resolver[-1])
    found = difference(open_log(log), open_log(other), names, tolerance)
    typer.echo(found)
    raise typer.Exit(0 if found.same else 1)


@logs_read.command()
def report(
    log: LogFile,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="Ends in .md or .html.", show_default=False),
    ] = None,
    fail_on: Annotated[
        list[str] | None,
        typer.Option(
            "--fail-on",
            metavar="CHECKS",
            help="error, violation, unproven, deadline, between commas: exit code 1 if one is found.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Report on a log: checks, errors of tasks, and prices of limits."""
    from taskopt.command_parts import names_in
    from taskopt.log import report as reports
    from taskopt.log.claims import CHECKS, claims
    from taskopt.log.reading import open_log

    asked = names_in(fail_on or ())
    for name in asked:
        if name not in CHECKS:
            raise UnknownName("check", name, CHECKS)
    if output is not None and output.suffix not in (".md", ".html"):
        raise InvalidValue(f"a report must end in .md or .html, got {output.name!r}")
    opened = open_log(log)
    found = claims(opened, prove="unproven" in asked)
    write = reports.html if output is not None and output.suffix == ".html" else reports.markdown
    if output is None:
        typer.echo(write(opened, found), nl=False)
    else:
        output.write_text(write(opened, found), encoding="utf-8")
        typer.echo(f"written: {output}")
    raise typer.Exit(1 if any(len(claim.rows) and claim.name in asked for claim in found) else 0)
