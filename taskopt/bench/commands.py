"""The commands `taskopt bench …`."""

from collections import deque
from pathlib import Path
from typing import Annotated

import typer

from taskopt.bench.comparison.commands import comparison

bench = typer.Typer(
    help="Measure solvers and methods on this machine.", no_args_is_help=True, rich_markup_mode=None
)
bench.add_typer(comparison)


@bench.command()
def accuracy(
    solvers: Annotated[
        list[str] | None,
        typer.Option(
            "-s",
            "--solver",
            metavar="NAME",
            help="Name of a solver, once for each; by default all that are installed.",
        ),
    ] = None,
    family: Annotated[
        str,
        typer.Option(
            metavar="NAME", help="How the solvers are used: hqp (level by level) or wqp (one weighted QP)."
        ),
    ] = "hqp",
    trials: Annotated[
        int, typer.Option(min=1, metavar="N", help="Number of problems for each singular value and damping.")
    ] = 20,
) -> None:
    """Measure how accurate each solver is near a singularity.

    For several smallest singular values and dampings, with and without active bounds.
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
    ticks: Annotated[
        int, typer.Option(min=1, metavar="N", help="Number of ticks, shared by four robots.")
    ] = 100_000,
    resolver: Annotated[
        str,
        typer.Option(
            "-r", "--resolver", metavar="NAME", help="Name of the resolver; `taskopt list` shows them."
        ),
    ] = "active-set",
    seed: Annotated[int, typer.Option(metavar="N", help="Another seed draws other stacks.")] = 0,
    order: Annotated[
        int, typer.Option(min=1, max=2, help="1: answers are velocities; 2: they are accelerations.")
    ] = 1,
    keep: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="Save problems whose answer fails, so that they can be resolved again."
        ),
    ] = None,
) -> None:
    """Resolve random stacks and check every answer.

    The column "fallback" counts answers that the resolver could not find itself and took from another one.
    Every 20th claimed answer is judged. The exit code is 1 if one is refuted, if a claimed answer misses its
    KKT conditions, or if a limit is not kept.
    """
    from rich.console import Console
    from rich.progress import track

    from taskopt.bench.fuzz import FRAMES, table
    from taskopt.bench.fuzz import fuzz as ticks_of
    from taskopt.report import terminal

    behind, each = Console(stderr=True), max(ticks // len(FRAMES), 1)
    tallies = []
    for name in FRAMES:
        hidden = not behind.is_terminal
        ticking = ticks_of(name, each, seed, resolver, keep, order)
        steps = track(ticking, name, each, console=behind, transient=True, disable=hidden)
        tallies += [*steps][-1:]
    terminal().print(table(tallies))
    if not all(tally.clean for tally in tallies):
        raise typer.Exit(1)


@bench.command()
def proof(
    problems: Annotated[
        int, typer.Option(min=1, metavar="N", help="Number of problems of each family with exact references.")
    ] = 100,
    lies: Annotated[
        int,
        typer.Option(
            min=0, metavar="N", help="Number of toggled sides, and of planted multipliers, over all families."
        ),
    ] = 1000,
    pairs: Annotated[
        int, typer.Option(min=0, metavar="N", help="Number of larger problems of each family.")
    ] = 10,
    resolvers: Annotated[
        list[str] | None,
        typer.Option("-r", "--resolver", metavar="NAME", help="Name of a resolver, once for each."),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Another seed draws other problems.")] = 0,
) -> None:
    """Judge answers to badly scaled problems by exact references.

    Also lie to the judge, and compare answers to larger problems with each other.

    The last table compares the figures with what is asked for. The exit code is 1 if one of them misses it.
    """
    from rich.console import Console
    from rich.progress import track

    from taskopt.bench import asked as requirements
    from taskopt.bench import lies as attempts
    from taskopt.bench.proof import RESOLVERS, measure, table, verdict
    from taskopt.bench.scaled_problems import FAMILIES

    behind, names, tallies, told = Console(stderr=True), tuple(resolvers or RESOLVERS), [], []
    for family in FAMILIES:
        judging, hidden = measure(problems, names, seed, (family,)), not behind.is_terminal
        total = (problems + 1) // 2
        tallies += [*track(judging, family, total, console=behind, transient=True, disable=hidden)][-1]
        of_family = deque(attempts.try_lies(family, -(-lies // len(FAMILIES)), seed), maxlen=1)
        told += of_family or [attempts.Lies(family)]
        deque(attempts.compare(told[-1], pairs, ("active-set", "hqp/clarabel"), seed), maxlen=0)
    asked = requirements.asked(tallies, told)
    count = f"{2 * ((problems + 1) // 2) * len(FAMILIES)} problems with exact references"
    _print(count, table(tallies), verdict(tallies))
    _print(attempts.table(told), attempts.verdict(told), requirements.table(asked))
    if not all(one.met for one in asked):
        raise typer.Exit(1)


def _print(*parts: object) -> None:
    """Print tables and texts as they are."""
    from taskopt.report import terminal

    out = terminal()
    for part in parts:
        out.print(part, highlight=False, markup=False)


@bench.command()
def strictness(
    cases: Annotated[int, typer.Option(min=1, metavar="N", help="Number of cases.")] = 1000,
) -> None:
    """Compare strict levels with weights.

    The alternatives are a weighted cost and a projected cost for the second level.
    """
    from taskopt.bench.strictness import measure, table
    from taskopt.report import terminal

    *_, methods = measure(cases)
    terminal().print(table(methods))
