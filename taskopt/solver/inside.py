"""Time spent inside the packages of solvers, beside which tables show the time around it."""

from threading import local
from time import perf_counter_ns


class _Inside(local):
    """A stopwatch of each thread, which runs while a package solves a program.

    Attributes:
        nanoseconds: Time so far [ns].
    """

    nanoseconds = 0
    _begin = 0

    def __enter__(self) -> None:
        self._begin = perf_counter_ns()

    def __exit__(self, *_: object) -> None:
        self.nanoseconds += perf_counter_ns() - self._begin


inside = _Inside()


def nanoseconds_inside() -> int:
    """Return how long this thread has been inside the packages of solvers.

    What a package is given and what it returns is converted outside; the binding of a package to Python
    counts as a part of it. Functions that users register count as a whole.

    Returns:
        The time so far [ns]; it grows with each program that is solved.
    """
    return inside.nanoseconds
