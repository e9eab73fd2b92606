"""Every deliberate error: what was wrong, what was expected, the way out.

Each class is also the built-in that fits, so that `except ValueError` works as a Python user
expects, and `except TaskoptError` catches whatever this package raises on purpose.
"""

from collections.abc import Iterable
from difflib import get_close_matches


class TaskoptError(Exception):
    """Base of all errors that taskopt raises on purpose."""


class InvalidValue(TaskoptError, ValueError):
    """A value has the wrong shape, is not finite, or lies outside what is allowed."""


class UnknownName(TaskoptError, LookupError):
    """A name that nothing answers to; the message carries the nearest matches."""

    def __init__(self, kind: str, name: str, known: Iterable[str], hint: str = "") -> None:
        self.kind, self.name, self.known = kind, name, tuple(known)
        near = get_close_matches(name, self.known, n=3, cutoff=0.5)
        if near:
            way_out = f"did you mean {', '.join(near)}?"
        elif len(self.known) <= 12:
            way_out = f"known: {', '.join(self.known) or 'none'}"
        else:
            way_out = f"{len(self.known)} are known, {', '.join(self.known[:6])} … among them"
        super().__init__(f"no {kind} named '{name}'; {way_out}" + (f" {hint}" if hint else ""))


class MissingFile(TaskoptError, FileNotFoundError):
    """A file that was asked for, or that another file refers to, is not there."""


class NotInstalled(TaskoptError, ImportError):
    """An optional package is missing; the message has the line that installs it."""

    def __init__(self, what: str, install: str) -> None:
        super().__init__(f"{what} is not installed; install it with: pip install {install}")


class Infeasible(TaskoptError, ValueError):
    """Hard limits contradict each other; `hierarchy` keeps the problem for a post-mortem."""

    def __init__(self, message: str, hierarchy: object = None) -> None:
        super().__init__(message)
        self.hierarchy = hierarchy


class NotSolved(TaskoptError, RuntimeError):
    """No answer that may be sent to a robot; `resolution` keeps problem and answer."""

    def __init__(self, message: str, resolution: object = None) -> None:
        super().__init__(message)
        self.resolution = resolution


class BadLog(TaskoptError, ValueError):
    """A recording or table that cannot be read; the message says how much of it is whole."""
