"""Problem sets: sequences of hierarchies with a name, a version, a description and a checksum.

A sequence holds consecutive problems of one layout and norm, as a run gives them, so that a resolver can be
tried cold at each of them and warm from one to the next.

The file of a set is an .npz archive: `about` is JSON text with the format, name, version, description and the
name and layout of each sequence, and `buffers 0`, `norm 0`, … are the numbers of each sequence, (T, size) and
(n,) or (n, n). Nothing in a file is ever executed.
"""

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from taskopt.errors import InvalidValue, MissingFile
from taskopt.hierarchy import io
from taskopt.hierarchy.lexls_file import is_lexls
from taskopt.hierarchy.problem import Hierarchy

_FORMAT = 1
SHOWN = 12  # letters of a checksum that tables show


@dataclass(frozen=True, eq=False)
class ProblemSequence:
    """Consecutive problems of one layout and one norm.

    Attributes:
        name: Name within its set.
        problems: The problems in order, at least one.

    Raises:
        InvalidValue: There is no problem, or two of them differ in layout or norm.
    """

    name: str
    problems: tuple[Hierarchy, ...]

    def __post_init__(self) -> None:
        if not self.problems:
            raise InvalidValue(f"sequence {self.name} has no problem; a sequence needs at least one")
        first = self.problems[0]
        for k, problem in enumerate(self.problems):
            if problem.layout != first.layout or not np.array_equal(problem.norm, first.norm):
                raise InvalidValue(
                    f"sequence {self.name}: problem {k} has another layout or norm than problem 0; "
                    "make a sequence of its own of it"
                )


@dataclass(frozen=True, eq=False)
class ProblemSet:
    """A set of problems, on which resolvers are compared.

    Attributes:
        name: Name of the set.
        version: Number that is raised whenever a problem changes.
        description: What the problems are, in a paragraph.
        sequences: The sequences, each under a name of its own.
        hard: True for badly scaled problems, of which some are beyond what double precision can decide.

    Raises:
        InvalidValue: There is no sequence, or two of them have one name.
    """

    name: str
    version: int
    description: str
    sequences: tuple[ProblemSequence, ...]
    hard: bool = False

    def __post_init__(self) -> None:
        names = [sequence.name for sequence in self.sequences]
        if not names or len(set(names)) != len(names):
            raise InvalidValue(f"set {self.name} needs sequences, each of another name; got {names}")

    @cached_property
    def checksum(self) -> str:
        """SHA-256 of names and numbers of all problems, 64 hexadecimal digits."""
        digest = hashlib.sha256()
        for sequence in self.sequences:
            first = sequence.problems[0]
            digest.update(f"{sequence.name}\n{io.names_of(first.layout)}\n".encode())
            digest.update(np.ascontiguousarray(first.norm).tobytes())
            for problem in sequence.problems:
                digest.update(np.ascontiguousarray(problem.buffer).tobytes())
        return digest.hexdigest()

    @property
    def count(self) -> int:
        """Number of problems."""
        return sum(len(sequence.problems) for sequence in self.sequences)

    def sequence(self, name: str) -> ProblemSequence:
        """Return the sequence of a name.

        Args:
            name: Its name.

        Returns:
            The sequence.

        Raises:
            InvalidValue: There is none of that name.
        """
        for sequence in self.sequences:
            if sequence.name == name:
                return sequence
        raise InvalidValue(f"set {self.name} has no sequence '{name}'; it has {self._names}")

    @property
    def _names(self) -> str:
        """Names of all sequences, for messages."""
        return ", ".join(sequence.name for sequence in self.sequences)

    def save(self, path: str | Path) -> None:
        """Write the set to a file.

        Args:
            path: The file; it is written completely or not at all.
        """
        sequences = [
            {"name": sequence.name, "layout": io.names_of(sequence.problems[0].layout)}
            for sequence in self.sequences
        ]
        about = {
            "format": _FORMAT, "name": self.name, "version": self.version, "description": self.description,
            "hard": self.hard, "checksum": self.checksum, "sequences": sequences,
        }  # fmt: skip
        numbers: dict[str, Any] = {"about": np.array(json.dumps(about))}
        for k, sequence in enumerate(self.sequences):
            numbers[f"buffers {k}"] = np.array([problem.buffer for problem in sequence.problems])
            numbers[f"norm {k}"] = sequence.problems[0].norm
        part = Path(path).with_name(f"{Path(path).name}.part")
        with part.open("wb") as file:
            np.savez_compressed(file, **numbers)
        part.replace(path)


