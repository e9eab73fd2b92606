"""What continuous integration asks of a log: no limit violated, every answer proven, no deadline missed."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.certificate import broken_limit
from taskopt.hierarchy.tolerances import CLAIM_KEEPS_LIMITS
from taskopt.log.description import PROBLEM
from taskopt.log.reading import Log

_LATE = 2.0  # periods between two ticks, from which one of them counts as late


class Claim(NamedTuple):
    """What was found about one question.

    Attributes:
        name: "error", "violation", "unproven" or "deadline".
        resolver: Name of the resolver.
        rows: Rows at which it is so, (k,).
        ticks: Number of ticks that were examined.
        text: A sentence.
    """

    name: str
    resolver: str
    rows: IntArray
    ticks: int
    text: str


def claims(log: Log, *, prove: bool = False) -> list[Claim]:
    """Examine all ticks of a log.

    A violation is an answer that was sent and breaks a hard limit of its tick by more than `taskopt` lets a
    resolver claim, relative to the largest term of the row. A deadline is missed if resolver and rows took
    longer than Δt; where that was not measured, if two ticks are two periods apart by the wall clock.

    Args:
        log: The log.
        prove: Also bound the error of every answer, which takes milliseconds a tick.

    Returns:
        Findings by resolver, those without a tick, too.
    """
    kinds = [_errors, _violations, *([_unproven] if prove else []), _deadlines]
    return [kind(log, name, log.rows(name)) for name in log.resolvers for kind in kinds]


def _errors(log: Log, resolver: str, rows: IntArray) -> Claim:
    """Find ticks that raised an error."""
    return _claim(log, "error", resolver, rows, log.array("failed")[rows].astype(bool), "raised an error")


def _violations(log: Log, resolver: str, rows: IntArray) -> Claim:
    """Find answers that break a limit."""
    failed, size = log.array("failed")[rows].astype(bool), np.zeros(len(rows))
    for i, (buffer, x) in enumerate(_sent(log, rows)):
        size[i] = 0.0 if failed[i] else broken_limit(log.layout, buffer, x)
    worst = f"broke a hard limit, by up to {size.max(initial=0.0):.3g} of its largest term"
    return _claim(log, "violation", resolver, rows, size > CLAIM_KEEPS_LIMITS, worst)


def _sent(log: Log, rows: IntArray) -> Iterator[tuple[Array, Array]]:
    """Yield the numbers of the hierarchy and what was sent at each row."""
    parts = [log.array(name)[rows].astype(np.float64) for name in PROBLEM]
    yield from zip(np.hstack(parts), log.array("x")[rows].astype(np.float64), strict=True)


def _unproven(log: Log, resolver: str, rows: IntArray) -> Claim:
    """Find answers whose error is not proven to be small."""
    found = np.array([not log.tick(int(row)).resolution.proven for row in rows], dtype=bool)
    return _claim(log, "unproven", resolver, rows, found, "are not proven to be the optimum")


def _deadlines(log: Log, resolver: str, rows: IntArray) -> Claim:
    """Find ticks that took too long, or came too late."""
    dt = log.array("dt")[rows].astype(np.float64)
    seconds = log.array("seconds")[rows].astype(np.float64)
    if np.isfinite(seconds).any():
        took = seconds + log.array("build_seconds")[rows].astype(np.float64)
        worst = f"took longer than Δt, up to {1e3 * np.nanmax(took):.3g} ms"
        return _claim(log, "deadline", resolver, rows, took > dt, worst)
    apart = 1e-9 * np.diff(log.array("clock")[rows].astype(np.float64), prepend=np.nan)
    longest = 1e3 * np.nanmax(apart) if len(rows) > 1 else 0.0
    worst = f"came two periods or more after the one before by the wall clock, up to {longest:.3g} ms"
    return _claim(log, "deadline", resolver, rows, apart >= _LATE * dt, worst)


def _claim(log: Log, name: str, resolver: str, rows: IntArray, found: Mask, what: str) -> Claim:
    """Return a finding with its sentence."""
    own = rows[found]
    first = f", first at {log.t[own[0]]:.6g} s" if len(own) else ""
    verb = what if len(own) else what.partition(", ")[0]
    return Claim(name, resolver, own, len(rows), f"{len(own)} of {len(rows)} ticks {verb}{first}")


CHECKS: tuple[str, ...] = ("error", "violation", "unproven", "deadline")
"""The questions, by name."""
