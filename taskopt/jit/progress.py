"""Say on stderr what is being compiled, a bar on a terminal, else a line before and after; take the time."""

import sys
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

_SHORT = 2.0  # [s] compilations that take less end without a line of their own


class Report:
    """Reports the compilation of kernels; one object serves the whole process.

    Nothing is said as long as every kernel comes from the folder of compiled kernels.
    """

    def __init__(self) -> None:
        self._bar: tuple[Progress, TaskID] | None = None
        self._began: float | None = None  # [s] when the present compilation began
        self._announced = False
        self._total = self._done = 0
        self._warned = False

    @property
    def running(self) -> bool:
        """True between `begin` and `end`."""
        return self._total > 0

    def begin(self, total: int, folder: str, *, kept: bool) -> None:
        """Announce that kernels are about to be compiled.

        Args:
            total: How many there are.
            folder: Where the machine code is kept; empty if no place is known.
            kept: Whether that folder can be written.
        """
        self._total, self._done = max(total, 1), 0
        if not kept and not self._warned:
            self._warned = True
            place = f"{folder} cannot be written" if folder else "there is no home folder"
            _say(f"{place}, so compiled kernels are not kept; set NUMBA_CACHE_DIR to a folder that can be")
        if sys.stderr.isatty():
            self._bar = _start_bar(self._total)
        else:
            self._began = time.monotonic()
            if not self._announced:
                self._announced = True
                _say("compiling parts of the numeric core, which are kept for later runs")

    def compiling(self, name: str) -> None:
        """Show which kernel is being compiled.

        Args:
            name: Name of the kernel.
        """
        if self._bar:
            progress, task = self._bar
            progress.update(task, description=name)

    def compiled(self) -> None:
        """Count one kernel as compiled."""
        self._done += 1
        if self._bar:
            progress, task = self._bar
            progress.update(task, completed=self._done, total=max(self._total, self._done))

    def end(self) -> None:
        """Remove the bar, or write the line after."""
        if self._bar:
            self._bar[0].stop()
            self._bar = None
        elif self._began is not None:
            taken = time.monotonic() - self._began
            self._began = None
            if taken > _SHORT:
                _say(f"compiled in {taken:.0f} s")
        self._total = 0


class Stopwatch:
    """Adds up the time spent in `with` blocks; a block inside another one counts once.

    Attributes:
        nanoseconds: Time of all blocks that have ended [ns].
    """

    def __init__(self) -> None:
        self.nanoseconds = 0
        self._depth = 0
        self._began = 0

    def __enter__(self) -> None:
        if self._depth == 0:
            self._began = time.perf_counter_ns()
        self._depth += 1

    def __exit__(self, *_: object) -> None:
        self._depth -= 1
        if self._depth == 0:
            self.nanoseconds += time.perf_counter_ns() - self._began


def _start_bar(total: int) -> "tuple[Progress, TaskID]":
    """Start a bar on the terminal; Rich is imported only where there is something to show."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    progress = Progress(
        TextColumn("compiling, once for this machine and version"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
        console=Console(stderr=True),
        transient=True,
    )
    progress.start()
    return progress, progress.add_task("", total=total)


def _say(line: str) -> None:
    """Write one line to stderr."""
    print(f"taskopt: {line}", file=sys.stderr, flush=True)
