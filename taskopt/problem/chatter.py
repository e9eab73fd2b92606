"""Limits that bind and let go over and over, by name, with the cause that the ticks speak for."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from taskopt.arrays import positive
from taskopt.problem.hierarchy import Hierarchy
from taskopt.problem.resolution import Resolution

_WEAK = 1e-8  # a price below it, relative to max(1, the largest), decides nothing
_THIN = 1e-3  # σ_min/σ_max of a level below it is near a loss of rank
_FEW = 4  # changes that may have any cause

ADVICE = {
    "tolerance": "it is met at no price, and rounding decides; widen it a little, or ask less next to it",
    "gain": "targets are overshot from tick to tick; lower the gain below 1/Δt",
    "rank": "a level is near a loss of rank there; damp it, or take away rows that say the same",
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
    """The changes of one side, and in how many of them each cause showed."""

    changes: int = 0
    shows: dict[str, int] = field(default_factory=lambda: dict.fromkeys(ADVICE, 0))


def chatter(resolutions: Iterable[Resolution], dt: float, per_second: float = 10.0) -> tuple[Chatter, ...]:
    """The sides that changed at least so often per second of a run with steps of dt [s], most often first.

    A cause is suggested if it showed in half of the changes: no price, targets that changed side from one
    tick to the next, a level near a loss of rank, in this order; else the length of the step.
    """
    positive("dt", dt)
    counts: dict[str, _Count] = {}
    ticks, before = 0, None
    for resolution in resolutions:
        if before is not None:
            _compare(before, resolution, counts)
        before, ticks = resolution, ticks + 1
    found = [
        Chatter(name, count.changes, count.changes / (ticks * dt), _cause(count))
        for name, count in counts.items()
        if count.changes > _FEW and count.changes >= per_second * ticks * dt
    ]
    return tuple(sorted(found, key=lambda row: -row.changes))


def _compare(before: Resolution, now: Resolution, counts: dict[str, _Count]) -> None:
    then, since = ({str(row): row.multiplier for row in tick.active} for tick in (before, now))
    changed = then.keys() ^ since.keys()
    if not changed:
        return
    overshot, thin = _overshot(before.problem, now.problem), _thin(now.problem)
    for name in changed:
        count = counts.setdefault(name, _Count())
        tick, price = (before, then[name]) if name in then else (now, since[name])
        largest = max(1.0, float(np.abs(tick.multipliers).max()))
        count.changes += 1
        count.shows["tolerance"] += abs(price) <= _WEAK * largest
        count.shows["gain"] += overshot
        count.shows["rank"] += thin


def _cause(count: _Count) -> str:
    return next((cause for cause, shown in count.shows.items() if 2 * shown >= count.changes), "dt")


def _overshot(before: Hierarchy, now: Hierarchy) -> bool:
    """Whether an equality row of some task changed the sign of its right-hand side, and not by rounding."""
    same = (before.lower == before.upper) & (now.lower == now.upper)
    least = 1e-9 * np.maximum(1.0, np.abs(now.lower[same]))
    return bool((before.lower[same] * now.lower[same] < -(least**2)).any())


def _thin(hierarchy: Hierarchy) -> bool:
    """Whether rows up to some level are nearly dependent, but not quite."""
    for k in range(1, hierarchy.layout.level_count + 1):
        A = hierarchy.A[: int(hierarchy.layout.offsets[k + 1])]
        sigma = np.linalg.svd(A, compute_uv=False)
        if sigma.size and ((sigma > 1e-12 * sigma[0]) & (sigma < _THIN * sigma[0])).any():
            return True
    return False
