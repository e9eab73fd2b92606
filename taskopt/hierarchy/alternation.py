"""Limits that bind and let go over and over, by name, with the cause that the ticks speak for."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from taskopt.arrays import positive
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution

_WEAK = 1e-8  # a price below it, relative to max(1, the largest), decides nothing
_THIN = 1e-3  # σ_min/σ_max of a level below it is near a loss of rank
_FEW = 4  # changes that may have any cause
_JUDGED = 100  # changes of one side that are looked at for their cause

ADVICE = {
    "tolerance": "it is met at no price, and rounding decides; widen it a little, or ask less next to it",
    "rank": "a level is near a loss of rank, as where a target is out of reach; damp it, or ask for less",
    "gain": "targets are overshot from tick to tick; lower the gain below 1/Δt",
    "dt": "the bound itself moves more than a step can follow; shorten Δt, or lower the limit's gain",
}


class Chatter(NamedTuple):
    """How often one side of a limit bound or let go, and why: a key of `ADVICE`."""

    name: str
    changes: int
    per_second: float
    cause: str

    def __str__(self) -> str:
        often = f"{self.name}: {self.changes} changes, {self.per_second:.0f} a second"
        return f"{often}; {self.cause}: {ADVICE[self.cause]}"


@dataclass
class _Count:
    """The changes of one side, and in how many of those looked at each cause showed."""

    changes: int = 0
    shows: dict[str, int] = field(default_factory=lambda: dict.fromkeys(ADVICE, 0))

    @property
    def cause(self) -> str:
        looked_at = min(self.changes, _JUDGED)
        return next((cause for cause, shown in self.shows.items() if 2 * shown >= looked_at), "dt")


class ChatterWatch:
    """Counts tick by tick, with steps of dt [s]; keeps no tick but the last."""

    def __init__(self, dt: float) -> None:
        self._dt, self._ticks = positive("dt", dt), 0
        self._counts: dict[str, _Count] = {}
        self._before: Resolution | None = None

    def add(self, resolution: Resolution) -> None:
        """Take the next tick in."""
        if self._before is not None and _differ(self._before, resolution):
            self._compare(self._before, resolution)
        self._before, self._ticks = resolution, self._ticks + 1

    def found(self, per_second: float = 10.0) -> tuple[Chatter, ...]:
        """The sides that changed at least so often per second, most often first."""
        seconds = self._ticks * self._dt
        found = [
            Chatter(name, count.changes, count.changes / seconds, count.cause)
            for name, count in self._counts.items()
            if count.changes > _FEW and count.changes >= per_second * seconds
        ]
        return tuple(sorted(found, key=lambda row: -row.changes))

    def _compare(self, before: Resolution, now: Resolution) -> None:
        then, since = ({str(row): row.multiplier for row in tick.active} for tick in (before, now))
        changed = [(name, self._counts.setdefault(name, _Count())) for name in then.keys() ^ since.keys()]
        if any(count.changes < _JUDGED for _, count in changed):
            overshot, thin = _overshot(before, now), _thin(before.problem, now.problem)
            for name, count in changed:
                if count.changes < _JUDGED:
                    tick, price = (before, then[name]) if name in then else (now, since[name])
                    largest = max(1.0, float(np.abs(tick.multipliers).max()))
                    count.shows["tolerance"] += abs(price) <= _WEAK * largest
                    count.shows["gain"] += overshot or _crossed(name, then, since)
                    count.shows["rank"] += thin
        for _, count in changed:
            count.changes += 1


def chatter(resolutions: Iterable[Resolution], dt: float, per_second: float = 10.0) -> tuple[Chatter, ...]:
    """The sides that changed at least so often per second of a run with steps of dt [s], most often first.

    A cause is suggested if it showed in half of the changes: no price; a level near a loss of rank, or rows
    that one step changed by more than their smallest singular value; targets that changed side, or a row
    that went from one of its bounds to the other, from one tick to the next; in this order. Else it is the
    length of the step.
    """
    watch = ChatterWatch(dt)
    for resolution in resolutions:
        watch.add(resolution)
    return watch.found(per_second)


def _differ(before: Resolution, now: Resolution) -> bool:
    """Whether the names of what is active may differ; names cost more than states."""
    same = np.array_equal(before.state, now.state)
    return not same or not np.array_equal(before.problem.owner, now.problem.owner)


def _crossed(name: str, then: dict[str, float], since: dict[str, float]) -> bool:
    """Whether the row of a side was at its other bound in the tick beside."""
    row, _, side = name.rpartition(" ")
    other = f"{row} {'lower' if side == 'upper' else 'upper'}"
    return other in (since if name in then else then)


def _overshot(before: Resolution, now: Resolution) -> bool:
    """Whether an equality row of some task changed the sign of its right-hand side, and not by rounding."""
    a, b = before.problem, now.problem
    same = (a.lower == a.upper) & (b.lower == b.upper)
    least = 1e-9 * np.maximum(1.0, np.abs(b.lower[same]))
    return bool((a.lower[same] * b.lower[same] < -(least**2)).any())


def _thin(before: Hierarchy, now: Hierarchy) -> bool:
    """Whether rows up to some level are nearly dependent, but not quite; a step may pass by dependence."""
    for k in range(1, now.layout.level_count + 1):
        stop = int(now.layout.offsets[k + 1])
        A = now.A[:stop]
        if not A.size:
            continue
        sigma = np.linalg.svd(A, compute_uv=False)
        near = max(_THIN * sigma[0], float(np.linalg.norm(A - before.A[:stop])))
        if ((sigma > 1e-12 * sigma[0]) & (sigma < near)).any():
            return True
    return False