def make_set(
    name: str,
    problems: Iterable[Hierarchy] | Sequence[ProblemSequence],
    description: str = "",
    version: int = 1,
) -> ProblemSet:
    """Make a set of plain problems, or of sequences.

    Args:
        name: Name of the set.
        problems: Hierarchies, each of which becomes a sequence of its own; or sequences.
        description: What the problems are, in a paragraph.
        version: Number that is raised whenever a problem changes.

    Returns:
        The set.

    Raises:
        InvalidValue: There is no problem, or two sequences have one name.
    """
    given = tuple(problems)
    sequences = [
        part if isinstance(part, ProblemSequence) else ProblemSequence(f"problem {k}", (part,))
        for k, part in enumerate(given)
    ]
    return ProblemSet(name, version, description, tuple(sequences))


def load_set(path: str | Path) -> ProblemSet:
    """Read a set from its file, or make one of a single hierarchy in a file of `Hierarchy.save` or LexLS.

    Args:
        path: The file.

    Returns:
        The set, with all numbers the same to the last bit.

    Raises:
        MissingFile: There is no such file.
        InvalidValue: It is no file of these kinds, or its numbers do not have the checksum that it states.
    """
    file = Path(path)
    if not file.is_file():
        raise MissingFile(f"no problem set '{file}'; `taskopt bench sets` lists those of the package")
    if is_lexls(file):
        return make_set(file.stem, [Hierarchy.load(file)], f"The hierarchy of the LexLS file {file.name}.")
    try:
        with np.load(file, allow_pickle=False) as numbers:
            if "layout" in numbers:
                return make_set(file.stem, [Hierarchy.load(file)], f"The hierarchy of the file {file.name}.")
            found, checksum = _read(dict(numbers))
    except (BadZipFile, EOFError, KeyError, TypeError, ValueError) as error:
        raise InvalidValue(f"{file} is not a problem set that ProblemSet.save wrote: {error}") from error
    if found.checksum != checksum:
        raise InvalidValue(
            f"{file} is damaged or was changed: its numbers have the checksum {found.checksum[:SHOWN]}, and "
            f"it states {checksum[:SHOWN]}; record the set again"
        )
    return found


def _read(numbers: dict[str, Any]) -> tuple[ProblemSet, str]:
    """Return the set in an archive, and the checksum that it states."""
    about = json.loads(str(numbers["about"]))
    if about["format"] != _FORMAT:
        raise ValueError(f"it has the format {about['format']}; this version reads {_FORMAT}")
    sequences = []
    for k, entry in enumerate(about["sequences"]):
        layout, buffers, norm = io.layout_of(entry["layout"]), numbers[f"buffers {k}"], numbers[f"norm {k}"]
        if buffers.shape[1:] != (layout.size,) or norm.shape not in ((layout.n,), (layout.n, layout.n)):
            raise ValueError(f"the numbers of sequence {entry['name']} do not fit its names")
        problems = tuple(Hierarchy.view(layout, row.astype(np.float64), norm) for row in buffers)
        sequences.append(ProblemSequence(entry["name"], problems))
    described = about["name"], int(about["version"]), about["description"]
    return ProblemSet(*described, tuple(sequences), bool(about["hard"])), about["checksum"]
