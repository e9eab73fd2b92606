"""The rows of a comparison as columns, and the figures that are computed from them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from taskopt.arrays import Array, Mask
from taskopt.bench.comparison.campaign import FILE
from taskopt.bench.comparison.trial import BLANK, PROVEN, PROVEN_IF, REFUTED, REFUTED_IF, UNKNOWN
from taskopt.bench.rows_file import whole_entries
from taskopt.errors import InvalidValue, MissingFile
from taskopt.hierarchy.tolerances import ACCURACY

PLACE = ("set", "sequence", "resolver", "setting")
SHIFT = 10e-6  # [s] of the geometric mean, so that answers of a microsecond do not decide it
KNOWN = ["rational", "proof", "condition"]  # kinds of references that have an optimum
PERIOD = 1e-3  # [s] the period of a loop at 1 kHz
_WORDS = (*PLACE, "status", "verdict", "reference", "fallback", "note")


@dataclass(frozen=True, eq=False)
class Results:
    """The rows of a comparison.

    Attributes:
        conditions: Conditions of the last session, see `campaign.conditions`.
        columns: Columns by name, (rows,) each: those of `trial.ROW`, and set, sequence, resolver, setting.
    """

    conditions: dict[str, Any]
    columns: dict[str, NDArray[Any]]

    def __len__(self) -> int:
        return len(self.columns["index"])

    def select(self, mask: Mask) -> "Results":
        """Return some of the rows.

        Args:
            mask: True for the rows to keep, (rows,).

        Returns:
            The same conditions with fewer rows.
        """
        return Results(self.conditions, {name: column[mask] for name, column in self.columns.items()})

    def where(self, **words: str) -> "Results":
        """Return the rows whose columns have given words.

        Args:
            words: Word by column, such as resolver="hqp/daqp".

        Returns:
            The same conditions with fewer rows.
        """
        mask = np.ones(len(self), dtype=bool)
        for name, word in words.items():
            mask &= self.columns[name] == word
        return self.select(mask)

    def names(self, column: str) -> tuple[str, ...]:
        """Return the different words of a column, in the order in which they come.

        Args:
            column: Name of a column of words.

        Returns:
            The words.
        """
        return tuple(dict.fromkeys(self.columns[column].tolist()))

    @property
    def well_scaled(self) -> "Results":
        """The rows of all sets but the badly scaled ones."""
        hard = [name for name, found in self.conditions["sets"].items() if found["hard"]]
        return self.select(~np.isin(self.columns["set"], hard))


def read_results(path: str | Path) -> Results:
    """Read the rows of a comparison.

    Args:
        path: Folder of a comparison, or the file of rows in it.

    Returns:
        The rows; of a line that a kill left half-written, nothing.

    Raises:
        MissingFile: There is no such file.
        InvalidValue: The file has no rows, or is not of this kind.
    """
    file = Path(path) / FILE if Path(path).is_dir() else Path(path)
    if not file.is_file():
        raise MissingFile(
            f"no rows of a comparison at '{file}'; `taskopt bench run --out FOLDER` writes them"
        )
    conditions: dict[str, Any] = {}
    columns: dict[str, list[Any]] = {name: [] for name in (*PLACE, *BLANK)}
    try:
        for entry in whole_entries(file):
            if "conditions" in entry:
                sets = conditions.get("sets", {}) | entry["conditions"]["sets"]
                conditions = entry["conditions"] | {"sets": sets}
                continue
            count = len(entry["rows"]["index"])
            for name in BLANK:
                columns[name] += entry["rows"].get(name, [BLANK[name]] * count)  # older rows have fewer
            for name in PLACE:
                columns[name] += [entry["cell"][name]] * count
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidValue(f"{file} is not the file of a comparison: {error!r}") from error
    if not columns["index"]:
        raise InvalidValue(f"{file} has no rows yet; `taskopt bench run --out {file.parent}` goes on")
    made = {
        name: np.array(column, dtype=object if name in _WORDS else None) for name, column in columns.items()
    }
    return Results(conditions, made)


@dataclass(frozen=True)
class Figures:
    """The figures of one resolver in one setting on some problems.

    Attributes:
        resolver: Name of the resolver.
        setting: Name of the setting.
        answers: Number of problems that it was given.
        known: Number of these whose exact strict optimum is known, or is on the condition of `proven_if`.
        claimed: Share of those for which it claims something.
        proven: Share whose claim is proven.
        proven_if: Share whose claim is proven, provided that rows that depend on others up to rounding
            depend on them exactly.
        undecided: Share whose claim is undecided.
        refuted: Share whose claim is refuted.
        refuted_if: Share whose claim is refuted on the same condition.
        right: Share of the answers within 1e-8 of the exact strict optimum, among those where it is known, or
            is on that condition.
        distance: Median, 95th percentile and largest distance from it, among the same.
        cpu: Processor time, p50, p95 and p99 [s].
        mean: Shifted geometric mean of the processor time [s].
        inside: Wall clock inside the package of the solver, p50 [s]; NaN where it was not measured.
        wall: Wall clock, p50, p99 and largest [s].
        missed: Share of the answers that take longer than 1 ms of wall clock.
        failed: Number of answers that crashed, missed the deadline, or were not tried after that.
    """

    resolver: str
    setting: str
    answers: int
    known: int
    claimed: float
    proven: float
    proven_if: float
    undecided: float
    refuted: float
    refuted_if: float
    right: float
    distance: tuple[float, float, float]
    cpu: tuple[float, float, float]
    mean: float
    inside: float
    wall: tuple[float, float, float]
    missed: float
    failed: int


def growth(snakes: Results, one: Figures) -> list[tuple[int, float]]:
    """Return how the time of a resolver grows.

    Args:
        snakes: Rows of the set "snakes".
        one: The figures that name the resolver and its setting.

    Returns:
        Number of unknowns, and mean processor time [s], NaN where there is none; by number of unknowns.
    """
    sizes = snakes.conditions["sets"]["snakes"]["unknowns"]
    mine = snakes.where(resolver=one.resolver, setting=one.setting)
    return sorted((sizes[name], figures(mine.where(sequence=name)).mean) for name in mine.names("sequence"))


def figures(rows: Results) -> Figures:
    """Compute the figures of rows of one resolver in one setting.

    Args:
        rows: The rows, at least one.

    Returns:
        The figures.
    """
    of = rows.columns
    verdict, distance, cpu, wall = of["verdict"], of["distance"], of["cpu"], of["wall"]
    known = np.isin(of["reference"], KNOWN)
    off = np.where(np.isnan(distance[known]), np.inf, distance[known])
    ran = np.isfinite(cpu)
    return Figures(
        resolver=str(of["resolver"][0]),
        setting=str(of["setting"][0]),
        answers=len(rows),
        known=int(known.sum()),
        claimed=float(np.mean(of["claimed"])),
        proven=float(np.mean(verdict == PROVEN)),
        proven_if=float(np.mean(verdict == PROVEN_IF)),
        undecided=float(np.mean(verdict == UNKNOWN)),
        refuted=float(np.mean(verdict == REFUTED)),
        refuted_if=float(np.mean(verdict == REFUTED_IF)),
        right=float(np.mean(off <= ACCURACY)) if known.any() else np.nan,
        distance=_three(off, (50, 95, 100)),
        cpu=_three(cpu[ran], (50, 95, 99)),
        mean=shifted_mean(cpu[ran]),
        inside=float(np.percentile(of["inside"][ran], 50, method="higher")) if ran.any() else np.nan,
        wall=_three(wall[ran], (50, 99, 100)),
        missed=float(np.mean(wall[ran] > PERIOD)) if ran.any() else np.nan,
        failed=int(np.isin(of["status"], ["CRASHED", "DEADLINE", "NOT RUN"]).sum()),
    )


def all_figures(rows: Results) -> list[Figures]:
    """Compute the figures of every resolver in every setting.

    Args:
        rows: The rows.

    Returns:
        The figures, in the order of the rows.
    """
    pairs = dict.fromkeys(zip(rows.columns["resolver"], rows.columns["setting"], strict=True))
    return [figures(rows.where(resolver=resolver, setting=setting)) for resolver, setting in pairs]


def shifted_mean(seconds: Array) -> float:
    """Return the shifted geometric mean exp(mean log(t + s)) − s, with the shift s of 10 µs.

    Args:
        seconds: Times [s].

    Returns:
        The mean [s]; NaN if there are no times.
    """
    return float(np.exp(np.mean(np.log(seconds + SHIFT)))) - SHIFT if len(seconds) else np.nan


def profile(rows: Results, keys: Sequence[tuple[str, str]]) -> dict[tuple[str, str], Array]:
    """Compute performance profiles, the processor times relative to the quickest proven answer.

    Args:
        rows: The rows.
        keys: Resolvers with their settings.

    Returns:
        Ratios for each of them in ascending order, one for each problem that at least one of them answers
        with a proof; inf where its own answer is not proven.

    Source:
        Dolan and Moré (2002), "Benchmarking optimization software with performance profiles".
    """
    of = rows.columns
    times: dict[tuple[str, str], dict[tuple[Any, ...], float]] = {}
    best: dict[tuple[Any, ...], float] = {}
    for key in keys:
        mine = (of["resolver"] == key[0]) & (of["setting"] == key[1])
        proven = mine & (of["verdict"] == PROVEN)
        places = zip(of["set"][proven], of["sequence"][proven], of["index"][proven], strict=True)
        times[key] = dict(zip(places, of["cpu"][proven].tolist(), strict=True))
        for place, seconds in times[key].items():
            best[place] = min(best.get(place, np.inf), seconds)
    return {
        key: np.sort([found.get(place, np.inf) / least for place, least in best.items()])
        for key, found in times.items()
    }


def _three(values: Array, percentiles: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return three percentiles; NaN if there are no values. Infinite values are ranked above all others."""
    if not len(values):
        return np.nan, np.nan, np.nan
    first, second, third = (np.percentile(values, share, method="higher") for share in percentiles)
    return float(first), float(second), float(third)
