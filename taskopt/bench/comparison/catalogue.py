"""The problem sets of the package: generated ones with the checksum they must have, and recorded ones."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from taskopt.bench.comparison.exchange import is_program, load_parquet, load_program
from taskopt.bench.comparison.families import (
    contradicting_limits,
    near_singular,
    random_levels,
    scaled_sequences,
    velocity_bounds,
)
from taskopt.bench.comparison.problem_set import SHOWN, ProblemSequence, ProblemSet, load_set
from taskopt.bench.scaled_problems import FAMILIES, ORDINARY
from taskopt.errors import InvalidValue, UnknownName

_ENDINGS = (".npz", ".dat", ".parquet")
RECORDED = Path(__file__).parent / "recorded"


@dataclass(frozen=True)
class Generated:
    """A problem set that a seeded generator draws.

    Attributes:
        name: Name of the set.
        version: Number that is raised whenever a problem changes.
        checksum: First digits of the checksum of this version.
        description: What the problems are, in a paragraph.
        draw: Draws the sequences.
        hard: True for badly scaled problems.
        large: True for a set that only the full report includes.
    """

    name: str
    version: int
    checksum: str
    description: str
    draw: Callable[[], Iterator[ProblemSequence]]
    hard: bool = False
    large: bool = False

    def make(self) -> ProblemSet:
        """Draw the set.

        Returns:
            The set.

        Raises:
            InvalidValue: The numbers that are drawn here are not those of this version.
        """
        drawn = ProblemSet(self.name, self.version, self.description, tuple(self.draw()), self.hard)
        if not drawn.checksum.startswith(self.checksum):
            raise InvalidValue(
                f"set {self.name} version {self.version} must have the checksum {self.checksum}, and is "
                f"drawn here as {drawn.checksum[:SHOWN]}: figures of the two cannot be compared; save the "
                "set where it is drawn rightly (`taskopt bench sets --save FOLDER`), and give that to `run`"
            )
        return drawn


_BADLY_SCALED = tuple(name for name in FAMILIES if name not in ORDINARY)
GENERATED = (
    Generated(
        "small",
        1,
        "6a9658a93575",
        "Pairs of problems with 2 to 6 unknowns, one to three levels with inequalities, hard rows and "
        "bounds; rows and weights within 10^±3; ties; hard equalities without a level. Exact references by "
        "rational arithmetic.",
        partial(scaled_sequences, ORDINARY, 5),
    ),
    Generated(
        "badly-scaled",
        1,
        "41b9524749a8",
        "Pairs of problems with 2 to 6 unknowns whose rows differ by 10^±6 in size, or weights by 10^±6 and "
        "10^±12, norms by 10^±4, bounds by 10^±9; light rows; rows that depend on others but for 1e-9 to "
        "1e-4. Exact references by rational arithmetic.",
        partial(scaled_sequences, _BADLY_SCALED, 4),
        hard=True,
    ),
    Generated(
        "velocity-bounds",
        1,
        "2d436e28e893",
        "Seven joints with bounds on their velocities, a level of three rows above one of two; the first "
        "asks for half to four times of about what the bounds allow. After the experiments of Flacco, De "
        "Luca and Khatib (2015), with numbers of our own.",
        partial(velocity_bounds, 10, 5),
    ),
    Generated(
        "near-singular",
        1,
        "473695f93161",
        "Three rows for seven joints, of which the last is the sum of the others but for a part of size "
        "2^-e, e = 2 to 18, above a posture; bounds at ±8.",
        partial(near_singular, (2, 6, 10, 14, 18), 4),
    ),
    Generated(
        "contradicting",
        1,
        "950bd10f34cb",
        "Hard rows that contradict the bounds, or each other. The right answer is that there is none.",
        partial(contradicting_limits, 8),
    ),
    Generated(
        "random-20",
        1,
        "ce3171a76227",
        "Four levels of random rank with 20 unknowns, half of the rows inequalities, inside bounds; "
        "sequences in which all rows move. After the profile of Escande, Mansard and Wieber (2014), Sect. 6, "
        "with sizes and ranks of our own.",
        partial(random_levels, 20, 4, 5),
    ),
    Generated(
        "random-40",
        1,
        "073e53935337",
        "As random-20, with 40 unknowns.",
        partial(random_levels, 40, 2, 4),
    ),
    Generated(
        "random-80",
        1,
        "e4a99fa8e0b8",
        "As random-20, with 80 unknowns.",
        partial(random_levels, 80, 3, 4),
        large=True,
    ),
)


def set_names(*, large: bool = True) -> tuple[str, ...]:
    """Return the names of the sets of the package.

    Args:
        large: False leaves out those that only the full report includes.

    Returns:
        Names of generated sets, then of recorded ones.
    """
    drawn = [row.name for row in GENERATED if large or not row.large]
    return (*drawn, *sorted(file.stem for file in RECORDED.glob("*.npz")))


def problem_set(name: str) -> ProblemSet:
    """Return a set of the package, or read one from a file.

    Args:
        name: Name of a set of the package; or a path that ends in .npz (a set, a hierarchy, or a program that
            qpsolvers saved), in .dat (LexLS) or in .parquet (qpbenchmark).

    Returns:
        The set.

    Raises:
        UnknownName: There is no set of that name.
        MissingFile: There is no such file.
        InvalidValue: The file is not a problem set, or a generated set is not drawn here as it must be.
    """
    if Path(name).suffix in _ENDINGS:
        return _in_file(Path(name))
    for row in GENERATED:
        if row.name == name:
            return row.make()
    if name not in set_names():
        raise UnknownName("problem set", name, set_names(), "A file ends in .npz, .dat or .parquet.")
    return load_set(RECORDED / f"{name}.npz")


def _in_file(path: Path) -> ProblemSet:
    """Read a set, a hierarchy, or programs of other collections."""
    if path.is_file() and path.suffix == ".parquet":
        return load_parquet(path)
    if path.is_file() and is_program(path):
        return load_program(path)
    return load_set(path)
