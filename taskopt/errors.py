"""The errors that taskopt raises on purpose. Each message says what is wrong and how to correct it.

Each class also derives from the built-in exception that fits, so that `except ValueError` works as a Python
user expects, and `except TaskoptError` catches everything that this package raises on purpose.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

from taskopt.synonyms import near_names


class KeptProblem(Protocol):
    """The part of a `Hierarchy` that errors use, stated here so that errors import no hierarchy."""

    def save(self, path: str | Path) -> None:
        """Write the problem to a file, so that it can be resolved again elsewhere.

        Args:
            path: The file.
        """
        ...


class RefusedAnswer(Protocol):
    """The part of a `Resolution` that errors use."""

    @property
    def problem(self) -> KeptProblem:
        """The problem that was resolved."""
        ...


class TaskoptError(Exception):
    """Base class of all errors that taskopt raises on purpose."""


class InvalidValue(TaskoptError, ValueError):
    """A value has the wrong shape or type, is not finite, or is outside its allowed range."""


class UnknownName(TaskoptError, LookupError):
    """A name is unknown; the message suggests names of similar letters or meaning.

    Args:
        kind: Kind of thing that was looked up, such as "robot".
        name: The unknown name.
        known: All names that there are.
        hint: A sentence for the end of the message.

    Attributes:
        kind: Kind of thing that was looked up.
        name: The unknown name.
        known: All names that there are, as a tuple.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str], hint: str = "") -> None:
        self.kind, self.name, self.known = kind, name, tuple(known)
        near = near_names(name, self.known, 0.5) if isinstance(name, str) else []
        if near:
            way_out = f"did you mean {', '.join(near)}?"
        elif len(self.known) <= 12:
            way_out = f"known: {', '.join(self.known) or 'none'}"
        else:
            way_out = f"{len(self.known)} are known, among them {', '.join(self.known[:6])}"
        end = " " if way_out.endswith("?") else ". "
        super().__init__(f"no {kind} named '{name}'; {way_out}" + (end + hint if hint else ""))


class MissingFile(TaskoptError, FileNotFoundError):
    """A file that the user named, or that another file refers to, does not exist."""


class NotInstalled(TaskoptError, ImportError):
    """An optional package is missing; the message has the command that installs it.

    Args:
        what: Name of the feature that needs the package.
        install: Arguments of `pip install`.
    """

    def __init__(self, what: str, install: str) -> None:
        super().__init__(f"{what} is not installed; install it with: pip install {install}")


class Infeasible(TaskoptError, ValueError):
    """Hard limits contradict each other; the message names them and the least relaxation.

    Args:
        message: The conflict in words.
        hierarchy: The problem, a `Hierarchy`.

    Attributes:
        hierarchy: The problem, which can be inspected or saved; None if there is none.
    """

    def __init__(self, message: str, hierarchy: KeptProblem | None = None) -> None:
        super().__init__(message)
        self.hierarchy = hierarchy


class NotSolved(TaskoptError, RuntimeError):
    """There is no answer that may be sent to a robot; the message says why.

    Args:
        message: Resolver, time, and the reason.
        resolution: The refused answer, a `Resolution`.

    Attributes:
        resolution: The refused answer, with the problem in `resolution.problem`; None if there is none.
    """

    def __init__(self, message: str, resolution: RefusedAnswer | None = None) -> None:
        super().__init__(message)
        self.resolution = resolution


class DroppedWarning(UserWarning):
    """A file of a robot states something that the robot cannot represent; `Robot.dropped` lists all of it."""


class LogFailed(TaskoptError, OSError):
    """A log cannot be written any more, as on a full disk; the message says how much of it is in the file.

    Args:
        message: The reason.

    Attributes:
        resolution: The answer of the tick at which this was noticed, a `Resolution`, so that a loop can go
            on without its log; None if there is none.
    """

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.resolution: RefusedAnswer | None = None


class BadLog(TaskoptError, ValueError):
    """A recording or table cannot be read; the message says how much of it can be read."""
