"""Alternation: limits that enter and leave the active set again and again, with the likely cause.

A limit alternates if one of its two bounds becomes active or inactive in many ticks. Each change has symptoms
of one or more causes. A cause is suggested if its symptom appears in half of the changes.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from taskopt.arrays import positive
from taskopt.hierarchy.causes import ADVICE, loses_rank, overshoots
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import DECISIVE_MULTIPLIER

_FEW = 4  # changes of one bound that any run may have, such as one contact at the start and one at the end
_CAUSES = "tolerance", "rank", "gain", "dt"  # in the order in which they are suggested
_JUDGED = 100  # changes of one bound that are examined: more cost time (singular values) and say no more


class Alternation(NamedTuple):
    """A bound that alternates.

    Attributes:
        name: Name of the bound, such as "velocity/joint4 upper".
        changes: Number of ticks in which it became active or inactive.
        per_second: Number of changes per second of the run [1/s].
        cause: The suggested cause, a key of `ADVICE`.
    """

    name: str
    changes: int
    per_second: float
    cause: str

    def __str__(self) -> str:
        often = f"{self.name}: {self.changes} changes, {self.per_second:.0f} a second"
        return f"{often}; {self.cause}: {ADVICE[self.cause]}"


@dataclass
class _Count:
    """The number of changes of one bound, and of those examined that have the symptom of each cause."""

    changes: int = 0
    shows: dict[str, int] = field(default_factory=lambda: dict.fromkeys(_CAUSES, 0))

    @property
    def cause(self) -> str:
        """The first of `_CAUSES` whose symptom appears in half of the changes; "dt" if none does."""
        examined = min(self.changes, _JUDGED)
        return next((cause for cause, shown in self.shows.items() if 2 * shown >= examined), "dt")


class AlternationWatch:
    """Count the alternations of a run tick by tick; only the last tick is kept.

    Args:
        dt: Length of a step [s].

    Raises:
        InvalidValue: dt is not a positive number.
    """

    def __init__(self, dt: float) -> None:
        self._dt, self._ticks = positive("dt", dt), 0
        self._counts: dict[str, _Count] = {}
        self._previous: Resolution | None = None

    def add(self, resolution: Resolution) -> None:
        """Compare the next tick with the one before it.

        Args:
            resolution: The answer of the next tick.
        """
        if self._previous is not None and _may_differ(self._previous, resolution):
            self._compare(self._previous, resolution)
        self._previous, self._ticks = resolution, self._ticks + 1

    def found(self, per_second: float = 10.0) -> tuple[Alternation, ...]:
        """Return the bounds that alternate.

        Args:
            per_second: Least number of changes per second [1/s].

        Returns:
            One entry for each bound, the one with the most changes first.
        """
        seconds = self._ticks * self._dt
        found = [
            Alternation(name, count.changes, count.changes / seconds, count.cause)
            for name, count in self._counts.items()
            if count.changes > _FEW and count.changes >= per_second * seconds
        ]
        return tuple(sorted(found, key=lambda row: -row.changes))

    def _compare(self, previous: Resolution, now: Resolution) -> None:
        """Count each bound that is active in only one of two ticks, with the symptoms of that change."""
        old, new = ({str(row): row.multiplier for row in tick.active} for tick in (previous, now))
        changed = [(name, self._counts.setdefault(name, _Count())) for name in old.keys() ^ new.keys()]
        if any(count.changes < _JUDGED for _, count in changed):
            overshot, near_rank_loss = overshoots(previous, now), loses_rank(previous, now)
            for name, count in changed:
                if count.changes < _JUDGED:
                    tick, multiplier = (previous, old[name]) if name in old else (now, new[name])
                    largest = max(1.0, float(np.abs(tick.multipliers).max()))
                    count.shows["tolerance"] += abs(multiplier) <= DECISIVE_MULTIPLIER * largest
                    count.shows["gain"] += overshot or _crossed(name, old, new)
                    count.shows["rank"] += near_rank_loss
        for _, count in changed:
            count.changes += 1


def alternations(
    resolutions: Iterable[Resolution], dt: float, per_second: float = 10.0
) -> tuple[Alternation, ...]:
    """Return the bounds that alternate in a run, each with a suggested cause.

    The symptoms of a change are, in the order in which the causes are suggested: the multiplier is zero
    (tolerance); a level is near a loss of rank, or its rows changed in one step by more than their smallest
    singular value (rank); the right-hand side of a task changed sign, or a row went from one of its bounds to
    the other (gain). If there is no symptom, the suggested cause is the length of the step (dt).

    Args:
        resolutions: The answers of the run, tick by tick.
        dt: Length of a step [s].
        per_second: Least number of changes per second [1/s].

    Returns:
        One entry for each bound, the one with the most changes first.

    Raises:
        InvalidValue: dt is not a positive number.
    """
    watch = AlternationWatch(dt)
    for resolution in resolutions:
        watch.add(resolution)
    return watch.found(per_second)


def _may_differ(previous: Resolution, now: Resolution) -> bool:
    """Return False if the active bounds of two ticks are known to have the same names."""
    same = np.array_equal(previous.state, now.state)
    return not same or not np.array_equal(previous.problem.owner, now.problem.owner)


def _crossed(name: str, old: dict[str, float], new: dict[str, float]) -> bool:
    """Return True if the row of a changed bound is at its opposite bound in the other tick."""
    row, _, side = name.rpartition(" ")
    other = f"{row} {'lower' if side == 'upper' else 'upper'}"
    return other in (new if name in old else old)
