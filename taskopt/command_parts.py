"""What several commands share: the argument for a scenario, names between commas, and the progress bar."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.progress import Progress

ScenarioFile = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="Python file that defines `scenario`, or demo. The file is executed: name only files that you "
        "trust.",
    ),
]


def names_in(texts: Iterable[str]) -> list[str]:
    """Return the names in the values of an option that may be repeated.

    Args:
        texts: Values, each with one name, or several between commas.

    Returns:
        The names, in order.
    """
    return [name for text in texts for name in text.split(",") if name]


@contextmanager
def progress_bar() -> "Iterator[Progress]":
    """Show a progress bar on the terminal until the block ends; nothing if the output is no terminal.

    Yields:
        The bar, to which tasks are added.
    """
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        yield progress
