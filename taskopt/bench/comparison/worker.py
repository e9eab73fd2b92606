"""The process in which resolvers are tried, so that one that hangs, crashes or prints harms no other.

Its standard output and error go to a file, linear algebra runs on one thread unless the environment asks for
more, and garbage is collected between trials only.
"""

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import NamedTuple

from taskopt.bench.comparison.catalogue import problem_set
from taskopt.bench.comparison.plugin import load_plugin
from taskopt.bench.comparison.problem_set import ProblemSet
from taskopt.bench.comparison.reference import Reference, reference
from taskopt.bench.comparison.trial import Row, checked_setting, resolver_in, trial, without_answer
from taskopt.errors import TaskoptError

_PREPARATION = 600.0  # [s] for references and compilation, which are nobody's solve time
_FIRST = 60.0  # [s] more for the first answer, which imports a package
_TAIL = 300  # letters of the output of a process that died


class Cell(NamedTuple):
    """One resolver in one setting on one sequence.

    Attributes:
        set: Name or file of the set.
        sequence: Name of the sequence.
        resolver: Name of the resolver.
        setting: Name of the setting.
    """

    set: str
    sequence: str
    resolver: str
    setting: str


class Worker:
    """A process that tries resolvers; it is ended and begun anew if it misses a deadline or dies.

    Args:
        output: File that takes whatever solvers print.
        deadline: Time for one answer [s].
        repeats: How often each problem is resolved and timed.
        plugins: Python files that register solvers and resolvers.
    """

    def __init__(self, output: Path, deadline: float, repeats: int, plugins: tuple[str, ...] = ()) -> None:
        self._output, self._deadline, self._repeats, self._plugins = output, deadline, repeats, plugins
        self._process: SpawnProcess | None = None

    def ask(self, cell: Cell, length: int) -> list[Row]:
        """Try a resolver on a sequence.

        Args:
            cell: Resolver, setting and sequence.
            length: Number of problems of the sequence.

        Returns:
            A row for each problem, also where there is no answer.
        """
        if self._process is None:
            self._begin()
        rows: list[Row] = []
        try:
            self._connection.send(cell)
            for allowed in self._allowances(length):
                if not self._connection.poll(allowed):
                    self.end()
                    return self._stopped(rows, length, "DEADLINE", f"no answer within {allowed:g} s")
                row = self._connection.recv()
                if row is not None:
                    rows.append(row)
        except (EOFError, ConnectionError):
            self.end()
            return self._stopped(rows, length, "CRASHED", f"the process ended: {self._last_words()}")
        return rows

    def end(self) -> None:
        """End the process; another question begins a new one."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._connection.close()
            self._process = None

    def _begin(self) -> None:
        """Begin a process."""
        for library in ("OPENBLAS", "OMP", "MKL"):  # read when NumPy is imported there
            os.environ.setdefault(f"{library}_NUM_THREADS", "1")
        context = get_context("spawn")
        self._connection, theirs = context.Pipe()
        arguments = theirs, str(self._output), self._repeats, self._plugins
        process = context.Process(target=serve, args=arguments, daemon=True)
        process.start()
        self._process = process
        theirs.close()

    def _allowances(self, length: int) -> Iterator[float]:
        """Yield the time that each message may take: two for what comes before, then one for each answer."""
        yield _PREPARATION
        yield self._deadline + _FIRST
        for _ in range(length):
            yield self._deadline

    def _stopped(self, rows: list[Row], length: int, status: str, note: str) -> list[Row]:
        """Return the rows with the one that failed, and those that were not tried then."""
        failed = without_answer(len(rows), status, note)
        left = [without_answer(index, "NOT RUN", status) for index in range(len(rows) + 1, length)]
        return [*rows, failed, *left]

    def _last_words(self) -> str:
        """Return the end of what the process printed."""
        text = self._output.read_text(encoding="utf-8", errors="replace") if self._output.is_file() else ""
        return " ".join(text[-_TAIL:].split()) or "it printed nothing"


def serve(connection: Connection, output: str, repeats: int, plugins: tuple[str, ...]) -> None:
    """Answer questions until the other side is gone; this runs in the process of its own.

    Args:
        connection: Takes cells; gives None when the problems are ready and when the resolver has answered one
            of them untimed, and then a row for each problem.
        output: File for whatever is printed.
        repeats: How often each problem is resolved and timed.
        plugins: Python files that register solvers and resolvers.
    """
    with Path(output).open("ab", buffering=0) as file:
        os.dup2(file.fileno(), sys.stdout.fileno())
        os.dup2(file.fileno(), sys.stderr.fileno())
    for plugin in plugins:
        load_plugin(plugin)
    bank = Bank()
    gc.disable()
    while True:
        try:
            cell = connection.recv()
        except EOFError:
            return
        gc.collect()
        gc.freeze()  # the packages of solvers have a million objects, which are not looked through again
        for message in answers(bank, cell, repeats):
            connection.send(message)


class Bank:
    """The references of the sequence that was asked for last, and the sets they come from."""

    def __init__(self) -> None:
        self._sets: dict[str, ProblemSet] = {}
        self._place = ("", "")
        self._references: list[Reference] = []

    def references(self, name: str, sequence: str) -> list[Reference]:
        """Return the references of a sequence.

        Args:
            name: Name or file of the set.
            sequence: Name of the sequence.

        Returns:
            One for each problem.
        """
        if name not in self._sets:
            self._sets[name] = problem_set(name)
        if self._place != (name, sequence):
            self._references = [reference(one) for one in self._sets[name].sequence(sequence).problems]
            self._place = name, sequence
        return self._references


def answers(bank: Bank, cell: Cell, repeats: int) -> Iterator[Row | None]:
    """Answer one question.

    Args:
        bank: The references.
        cell: The question.
        repeats: How often each problem is resolved and timed.

    Yields:
        None when the references are ready, None after an untimed answer, then the rows.
    """
    references, setting = bank.references(cell.set, cell.sequence), checked_setting(cell.setting)
    answer = resolver_in(setting, cell.resolver)
    yield None
    with suppress(TaskoptError):  # it will be said in the row of this problem
        answer(references[0].problem)
    yield None
    yield from trial(references, answer, setting, repeats)
