"""A comparison that can be interrupted: what is to be tried, what is done, and the file that keeps it.

The file `rows.jsonl` has JSON objects, one a line. The first line of each session has the
conditions: machine, versions, settings, sets with checksums, missing solvers. Each other line has one cell
(set, sequence, resolver, setting) with its rows as columns, see `trial.ROW`. Lines are written whole; what a
kill leaves half-written is cut off at the next start, and its cell tried again.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from platform import python_version
from typing import Any

from taskopt.arrays import positive
from taskopt.bench.comparison.catalogue import problem_set, set_names
from taskopt.bench.comparison.plugin import load_plugin
from taskopt.bench.comparison.problem_set import ProblemSequence, ProblemSet
from taskopt.bench.comparison.trial import BLANK, SETTINGS, Row, Setting, checked_setting
from taskopt.bench.comparison.worker import Cell, Worker
from taskopt.bench.rows_file import append, differences, whole_entries
from taskopt.errors import InvalidValue
from taskopt.log.provenance import commit_of, machine, versions
from taskopt.resolver.registry import resolver, resolver_names
from taskopt.solver.registry import known_to_qpsolvers, missing_solvers, solver_versions, solvers

FILE = "rows.jsonl"
_OUTPUT = "output.txt"
PLAIN = ("active-set", "pinv", "dls", "transpose", "srtp", "sns", "daqp-hierarchy")
# One solver shows what these ways do.
APPROXIMATE = ("pqp/daqp", "wqp@0.1/daqp", "wqp@0.01/daqp", "wqp@0.0001/daqp")
_SLOW = ("jaxopt_osqp", "qpax", "qtqp")  # seconds a problem: the first two compile for each size of one
FAMILIES = ("hqp", "wqp")
_OWN_TOLERANCES = ("hqp/",)  # one family is enough to see what a solver's own tolerances give
# These state that they use no warm start.
_WITHOUT_MEMORY = ("hqp/", "wqp", "pqp/", "cvxpy/", "sns", "srtp", "daqp-hierarchy")
_MUST_AGREE = ("versions", "commit", "machine", "repeats")


def standard_resolvers(*, full: bool = False) -> tuple[str, ...]:
    """Return the names of the resolvers of the standard report.

    Args:
        full: True for those of the full report, with CVXPY's models and slow solvers.

    Returns:
        The plain ones, one of each family for each installed solver, and further ways with one solver.
    """
    names = [row.name for row in solvers() if row.installed and (full or row.name not in _SLOW)]
    families = (*FAMILIES, "cvxpy") if full else FAMILIES
    made = [f"{family}/{name}" for family in families for name in names]
    there = resolver_names()  # CVXPY does not know all of them
    return (*PLAIN, *(name for name in made if name in there), *APPROXIMATE)


@dataclass(frozen=True)
class Campaign:
    """What is to be compared.

    Attributes:
        sets: Names or files of problem sets; empty for the standard ones.
        resolvers: Names of resolvers; empty for the standard ones.
        settings: Names of settings.
        repeats: How often each problem is resolved and timed.
        deadline: Time for one answer [s].
        plugins: Python files that register solvers and resolvers; they are executed.
        full: True for the sets and resolvers of the full report, where none are named, and for all sequences.
        sequences: Largest number of sequences of a set of the package, evenly spread over it, unless `full`;
            a set in a file is taken whole.

    Raises:
        InvalidValue: A number is not positive, or there is no setting of a name.
        UnknownName: There is no set or resolver of a name.
        NotInstalled: The package of a solver cannot be imported.
    """

    sets: tuple[str, ...] = ()
    resolvers: tuple[str, ...] = ()
    settings: tuple[str, ...] = tuple(SETTINGS)
    repeats: int = 3
    deadline: float = 10.0
    plugins: tuple[str, ...] = ()
    full: bool = False
    sequences: int = 3

    def __post_init__(self) -> None:
        positive("repeats", self.repeats)
        positive("deadline", self.deadline)
        positive("sequences", self.sequences)
        for name in self.settings:
            checked_setting(name)
        for plugin in self.plugins:
            load_plugin(plugin)
        for name in self.resolver_names:
            resolver(name)

    @property
    def resolver_names(self) -> tuple[str, ...]:
        """Names of all resolvers that are tried."""
        return self.resolvers or standard_resolvers(full=self.full)

    def problem_sets(self) -> dict[str, ProblemSet]:
        """Make or load the sets, by name or file."""
        return {name: problem_set(name) for name in self.sets or set_names(large=self.full)}

    def cells(self, sets: dict[str, ProblemSet]) -> Iterator[tuple[Cell, int]]:
        """Yield all cells with the number of their problems; those of one sequence come together.

        Args:
            sets: The sets, by name or file.

        Yields:
            Cell and number of problems, but for settings that change nothing: warm where a resolver uses no
            memory, defaults where it has no solver of qpsolvers.
        """
        for name, found in sets.items():
            whole = self.full or name not in set_names()
            for sequence in found.sequences if whole else spread(found.sequences, self.sequences):
                for answer in self.resolver_names:
                    for setting in self.settings:
                        if self._differs(SETTINGS[setting], answer, len(sequence.problems)):
                            yield Cell(name, sequence.name, answer, setting), len(sequence.problems)

    def _differs(self, setting: Setting, answer: str, length: int) -> bool:
        """Return False where a setting changes nothing for a resolver, which is asked cold then."""
        if setting.defaults:
            return answer.startswith(_OWN_TOLERANCES) and answer.partition("/")[2] in known_to_qpsolvers()
        return not setting.warm or not (length == 1 or answer.startswith(_WITHOUT_MEMORY))


def spread(sequences: Sequence[ProblemSequence], most: int) -> list[ProblemSequence]:
    """Choose at most so many sequences, evenly spread.

    Args:
        sequences: All of them.
        most: Number that is chosen.

    Returns:
        The chosen ones in order, the first one among them.
    """
    count = min(most, len(sequences))
    return [sequences[k * len(sequences) // count] for k in range(count)]


def conditions(campaign: Campaign, sets: dict[str, ProblemSet]) -> dict[str, Any]:
    """Describe under which conditions a campaign is run.

    Args:
        campaign: The campaign.
        sets: Its sets.

    Returns:
        Plain data for JSON.
    """
    described = {
        name: {
            "name": found.name, "version": found.version, "checksum": found.checksum, "hard": found.hard,
            "description": found.description, "problems": found.count, "sequences": len(found.sequences),
            "unknowns": {one.name: one.problems[0].n for one in found.sequences},
        }
        for name, found in sets.items()
    }  # fmt: skip
    return {
        "format": 1,
        "versions": {"python": python_version()} | versions() | solver_versions(),
        "commit": commit_of(Path(__file__)),
        "machine": machine(),
        "repeats": campaign.repeats,
        "deadline": campaign.deadline,
        "settings": {name: SETTINGS[name].about for name in campaign.settings},
        "sets": described,
        "missing": missing_solvers(),
        "left_out": [] if campaign.full or campaign.resolvers else list(_SLOW),
    }


def carry_out(campaign: Campaign, folder: Path) -> Iterator[tuple[int, int, Cell]]:
    """Try all that is not done yet, and keep each cell when it is done.

    Args:
        campaign: What is to be compared.
        folder: Folder of the file; it is made if it is not there.

    Yields:
        Number of cells that are done, number of all, and the cell that is next or was done last.

    Raises:
        InvalidValue: The folder is a file, or has rows from other conditions or of other problems; or no
            setting changes anything for the resolvers.
    """
    sets = campaign.problem_sets()
    if folder.exists() and not folder.is_dir():
        raise InvalidValue(f"{folder} is a file; rows go to a folder, which --out names")
    folder.mkdir(parents=True, exist_ok=True)
    file, here = folder / FILE, conditions(campaign, sets)
    kept = done_cells(file, here)
    cells = [(cell, length) for cell, length in campaign.cells(sets) if cell not in kept]
    total = len(cells) + len(kept)
    if not total:
        asked = ", ".join(campaign.settings)
        raise InvalidValue(f"nothing to run: {asked} is as cold for these resolvers; ask for --setting cold")
    append(file, {"conditions": here})
    worker = Worker(folder / _OUTPUT, campaign.deadline, campaign.repeats, campaign.plugins)
    try:
        for done, (cell, length) in enumerate(cells, len(kept)):
            yield done, total, cell
            rows = worker.ask(cell, length)
            append(file, {"cell": cell._asdict(), "rows": _columns(rows)})
    finally:
        worker.end()
    if cells:
        yield total, total, cells[-1][0]


def done_cells(file: Path, here: dict[str, Any]) -> set[Cell]:
    """Read which cells are done, and cut off a line that a kill left half-written.

    Args:
        file: The file of rows; it need not be there.
        here: The present conditions.

    Returns:
        The cells.

    Raises:
        InvalidValue: The file is from other conditions or other problems.
    """
    done = set()
    for entry in whole_entries(file, repair=True):
        if "conditions" in entry:
            _refuse_others(file, entry["conditions"], here)
        else:
            done.add(Cell(**entry["cell"]))
    return done


def _refuse_others(file: Path, then: dict[str, Any], here: dict[str, Any]) -> None:
    """Raise `InvalidValue` if the rows of a file cannot be compared with those to come."""
    changed = [
        f"{part} ({_difference(then.get(part), here[part])})"
        for part in _MUST_AGREE
        if then.get(part) != here[part]
    ]
    both = sorted(then["sets"].keys() & here["sets"].keys())
    sums = [(name, then["sets"][name]["checksum"], here["sets"][name]["checksum"]) for name in both]
    changed += [f"the problems of set {name}" for name, old, new in sums if old != new]
    if changed:
        raise InvalidValue(
            f"{file} was begun under other conditions: {'; '.join(changed)}; take another --out, or the old "
            "environment"
        )


def _difference(then: Any, here: Any) -> str:
    """Return what differs between two values, entry by entry for mappings."""
    if isinstance(then, dict) and isinstance(here, dict):
        return ", ".join(differences(then, here))
    return f"{then} → {here}"


def _columns(rows: Sequence[Row]) -> dict[str, list[Any]]:
    """Return rows as columns."""
    return {name: [row[name] for row in rows] for name in BLANK}
